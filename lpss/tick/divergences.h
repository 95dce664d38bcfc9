// Divergence in a tick: bodies that were stopped, and the joints to blame.
//
// A body diverges where a command, the solver or its way takes it out of all range: it is stopped where the
// tick found it, and goes on from there. Whoever solves its island looks for the joint to blame, since only
// it knows both bodies of each.
#pragma once

#include <absl/container/btree_map.h>

#include <optional>
#include <vector>

#include "lpss/model/divergence.h"
#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

struct Stopped {
  BodyId body;
  DivergenceKind kind = DivergenceKind::kPosition;
};

// By body, of those that have diverged: the joint whose error is largest (BlamedJoint).
using BlamedJoints = absl::btree_map<BodyId, JointId>;

// What a command has made of a body that lives here: whether its velocities, or those that the forces on it
// alone would give it in this tick, are out of range. It is then stopped, and the forces are gone.
std::optional<DivergenceKind> stop_if_diverged(Partition& partition, HomeBody& body);

// As events, in their order.
std::vector<Divergence> divergences_of(Tick tick, const std::vector<Stopped>& stopped,
                                       const BlamedJoints& blamed);

}  // namespace tessera
