// Two axes of two joints of which one follows the other: a row over the velocities of up to four bodies.
#pragma once

#include <array>

#include "lpss/joints/joint_rows.h"

namespace tessera::joints {

class JointCoupling {
 public:
  // The follower's axis has a mimic of an axis of the leader. Both must outlive this.
  JointCoupling(const JointForm& follower, int axis, const JointForm& leader);

  // rad or m, by which the follower is off. Angles without limits are known up to whole turns; what is left
  // of that is the way to the nearest position that fits some number of turns. 0 where nothing is left: of
  // two such angles whose multiplier is no ratio of small whole numbers, only the rates are coupled.
  double error(const PosedJoint& follower, const PosedJoint& leader) const;

  // Those of the follower and of the leader, whose sum is the rate of the error.
  std::array<JointRow, 2> rows(const PosedJoint& follower, const PosedJoint& leader) const;

 private:
  const JointForm* follower_;
  const JointForm* leader_;
  int axis_;
  AxisMimic mimic_;
  double period_;  // rad or m, up to which the error is known
};

}  // namespace tessera::joints
