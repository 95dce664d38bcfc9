#include <absl/strings/str_cat.h>

#include "lpss/model/validate.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

// The centre frame of a body as it is simulated: that of a static one is its body frame.
Pose simulated_centre(const BodyProperties& properties) {
  return properties.motion == Motion::kStatic ? Pose{} : centre_frame(properties);
}

Pose normalized(const Pose& pose) { return {pose.position, pose.orientation.normalized()}; }

}  // namespace

absl::StatusOr<JointProperties> joint_properties_of(const JointProperties& joint,
                                                    const BodyProperties* parent, const BodyProperties& child,
                                                    double sector_size) {
  JointProperties result = joint;
  result.in_child = normalized(simulated_centre(child).inverse() * joint.in_child);
  if (parent != nullptr) {
    result.in_parent = normalized(simulated_centre(*parent).inverse() * joint.in_parent);
    result.anchor = {};
    return result;
  }
  const absl::StatusOr<WorldPosition> place = canonical(joint.anchor, joint.in_parent.position, sector_size);
  if (!place.ok()) return place.status();
  result.anchor = place->sector;
  result.in_parent = {place->local, joint.in_parent.orientation.normalized()};
  return result;
}

absl::StatusOr<std::vector<JointRecord>> joint_records_of(const WorldDescription& world) {
  if (absl::Status status = validate_joints(world); !status.ok()) return status;
  std::vector<JointRecord> records;
  records.reserve(world.joints.size());
  for (const JointDescription& joint : world.joints) {
    const BodyId parent = joint.properties.parent;
    const BodyProperties* parent_body =
        parent.value == 0 ? nullptr : &world.bodies[parent.value - 1].properties;
    const BodyProperties& child_body = world.bodies[joint.properties.child.value - 1].properties;
    const absl::StatusOr<JointProperties> properties =
        joint_properties_of(joint.properties, parent_body, child_body, world.settings.sector_size);
    if (!properties.ok()) {
      return absl::Status(properties.status().code(),
                          absl::StrCat("joint '", joint.name, "': ", properties.status().message()));
    }
    const Motion parent_motion = parent_body == nullptr ? Motion::kStatic : parent_body->motion;
    records.push_back({JointId{records.size() + 1}, *properties, parent_motion, joint.drives});
  }
  return records;
}

}  // namespace tessera
