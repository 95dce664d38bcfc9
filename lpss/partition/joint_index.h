// All joints of a world, found by name and by body. Every server knows all of them, as it knows all statics.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>

#include <span>
#include <vector>

#include "lpss/model/joint.h"

namespace tessera {

class JointIndex {
 public:
  // A name is given once.
  void add(const JointRecord& record);

  // False where there is no such joint. Axes that followed it follow nothing from then on.
  bool remove(JointId id);

  // nullptr where there is no such joint. Stays valid until the joint is removed.
  const JointRecord* find(JointId id) const;
  JointRecord* find(JointId id);

  // Of which the body is parent or child, in ascending order; empty for most.
  std::span<const JointId> of(BodyId body) const;

  // Whose axes follow an axis of the joint, or that its own axes follow, in ascending order; empty for most.
  // Some may not be there.
  std::span<const JointId> coupled(JointId id) const;

  bool empty() const { return joints_.empty(); }
  std::size_t size() const { return joints_.size(); }

  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [id, record] : joints_) visit(record);
  }

 private:
  void unlist(BodyId body, JointId id);
  void uncouple(JointId id);

  absl::btree_map<JointId, JointRecord> joints_;
  absl::flat_hash_map<BodyId, std::vector<JointId>> by_body_;
  absl::flat_hash_map<JointId, std::vector<JointId>> coupled_;
};

// The other body of a joint; the world is the body 0.
inline BodyId partner_of(const JointProperties& joint, BodyId body) {
  return joint.child == body ? joint.parent : joint.child;
}

// Calls visit(BodyId) with the other bodies that the joint ties to one of its own: the other side of the
// joint, and what its axes follow, and what follows them, to its child. 0 is the world.
template <typename Visit>
void for_each_tied(const JointIndex& joints, const JointRecord& joint, BodyId body, Visit&& visit) {
  visit(partner_of(joint.properties, body));
  if (joint.properties.child != body) return;
  for (const JointId id : joints.coupled(joint.id)) {
    const JointRecord* other = joints.find(id);
    if (other != nullptr && other->properties.child != body) visit(other->properties.child);
  }
}

}  // namespace tessera
