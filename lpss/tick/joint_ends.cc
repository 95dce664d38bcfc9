#include "lpss/tick/joint_ends.h"

#include <optional>

namespace tessera {

std::vector<JointEnd> joint_ends(const Partition& partition, const std::vector<Exchange>& outbox) {
  std::vector<JointEnd> ends;
  if (partition.joints.empty()) return ends;
  JointHosts leaving;
  for (Rank rank = 0; rank < outbox.size(); ++rank) {
    for (const Handover& handover : outbox[rank].handovers) leaving.emplace(handover.record.id, rank);
  }
  const auto host_of = [&](BodyId id) -> std::optional<Rank> {
    if (const auto found = leaving.find(id); found != leaving.end()) return found->second;
    if (partition.bodies.contains(id)) return partition.self;
    return std::nullopt;
  };
  partition.joints.for_each([&](const JointRecord& joint) {
    const BodyId child = joint.properties.child;
    for_each_tied(partition.joints, joint, child, [&](BodyId tied) {
      const bool is_fixed = tied == joint.properties.parent && joint.parent_motion != Motion::kDynamic;
      if (tied.value == 0 || is_fixed) return;
      const std::optional<Rank> here = host_of(child);
      const std::optional<Rank> there = host_of(tied);
      if (here == there) return;
      if (here) ends.push_back({child, tied, *here});
      if (there) ends.push_back({tied, child, *there});
    });
  });
  return ends;
}

}  // namespace tessera
