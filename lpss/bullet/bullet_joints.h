// Joints as Bullet's own constraints: the baseline of experiments.
#pragma once

#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpring2Constraint.h>

#include <memory>
#include <vector>

#include "lpss/engine/engine.h"

namespace tessera::bullet {

// Each joint becomes what Bullet's importer of URDF files makes of it for rigid bodies: a
// btGeneric6DofSpring2Constraint, with Bullet's defaults. Limits, springs, dampers and drives go to Bullet's
// own; friction of an axis is a motor that holds it. Left out: velocity and effort of a servo.
class BulletJoints {
 public:
  void clear();
  // Not a screw, and no axis that follows another: Bullet has no such constraint. The parent must not move,
  // or be dynamic. While the bodies of the task stay where they are in memory.
  void add(const TaskJoint& joint);

  btTypedConstraint** data() { return pointers_.data(); }
  int size() const { return static_cast<int>(pointers_.size()); }

 private:
  std::vector<std::unique_ptr<btGeneric6DofSpring2Constraint>> constraints_;
  std::vector<btTypedConstraint*> pointers_;  // to them
};

}  // namespace tessera::bullet
