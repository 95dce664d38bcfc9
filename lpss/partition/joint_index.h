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

  // False where there is no such joint.
  bool remove(JointId id);

  // nullptr where there is no such joint. Stays valid until the joint is removed.
  const JointRecord* find(JointId id) const;
  JointRecord* find(JointId id);

  // Of which the body is parent or child, in ascending order; empty for most.
  std::span<const JointId> of(BodyId body) const;

  bool empty() const { return joints_.empty(); }
  std::size_t size() const { return joints_.size(); }

  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [id, record] : joints_) visit(record);
  }

 private:
  void unlist(BodyId body, JointId id);

  absl::btree_map<JointId, JointRecord> joints_;
  absl::flat_hash_map<BodyId, std::vector<JointId>> by_body_;
};

// The other body of a joint; the world is the body 0.
inline BodyId partner_of(const JointProperties& joint, BodyId body) {
  return joint.child == body ? joint.parent : joint.child;
}

}  // namespace tessera
