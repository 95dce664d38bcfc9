// The joints that a server knows, found by name and by body.
//
// The record of a joint lives where its child does. Of others, a server has the ties: of joints whose parents
// live there, and of those that are coupled with a record.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>

#include <memory>
#include <span>
#include <vector>

#include "lpss/model/joint.h"

namespace tessera {

class JointIndex {
 public:
  // False where the joint is known already.
  bool add(const JointTie& tie);

  // Of a joint that is known, whose child lives here. Couples it with those that its axes follow.
  void keep(const JointRecord& record);

  // Of a joint whose child lives here no more: forgets its record, and couplings of it with ties.
  void release(JointId id);

  // One of them follows the other, wherever they are.
  void couple(JointId a, JointId b);

  // Of a joint that is known.
  void set_parent_motion(JointId id, Motion motion);

  // False where the joint is not known. Axes that followed it follow nothing from then on.
  bool remove(JointId id);

  // nullptr where the joint is not known. Stays valid until another one is added or removed.
  const JointTie* find(JointId id) const;

  // nullptr where the child of the joint does not live here. Stays valid as long as it does.
  const JointRecord* record(JointId id) const;
  JointRecord* record(JointId id);

  // Of which the body is parent or child, in ascending order; empty for most.
  std::span<const JointId> of(BodyId body) const;

  // Whose axes follow an axis of the joint, or that its own axes follow, in ascending order; empty for most.
  // All of them of a joint with a record. Some may not be there.
  std::span<const JointId> coupled(JointId id) const;

  bool empty() const { return ties_.empty(); }
  std::size_t size() const { return ties_.size(); }
  std::size_t records() const { return records_.size(); }

  // In ascending order.
  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [id, tie] : ties_) visit(tie);
  }

 private:
  void uncouple(JointId a, JointId b);

  absl::btree_map<JointId, JointTie> ties_;
  absl::flat_hash_map<JointId, std::unique_ptr<JointRecord>> records_;  // of some of these
  absl::flat_hash_map<BodyId, std::vector<JointId>> by_body_;
  absl::flat_hash_map<JointId, std::vector<JointId>> coupled_;
};

// The other body of a joint; the world is the body 0.
inline BodyId partner_of(const JointTie& joint, BodyId body) {
  return joint.child == body ? joint.parent : joint.child;
}

// Calls visit(JointRecord) with the joints whose child the body is, in ascending order, as far as it lives
// here.
template <typename Visit>
void for_each_of_child(const JointIndex& joints, BodyId body, Visit&& visit) {
  for (const JointId id : joints.of(body)) {
    const JointRecord* const joint = joints.record(id);
    if (joint != nullptr && joint->properties.child == body) visit(*joint);
  }
}

// Calls visit(BodyId) with the other bodies that the joint ties to one of its own: the other side of the
// joint, and what its axes follow, and what follows them, to its child. 0 is the world.
template <typename Visit>
void for_each_tied(const JointIndex& joints, const JointTie& joint, BodyId body, Visit&& visit) {
  visit(partner_of(joint, body));
  if (joint.child != body) return;
  for (const JointId id : joints.coupled(joint.id)) {
    const JointTie* other = joints.find(id);
    if (other != nullptr && other->child != body) visit(other->child);
  }
}

}  // namespace tessera
