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
  const auto look_at = [&](BodyId body, Rank here) {
    for (const JointId id : partition.joints.of(body)) {
      const JointTie& joint = *partition.joints.find(id);
      const bool has_fixed_parent = joint.parent_motion != Motion::kDynamic;
      if (has_fixed_parent && joint.child != body) continue;
      for_each_tied(partition.joints, joint, body, [&](BodyId tied) {
        const bool is_fixed = tied.value == 0 || (has_fixed_parent && tied == joint.parent);
        if (!is_fixed && host_of(tied) != here) ends.push_back({body, tied, here});
      });
    }
  };
  for (const BodyId body : partition.jointed) {
    if (!leaving.contains(body)) look_at(body, partition.self);
  }
  for (const auto& [body, rank] : leaving) look_at(body, rank);
  return ends;
}

}  // namespace tessera
