#include "worlds/mjcf/equalities.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "worlds/loader/joint_reader.h"
#include "worlds/mjcf/joints.h"

namespace tessera::mjcf {
namespace {

class EqualityReader {
 public:
  EqualityReader(const mjModel& model, const SensorBodies& bodies, const AxisPlaces& axes, Names& names,
                 WorldDescription& world, Notices& notices)
      : model_(model), bodies_(bodies), axes_(axes), names_(names), world_(world), notices_(notices) {}

  void read(int n) {
    if (model_.eq_active[n] == 0) {
      notices_.count("equality that is not active, skipped");
      return;
    }
    const mjtNum* const data = model_.eq_data + mjNEQDATA * n;
    switch (model_.eq_type[n]) {
      case mjEQ_CONNECT:
        hold(n, JointType::kBall, {vector_at(data)}, {vector_at(data + 3)});
        break;
      case mjEQ_WELD:
        hold(n, JointType::kFixed, {vector_at(data + 3), quaternion_at(data + 6)}, {vector_at(data)});
        break;
      case mjEQ_JOINT:
        follow(n, data);
        break;
      default:
        notices_.count("equality of tendons, not simulated");
    }
  }

 private:
  bool is_dynamic(int body) const {
    const auto place = static_cast<std::size_t>(body);
    return bodies_.moves[place] &&
           world_.bodies[bodies_.places[place].body].properties.motion == Motion::kDynamic;
  }

  // A frame on one of MuJoCo's bodies, in that of ours.
  Pose in_ours(int body, const Pose& pose) const {
    const auto place = static_cast<std::size_t>(body);
    return bodies_.places[place].pose * pose;
  }

  void hold(int n, JointType type, const Pose& in_first, const Pose& in_second) {
    int parent = model_.eq_obj1id[n];
    int child = model_.eq_obj2id[n];
    Pose in_parent = in_first;
    Pose in_child = in_second;
    if (!is_dynamic(child)) {
      std::swap(parent, child);
      std::swap(in_parent, in_child);
    }
    if (!is_dynamic(child)) {
      notices_.count("equality of bodies that no force moves, skipped");
      return;
    }
    JointDescription joint;
    JointProperties& properties = joint.properties;
    properties.type = type;
    properties.bodies_collide = true;
    properties.in_parent = in_ours(parent, in_parent);
    properties.in_child = in_ours(child, in_child);
    properties.child = BodyId{bodies_.places[static_cast<std::size_t>(child)].body + 1};
    if (bodies_.moves[static_cast<std::size_t>(parent)])
      properties.parent = BodyId{bodies_.places[static_cast<std::size_t>(parent)].body + 1};
    if (!anchor(properties, world_.settings.sector_size).ok()) return;
    if (properties.parent == properties.child) {
      notices_.count("equality of bodies that are one, skipped");
      return;
    }
    const char* const kind = type == JointType::kBall ? "connect" : "weld";
    joint.name = names_.unique(fit_name(name_at(model_, model_.name_eqadr, n), absl::StrCat(kind, "_", n)));
    world_.joints.push_back(std::move(joint));
    notices_.count_joint(kind);
  }

  // y - y0 = a0 + a1 (x - x0).
  void follow(int n, const mjtNum* data) {
    const auto own = axes_.find(model_.eq_obj1id[n]);
    const auto other = axes_.find(model_.eq_obj2id[n]);
    const bool is_alone = model_.eq_obj2id[n] < 0;
    const bool is_line = data[2] == 0 && data[3] == 0 && data[4] == 0;
    if (own == axes_.end() || (!is_alone && (other == axes_.end() || !is_line))) {
      notices_.count("equality of joints that is not a line, not simulated");
      return;
    }
    const auto zero = [&](int joint) {
      return model_.qpos0[model_.jnt_qposadr[joint]] - turns_of(model_, joint);
    };
    JointAxis& axis = world_.joints[own->second.joint].properties.axes[own->second.axis];
    if (is_alone) {
      axis.lower = axis.upper = zero(own->first) + data[0];
      notices_.count("equality of a joint: its limits are where that holds it");
      return;
    }
    if (axis.mimic.is_set()) {
      notices_.count("equality of a joint that follows another one already, not simulated");
      return;
    }
    axis.mimic.leader = JointId{other->second.joint + 1};
    axis.mimic.axis = static_cast<std::uint8_t>(other->second.axis);
    axis.mimic.multiplier = data[1];
    axis.mimic.reference = zero(other->first);
    axis.mimic.offset = zero(own->first) + data[0];
    notices_.count("equality of joints: one follows the other");
  }

  const mjModel& model_;
  const SensorBodies& bodies_;
  const AxisPlaces& axes_;
  Names& names_;
  WorldDescription& world_;
  Notices& notices_;
};

}  // namespace

void add_equalities(const mjModel& model, const SensorBodies& bodies, const AxisPlaces& axes, Names& names,
                    WorldDescription& world, Notices& notices) {
  if ((model.opt.disableflags & (mjDSBL_EQUALITY | mjDSBL_CONSTRAINT)) != 0) return;
  EqualityReader reader(model, bodies, axes, names, world, notices);
  for (int n = 0; n < model.neq; ++n) reader.read(n);
}

}  // namespace tessera::mjcf
