#include "lpss/partition/joint_index.h"

#include <algorithm>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

void insert_sorted(std::vector<JointId>& list, JointId id) {
  const auto place = std::lower_bound(list.begin(), list.end(), id);
  if (place == list.end() || *place != id) list.insert(place, id);
}

template <typename Key>
std::span<const JointId> listed_in(const absl::flat_hash_map<Key, std::vector<JointId>>& lists, Key key) {
  const auto found = lists.find(key);
  if (found == lists.end()) return {};
  return found->second;
}

}  // namespace

void JointIndex::add(const JointRecord& record) {
  const auto [place, is_new] = joints_.try_emplace(record.id, record);
  invariant(is_new, "a joint id is given once");
  for (const BodyId body : {record.properties.parent, record.properties.child}) {
    if (body.value == 0) continue;
    insert_sorted(by_body_[body], record.id);
  }
  // The leader may come later, or may have gone already.
  for (const JointAxis& axis : axes_of(record.properties)) {
    if (!axis.mimic.is_set()) continue;
    insert_sorted(coupled_[record.id], axis.mimic.leader);
    insert_sorted(coupled_[axis.mimic.leader], record.id);
  }
}

bool JointIndex::remove(JointId id) {
  const auto place = joints_.find(id);
  if (place == joints_.end()) return false;
  unlist(place->second.properties.parent, id);
  unlist(place->second.properties.child, id);
  uncouple(id);
  joints_.erase(place);
  return true;
}

void JointIndex::uncouple(JointId id) {
  const auto coupled = coupled_.extract(id);
  if (!coupled) return;
  for (const JointId other : coupled.mapped()) {
    const auto back = coupled_.find(other);
    std::erase(back->second, id);
    if (back->second.empty()) coupled_.erase(back);
    const auto joint = joints_.find(other);
    if (joint == joints_.end()) continue;
    for (JointAxis& axis : joint->second.properties.axes) {
      if (axis.mimic.leader == id) axis.mimic = {};
    }
  }
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

std::span<const JointId> JointIndex::of(BodyId body) const { return listed_in(by_body_, body); }

std::span<const JointId> JointIndex::coupled(JointId id) const { return listed_in(coupled_, id); }

}  // namespace tessera
