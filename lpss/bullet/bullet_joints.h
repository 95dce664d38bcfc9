// Joints as Bullet's own constraints: the baseline of experiments.
#pragma once

#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpring2Constraint.h>

#include <memory>

#include "lpss/model/joint.h"

namespace tessera::bullet {

// A joint as Bullet's importer of URDF files makes it for rigid bodies: with Bullet's defaults. Limits,
// springs, dampers and drives go to Bullet's own; friction of an axis is a motor that holds it. Left out:
// velocity and effort of a servo. `in_parent` is the joint's frame in the parent's. Not a screw, and no axis
// that follows another: Bullet has no such constraint. The bodies outlive it.
std::unique_ptr<btGeneric6DofSpring2Constraint> make_joint(const JointRecord& joint, btRigidBody& parent,
                                                           const btTransform& in_parent, btRigidBody& child);

}  // namespace tessera::bullet
