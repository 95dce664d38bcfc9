#include "lpss/joints/task_joint.h"

namespace tessera::joints {

PosedJoint posed(const TaskJoint& joint, const JointSide& child, const std::optional<JointSide>& parent) {
  PosedJoint posed;
  posed.child = child;
  posed.in_child = joint.properties->in_child;
  if (parent) {
    posed.parent = *parent;
    posed.parent.pose.position += joint.parent_origin;
    posed.in_parent = joint.properties->in_parent;
  } else {
    posed.parent = {joint.fixed_parent, joint.fixed_velocity, joint.fixed_spin};
  }
  return posed;
}

}  // namespace tessera::joints
