// A whole world in one piece, stepped by the library that an engine stands on: what people have without
// Tessera, for comparison.
#pragma once

#include <memory>

#include "lpss/engine/engine.h"

namespace tessera {

// Positions are relative to the world's own origin. What is added stays. Not for several threads at a time.
class WholeWorld {
 public:
  virtual ~WholeWorld() = default;

  // `record.home` is ignored.
  virtual BodySlot add(const BodyRecord& record) = 0;

  // Adds a joint of two bodies, or gives it other drives, which wakes the child. `in_parent` is the joint's
  // frame in the parent's centre frame, in the world's if there is no parent (kNoSlot). Not a screw, and no
  // axis that follows another.
  virtual void set_joint(const JointRecord& joint, BodySlot child, BodySlot parent,
                         const Pose& in_parent) = 0;

  // The acceleration (m/s^2) for the next steps, in the place of uniform gravity. Ignored for bodies without
  // gravity.
  virtual void set_gravity(BodySlot slot, const Eigen::Vector3d& acceleration) = 0;

  virtual void step(double dt) = 0;

  virtual BodyState state(BodySlot slot) const = 0;
};

}  // namespace tessera
