#include "lpss/partition/joint_index.h"

#include <algorithm>

#include "lpss/base/invariant.h"

namespace tessera {

void JointIndex::add(const JointRecord& record) {
  const auto [place, is_new] = joints_.try_emplace(record.id, record);
  invariant(is_new, "a joint id is given once");
  for (const BodyId body : {record.properties.parent, record.properties.child}) {
    if (body.value == 0) continue;
    std::vector<JointId>& listed = by_body_[body];
    listed.insert(std::upper_bound(listed.begin(), listed.end(), record.id), record.id);
  }
}

bool JointIndex::remove(JointId id) {
  const auto place = joints_.find(id);
  if (place == joints_.end()) return false;
  unlist(place->second.properties.parent, id);
  unlist(place->second.properties.child, id);
  joints_.erase(place);
  return true;
}

void JointIndex::unlist(BodyId body, JointId id) {
  const auto listed = by_body_.find(body);
  if (listed == by_body_.end()) return;
  std::erase(listed->second, id);
  if (listed->second.empty()) by_body_.erase(listed);
}

const JointRecord* JointIndex::find(JointId id) const {
  const auto place = joints_.find(id);
  return place == joints_.end() ? nullptr : &place->second;
}

JointRecord* JointIndex::find(JointId id) {
  const auto place = joints_.find(id);
  return place == joints_.end() ? nullptr : &place->second;
}

std::span<const JointId> JointIndex::of(BodyId body) const {
  const auto listed = by_body_.find(body);
  if (listed == by_body_.end()) return {};
  return listed->second;
}

}  // namespace tessera
