#include "lpss/tick/contact_graph.h"

#include <algorithm>

namespace tessera {
namespace {

void set(ContactGraph::Node& node, Motion motion, Activity activity) {
  node.dynamic = motion == Motion::kDynamic;
  node.awake = activity != Activity::kAsleep;
  node.wants_sleep = activity != Activity::kAwake;
}

}  // namespace

ContactGraph::ContactGraph(const Sector& sector, const ParallelFor& parallel)
    : nodes_(sector.homes.size() + sector.placed.size()), homes_(sector.homes.size()) {
  run_in_pieces(parallel, homes_, kBodiesInPiece, [&](std::size_t n) {
    HomeBody* body = sector.homes[n];
    nodes_[n] = {.id = body->id, .slot = body->slot, .home = body, .jointed = body->jointed};
    set(nodes_[n], body->properties.motion, sector.world->activity(body->slot));
  });
  for (std::size_t n = 0; n < sector.placed.size(); ++n) {
    Clone* clone = sector.placed[n];
    const Replica& replica = *clone->replica;
    Node& node = nodes_[homes_ + n] = {.id = replica.id, .slot = clone->slot, .clone = clone};
    set(node, replica.properties.motion, replica.state.activity);
  }
  list_slots();
}

void ContactGraph::list_slots() {
  BodySlot last = -1;
  for (const Node& node : nodes_) last = std::max(last, node.slot);
  by_slot_.assign(static_cast<std::size_t>(last + 1), -1);
  for (std::size_t n = 0; n < nodes_.size(); ++n)
    by_slot_[static_cast<std::size_t>(nodes_[n].slot)] = static_cast<std::int32_t>(n);
}

const ContactGraph::Node* ContactGraph::in_slot(BodySlot slot) const {
  const auto place = static_cast<std::size_t>(slot);
  if (place >= by_slot_.size() || by_slot_[place] < 0) return nullptr;
  return &nodes_[by_slot_[place]];
}

const ContactGraph::Node* ContactGraph::named(BodyId id) const {
  const auto search = [&](std::size_t first, std::size_t last) -> const Node* {
    const auto end = nodes_.begin() + static_cast<std::ptrdiff_t>(last);
    const auto node = std::lower_bound(nodes_.begin() + static_cast<std::ptrdiff_t>(first), end, id,
                                       [](const Node& n, BodyId wanted) { return n.id < wanted; });
    return node != end && node->id == id ? &*node : nullptr;
  };
  const Node* home = search(0, homes_);
  return home != nullptr ? home : search(homes_, nodes_.size());
}

}  // namespace tessera
