#include "lpss/partition/seam_rules.h"

#include "lpss/partition/clone_rules.h"
#include "lpss/partition/near_seam.h"
#include "lpss/partition/partition.h"

namespace tessera {

OffsetSet SeamRules::sectors_to_tell(const Partition& partition, const Eigen::AlignedBox3d& swept,
                                     const Eigen::Vector3d& velocity, double surge, Motion motion) const {
  const Eigen::Vector3d way = velocity * partition.dt();
  const bool goes_fast = is_fast(way, partition.margins, surge);
  OffsetSet reached = sectors_within_reach(swept, way, partition.margins);
  if (goes_fast && motion == Motion::kDynamic)
    reached.merge(homes_of_slower(swept, way, partition.margins, surge));
  return clone_targets(reached, motion, goes_fast);
}

const SeamRules& seam_rules(SeamPolicy policy) {
  static const SeamRules of_islands;
  static const CloneRules of_clones;
  return policy == SeamPolicy::kClone ? of_clones : of_islands;
}

}  // namespace tessera
