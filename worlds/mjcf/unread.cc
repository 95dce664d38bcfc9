#include "worlds/mjcf/unread.h"

#include <absl/strings/string_view.h>

#include <string>

namespace tessera::mjcf {

void note_unread(const mjModel& model, Notices& notices) {
  const auto note = [&](int times, const char* kind) {
    if (times > 0) notices.count(kind, static_cast<std::size_t>(times));
  };
  note(model.ncam, "<camera> skipped");
  note(model.ntendon, "<tendon>, not simulated");
  const mjOption& option = model.opt;
  note(option.density > 0 || option.viscosity > 0 ? 1 : 0,
       "'density' or 'viscosity' of the world, not simulated");
  note(vector_at(option.wind).isZero(0) ? 0 : 1, "'wind' of the world, not simulated");
  note(option.enableflags != 0 ? 1 : 0, "<flag> that turns something on, skipped");
}

void note_free_joint(const mjModel& model, int joint, Notices& notices) {
  const int freedom = model.jnt_dofadr[joint];
  if (model.dof_damping[freedom] != 0) notices.count("'damping' of a free joint, not simulated");
  if (model.dof_armature[freedom] != 0) notices.count("'armature' of a free joint, not simulated");
  if (model.jnt_stiffness[joint] != 0) notices.count("'stiffness' of a free joint, not simulated");
}

}  // namespace tessera::mjcf
