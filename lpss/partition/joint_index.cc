#include "lpss/partition/joint_index.h"

#include <algorithm>

#include "lpss/base/invariant.h"

namespace tessera {
namespace {

template <typename Key>
using Lists = absl::flat_hash_map<Key, std::vector<JointId>>;

template <typename Key>
void list(Lists<Key>& lists, Key key, JointId id) {
  std::vector<JointId>& all = lists[key];
  const auto place = std::lower_bound(all.begin(), all.end(), id);
  if (place == all.end() || *place != id) all.insert(place, id);
}

template <typename Key>
void unlist_in(Lists<Key>& lists, Key key, JointId id) {
  const auto listed = lists.find(key);
  if (listed == lists.end()) return;
  std::erase(listed->second, id);
  if (listed->second.empty()) lists.erase(listed);
}

template <typename Key>
std::span<const JointId> listed_in(const Lists<Key>& lists, Key key) {
  const auto found = lists.find(key);
  if (found == lists.end()) return {};
  return found->second;
}

}  // namespace

bool JointIndex::add(const JointTie& tie) {
  if (!ties_.try_emplace(tie.id, tie).second) return false;
  for (const BodyId body : {tie.parent, tie.child}) {
    if (body.value != 0) list(by_body_, body, tie.id);
  }
  return true;
}

void JointIndex::keep(const JointRecord& record) {
  invariant(ties_.contains(record.id), "a joint with a record is known");
  records_.insert_or_assign(record.id, std::make_unique<JointRecord>(record));
  // The leader may come later.
  for (const JointAxis& axis : axes_of(record.properties)) {
    if (axis.mimic.is_set()) couple(record.id, axis.mimic.leader);
  }
}

void JointIndex::release(JointId id) {
  records_.erase(id);
  const std::span<const JointId> listed = coupled(id);
  for (const JointId other : std::vector<JointId>(listed.begin(), listed.end())) {
    if (record(other) == nullptr) uncouple(id, other);
  }
}

void JointIndex::couple(JointId a, JointId b) {
  list(coupled_, a, b);
  list(coupled_, b, a);
}

void JointIndex::uncouple(JointId a, JointId b) {
  unlist_in(coupled_, a, b);
  unlist_in(coupled_, b, a);
}

void JointIndex::set_parent_motion(JointId id, Motion motion) {
  ties_.at(id).parent_motion = motion;
  if (JointRecord* const joint = record(id)) joint->parent_motion = motion;
}

bool JointIndex::remove(JointId id) {
  const auto place = ties_.find(id);
  if (place == ties_.end()) return false;
  unlist_in(by_body_, place->second.parent, id);
  unlist_in(by_body_, place->second.child, id);
  const std::span<const JointId> listed = coupled(id);
  for (const JointId other : std::vector<JointId>(listed.begin(), listed.end())) {
    uncouple(id, other);
    JointRecord* joint = record(other);
    if (joint == nullptr) continue;
    for (JointAxis& axis : joint->properties.axes) {
      if (axis.mimic.leader == id) axis.mimic = {};
    }
  }
  records_.erase(id);
  ties_.erase(place);
  return true;
}

const JointTie* JointIndex::find(JointId id) const {
  const auto place = ties_.find(id);
  return place == ties_.end() ? nullptr : &place->second;
}

const JointRecord* JointIndex::record(JointId id) const {
  const auto place = records_.find(id);
  return place == records_.end() ? nullptr : place->second.get();
}

JointRecord* JointIndex::record(JointId id) {
  const auto place = records_.find(id);
  return place == records_.end() ? nullptr : place->second.get();
}

std::span<const JointId> JointIndex::of(BodyId body) const { return listed_in(by_body_, body); }

std::span<const JointId> JointIndex::coupled(JointId id) const { return listed_in(coupled_, id); }

}  // namespace tessera
