#include "lpss/tick/contact_graph.h"

#include <algorithm>

namespace tessera {

ContactGraph::ContactGraph(const Sector& sector) {
  const SectorWorld& world = *sector.world;
  nodes_.reserve(sector.homes.size() + sector.placed.size());
  for (HomeBody* body : sector.homes) {
    add({body->id, body->slot, body, nullptr}, body->properties.motion, world.activity(body->slot));
  }
  homes_ = nodes_.size();
  for (Clone* clone : sector.placed) {
    const Replica& replica = *clone->replica;
    add({replica.id, clone->slot, nullptr, clone}, replica.properties.motion, replica.state.activity);
  }
}

void ContactGraph::add(Node node, Motion motion, Activity activity) {
  const auto slot = static_cast<std::size_t>(node.slot);
  if (slot >= by_slot_.size()) by_slot_.resize(slot + 1, -1);
  by_slot_[slot] = static_cast<std::int32_t>(nodes_.size());
  has_kinematics_ |= motion == Motion::kKinematic;
  node.dynamic = motion == Motion::kDynamic;
  node.awake = activity != Activity::kAsleep;
  node.wants_sleep = activity != Activity::kAwake;
  nodes_.push_back(node);
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
