#include "lpss/bullet/task_joint.h"

#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/conversions.h"

namespace tessera::bullet {
namespace {

JointSide side_of(const btRigidBody& rigid) {
  const btTransform& pose = rigid.getWorldTransform();
  return {{to_eigen(pose.getOrigin()), Eigen::Quaterniond(to_eigen(pose.getBasis())).normalized()},
          to_eigen(rigid.getLinearVelocity()),
          to_eigen(rigid.getAngularVelocity())};
}

PosedJoint posed(const TaskJoint& joint) {
  PosedJoint posed;
  posed.child = side_of(rigid_of(joint.child));
  posed.in_child = joint.properties->in_child;
  if (joint.parent.world) {
    posed.parent = side_of(rigid_of(joint.parent));
    posed.parent.pose.position += joint.parent_origin;
    posed.in_parent = joint.properties->in_parent;
  } else {
    posed.parent = {joint.fixed_parent, joint.fixed_velocity, joint.fixed_spin};
  }
  return posed;
}

}  // namespace

SolvedJoint solved_joint(const TaskJoint& joint) {
  const int child = rigid_of(joint.child).getCompanionId();
  const btRigidBody* parent = joint.parent.world ? &rigid_of(joint.parent) : nullptr;
  std::optional<int> pushed;
  if (parent && !parent->isStaticOrKinematicObject()) pushed = parent->getCompanionId();
  return {child, pushed, joint.properties, joint.drives, posed(joint)};
}

}  // namespace tessera::bullet
