// The policy clone, the paper's Cloning Manager: every sector solves its own bodies and clones of others.
//
// Both sectors of a pair have a clone of the other one's body, however fast that is, and clones touch each
// other and fall. With a clone depth of k, what touches a cloned body is cloned with it, k - 1 contacts deep.
#pragma once

#include "lpss/partition/seam_rules.h"

namespace tessera {

class CloneRules final : public SeamRules {
 public:
  bool clones_are_solved() const override { return true; }
  OffsetSet sectors_to_tell(const Partition& partition, const Eigen::AlignedBox3d& swept,
                            const Eigen::Vector3d& velocity, double surge, Motion motion) const override;
  // All of them: any may touch one that is cloned.
  void attend_inside(Sector& sector) const override;
  void extend_search(Partition& partition) const override;
  // One that supports other clones, and one that a joint ties to a body of the sector.
  bool needs_clone(const Partition& partition, BodyId id, const Sector& sector) const override;
  void pull_clone(const Partition& partition, const Clone& clone) const override;
  // The sector that would find the contact under the policy island does; nobody, of what two clones do.
  bool reports(const Partition& partition, const Sector& sector, const ContactPair& pair) const override;
};

}  // namespace tessera
