#include "coordinator/models.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "lpss/model/checks.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/programs/module.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// What a model takes from the world that it comes to. The bodies that carry frames are the world's, and the
// model has none of them; modules come on top.
WorldSettings settings_outside(WorldSettings settings) {
  for (MovingFrame& frame : settings.frames) frame.carrier.reset();
  settings.modules.clear();
  return settings;
}

v1::World world_of(const v1::Model& model, const WorldSettings& settings) {
  v1::World world;
  *world.mutable_settings() = to_proto(settings);
  *world.mutable_shapes() = model.shapes();
  *world.mutable_bodies() = model.bodies();
  *world.mutable_joints() = model.joints();
  *world.mutable_frames() = model.frames();
  return world;
}

// A place that is relative to the centre of the sector (0, 0, 0), where that is at `origin`.
absl::StatusOr<WorldPose> moved(const WorldPose& origin, const SectorIndex& sector, const Pose& pose,
                                double sector_size) {
  return compose(origin, {metres_between({}, sector, sector_size) + pose.position, pose.orientation},
                 sector_size);
}

absl::Status move(WorldDescription& model, const WorldPose& origin) {
  const double size = model.settings.sector_size;
  for (BodyDescription& body : model.bodies) {
    const WorldPosition& at = body.pose.position;
    const absl::StatusOr<WorldPose> pose =
        moved(origin, at.sector, {at.local, body.pose.orientation.normalized()}, size);
    if (!pose.ok()) return in(absl::StrCat("body '", body.name, "'"), pose.status());
    body.pose = *pose;
    body.linear_velocity = origin.orientation * body.linear_velocity;
    body.angular_velocity = origin.orientation * body.angular_velocity;
  }
  for (JointDescription& joint : model.joints) {
    JointProperties& properties = joint.properties;
    if (properties.parent.value != 0) continue;
    const absl::StatusOr<WorldPose> pose = moved(origin, properties.anchor, properties.in_parent, size);
    if (!pose.ok()) return in(absl::StrCat("joint '", joint.name, "'"), pose.status());
    properties.anchor = pose->position.sector;
    properties.in_parent = {pose->position.local, pose->orientation};
  }
  return absl::OkStatus();
}

// With those of the model, which come after the others.
absl::StatusOr<ProgramModules> all_modules(ProgramModules modules, const v1::Model& model) {
  for (int n = 0; n < model.modules_size(); ++n) {
    absl::StatusOr<std::shared_ptr<const ProgramModule>> module = load_module(model.modules(n));
    if (!module.ok()) return in(absl::StrCat("model: module ", n), module.status());
    if (std::ranges::find(modules, *module) == modules.end()) modules.push_back(*std::move(module));
    if (modules.size() > kModulesMax) {
      return absl::ResourceExhaustedError(
          absl::StrCat("model: with its modules, the world would have more than ", kModulesMax));
    }
  }
  return modules;
}

void give_names(WorldDescription& model, const std::string& prefix, const ModelNames& names) {
  for (std::size_t n = 0; n < model.bodies.size(); ++n) {
    std::string& name = model.bodies[n].name;
    name = absl::StrCat(prefix, name.empty() ? names.body(n) : name);
  }
  for (std::size_t n = 0; n < model.joints.size(); ++n) {
    std::string& name = model.joints[n].name;
    name = absl::StrCat(prefix, name.empty() ? names.joint(n) : name);
  }
  for (FrameDescription& frame : model.frames) frame.name = prefix + frame.name;
}

// Apart from those of all other models.
void number_assemblies(WorldDescription& model, std::uint64_t first) {
  std::map<std::uint64_t, std::uint64_t> numbers;
  for (BodyDescription& body : model.bodies) {
    std::uint64_t& assembly = body.properties.assembly;
    if (assembly != 0) assembly = numbers.try_emplace(assembly, first + numbers.size()).first->second;
  }
}

}  // namespace

absl::StatusOr<WorldDescription> placed_model(const v1::Spawn& spawn, const WorldSettings& settings,
                                              std::uint64_t first_assembly, const ModelNames& names) {
  if (spawn.model().bodies().empty()) return refused("model: it must have a body");
  absl::StatusOr<ProgramModules> modules = all_modules(settings.modules, spawn.model());
  if (!modules.ok()) return modules.status();
  WorldSettings outside = settings_outside(settings);
  absl::StatusOr<WorldDescription> model = from_proto(world_of(spawn.model(), outside));
  if (!model.ok()) return model.status();
  model->settings = std::move(outside);
  model->settings.modules = *std::move(modules);
  give_names(*model, spawn.prefix(), names);
  number_assemblies(*model, first_assembly);
  if (spawn.has_pose()) {
    WorldPose origin = from_proto(spawn.pose());
    const absl::StatusOr<WorldPosition> place =
        canonical(origin.position.sector, origin.position.local, settings.sector_size);
    if (!place.ok()) return in("pose", place.status());
    if (absl::Status status = unit_quaternion("pose", origin.orientation); !status.ok()) return status;
    if (absl::Status status = validate(*model); !status.ok()) return status;
    origin = {*place, origin.orientation.normalized()};
    if (absl::Status status = move(*model, origin); !status.ok()) return status;
  }
  return model;
}

}  // namespace tessera
