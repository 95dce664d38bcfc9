// Round one's second half: every awake sector finds its contacts, and what hangs together by them.
#include <algorithm>
#include <tuple>

#include "lpss/base/disjoint_sets.h"
#include "lpss/model/gravity.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

bool moves(const SectorWorld& world, BodySlot slot) { return world.activity(slot) != Activity::kAsleep; }

// The nodes of one sector's contact graph: its homes, ascending by id, then its placed clones.
class Nodes {
 public:
  struct Node {
    BodyId id;
    BodySlot slot;
    HomeBody* home;  // nullptr for clones
    bool dynamic;
    bool awake;
    bool drowsy_or_asleep;
  };

  explicit Nodes(const Sector& sector) {
    const SectorWorld& world = *sector.world;
    nodes_.reserve(sector.homes.size() + sector.clones.size());
    for (HomeBody* body : sector.homes) {
      add(body->id, body->slot, body, body->properties.motion, world.activity(body->slot));
    }
    homes_ = nodes_.size();
    for (const auto& [id, clone] : sector.clones) {
      if (clone.slot == Clone::kNotPlaced) continue;
      add(id, clone.slot, nullptr, clone.ghost->properties.motion, clone.ghost->state.activity);
    }
  }

  // nullptr for static bodies.
  const Node* in_slot(BodySlot slot) const {
    const auto place = static_cast<std::size_t>(slot);
    if (place >= by_slot_.size() || by_slot_[place] < 0) return nullptr;
    return &nodes_[by_slot_[place]];
  }
  // nullptr for bodies that are neither at home here nor placed as clones.
  const Node* named(BodyId id) const {
    const auto search = [&](std::size_t first, std::size_t last) -> const Node* {
      const auto end = nodes_.begin() + static_cast<std::ptrdiff_t>(last);
      const auto node = std::lower_bound(nodes_.begin() + static_cast<std::ptrdiff_t>(first), end, id,
                                         [](const Node& n, BodyId wanted) { return n.id < wanted; });
      return node != end && node->id == id ? &*node : nullptr;
    };
    const Node* home = search(0, homes_);
    return home != nullptr ? home : search(homes_, nodes_.size());
  }
  std::size_t index(const Node* node) const { return node - nodes_.data(); }
  std::size_t size() const { return nodes_.size(); }
  std::size_t homes() const { return homes_; }
  bool has_kinematics() const { return has_kinematics_; }
  const Node& operator[](std::size_t i) const { return nodes_[i]; }

 private:
  void add(BodyId id, BodySlot slot, HomeBody* home, Motion motion, Activity activity) {
    if (static_cast<std::size_t>(slot) >= by_slot_.size()) by_slot_.resize(slot + 1, -1);
    by_slot_[slot] = static_cast<std::int32_t>(nodes_.size());
    has_kinematics_ |= motion == Motion::kKinematic;
    nodes_.push_back({id, slot, home, motion == Motion::kDynamic, activity != Activity::kAsleep,
                      activity != Activity::kAwake});
  }

  std::vector<Node> nodes_;
  std::vector<std::int32_t> by_slot_;
  std::size_t homes_ = 0;
  bool has_kinematics_ = false;
};

// Sorts items into groups: `begin[g]` to `begin[g + 1]` are the places of group g.
std::vector<std::uint32_t> group_begins(const std::vector<std::uint32_t>& group_of, std::size_t groups) {
  std::vector<std::uint32_t> begin(groups + 1, 0);
  for (const std::uint32_t group : group_of) ++begin[group + 1];
  for (std::size_t g = 0; g < groups; ++g) begin[g + 1] += begin[g];
  return begin;
}

}  // namespace

Seams Share::detect(std::vector<Exchange> inbox) {
  phase_clock_.enter(TickPhase::kExchange);
  take_ghosts(inbox);
  phase_clock_.enter(TickPhase::kSectorization);
  take_handovers(inbox);
  for (Sector* sector : std::vector<Sector*>(active_)) drop_if_empty(*sector);
  std::sort(active_.begin(), active_.end(),
            [](const Sector* a, const Sector* b) { return a->index < b->index; });
  phase_clock_.enter(TickPhase::kCloning);
  run_parallel(active_.size(), [&](std::size_t i) {
    if (!active_[i]->world) return;
    reach_statics(*active_[i]);
    refresh_clones(*active_[i]);
  });
  phase_clock_.enter(TickPhase::kSectorization);
  take_manifolds(inbox);

  phase_clock_.enter(TickPhase::kDetection);
  stepped_.clear();
  std::vector<Sector*> looked_at;
  for (Sector* sector : active_) {
    if (!sector->world) continue;
    clones_ += sector->placed - sector->counted;
    sector->counted = sector->placed;
    sector->awake = anything_awake(*sector);
    if (sector->awake) stepped_.push_back(sector);
    if (sector->awake || sector->regroup) looked_at.push_back(sector);
  }
  run_parallel(stepped_.size(), [&](std::size_t i) {
    pull(*stepped_[i]);
    stepped_[i]->world->detect(dt());
  });

  phase_clock_.enter(TickPhase::kIslands);
  run_parallel(looked_at.size(), [&](std::size_t i) { find_components(*looked_at[i]); });
  Seams seams;
  for (const SectorIndex& index : vacated_) seams.sectors.push_back({index, {}});
  vacated_.clear();
  for (Sector* sector : looked_at) {
    if (sector->parts.empty() && !sector->parts_known) continue;
    sector->parts_known = !sector->parts.empty();
    seams.sectors.push_back({sector->index, sector->parts});
  }
  return seams;
}

bool Share::anything_awake(const Sector& sector) const {
  const bool home = std::any_of(sector.homes.begin(), sector.homes.end(),
                                [&](const HomeBody* body) { return moves(*sector.world, body->slot); });
  return home || std::any_of(sector.clones.begin(), sector.clones.end(), [](const auto& entry) {
           const Clone& clone = entry.second;
           return clone.slot != Clone::kNotPlaced && clone.ghost->state.activity != Activity::kAsleep;
         });
}

// Statics beyond the usual surroundings of a sector, for bodies that go far in one tick.
void Share::reach_statics(Sector& sector) {
  for (const HomeBody* body : sector.homes) {
    if (moves(*sector.world, body->slot)) add_statics(sector, body->swept);
  }
}

// A planet pulls every body in a direction of its own; a uniform pull was set when the body came.
void Share::pull(Sector& sector) {
  if (!std::holds_alternative<CentralGravity>(options_.settings.gravity)) return;
  for (const HomeBody* body : sector.homes) {
    if (!body->properties.gravity || !moves(*sector.world, body->slot)) continue;
    sector.world->set_gravity(body->slot, acceleration_at(options_.settings.gravity, sector.index,
                                                          sector.world->position(body->slot), size()));
  }
}

void Share::find_components(Sector& sector) {
  sector.regroup = false;
  sector.components.clear();
  sector.component_bodies.clear();
  sector.component_clones.clear();
  sector.component_pairs.clear();
  sector.parts.clear();
  sector.part_components.clear();
  const bool clones_are_solved = options_.settings.seams == SeamPolicy::kClone;
  const std::span<const ContactPair> pairs = sector.world->contacts();
  const bool any_jointed = std::any_of(sector.homes.begin(), sector.homes.end(),
                                       [](const HomeBody* body) { return body->jointed; });
  if (pairs.empty() && !any_jointed) {
    list_lone_bodies(sector);
    if (!clones_are_solved) list_parts(sector);
    return;
  }
  const Nodes nodes(sector);

  sector.has_kinematics = nodes.has_kinematics();

  DisjointSets sets(nodes.size());
  std::vector<bool> pushed(nodes.size(), false);
  constexpr std::size_t kNone = ~std::size_t{0};
  std::vector<std::size_t> pair_node(pairs.size(), kNone);  // a dynamic body of the pair
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Nodes::Node* a = nodes.in_slot(pairs[i].slot_a);
    const Nodes::Node* b = nodes.in_slot(pairs[i].slot_b);
    const bool a_dynamic = a != nullptr && a->dynamic;
    const bool b_dynamic = b != nullptr && b->dynamic;
    if (a_dynamic && b_dynamic) {
      sets.unite(nodes.index(a), nodes.index(b));
    } else if (a_dynamic && b != nullptr && b->awake) {
      pushed[nodes.index(a)] = true;
    } else if (b_dynamic && a != nullptr && a->awake) {
      pushed[nodes.index(b)] = true;
    }
    if (a_dynamic || b_dynamic) pair_node[i] = nodes.index(a_dynamic ? a : b);
  }

  for (std::size_t n = 0; n < nodes.homes(); ++n) {
    if (!nodes[n].home->jointed || !nodes[n].dynamic) continue;
    for (const JointId id : joints_.of(nodes[n].id)) {
      const JointRecord& joint = *joints_.find(id);
      const Nodes::Node* partner = nodes.named(partner_of(joint.properties, nodes[n].id));
      if (partner != nullptr && partner->dynamic && (partner->home != nullptr || clones_are_solved)) {
        sets.unite(n, nodes.index(partner));
      } else if (is_pushed_by(joint)) {
        pushed[n] = true;
      }
    }
  }

  // Components are numbered in the order of their smallest bodies; only those with a body that lives here
  // count.
  constexpr std::uint32_t kUnused = ~std::uint32_t{0};
  std::vector<std::uint32_t> component(nodes.size(), kUnused);
  for (std::size_t n = 0; n < nodes.homes(); ++n) {
    if (!nodes[n].dynamic) continue;
    const std::size_t root = sets.find(n);
    if (component[root] == kUnused) {
      component[root] = static_cast<std::uint32_t>(sector.components.size());
      sector.components.emplace_back();
    }
    component[n] = component[root];
  }
  for (std::size_t n = nodes.homes(); n < nodes.size(); ++n) component[n] = component[sets.find(n)];

  const std::size_t count = sector.components.size();
  const auto distribute = [&](auto& out, auto member_begin, auto member_end, auto&& items) {
    std::vector<std::uint32_t> group_of;
    group_of.reserve(items.size());
    for (const auto& [group, value] : items) group_of.push_back(group);
    std::vector<std::uint32_t> begin = group_begins(group_of, count);
    for (std::size_t c = 0; c < count; ++c) {
      sector.components[c].*member_begin = begin[c];
      sector.components[c].*member_end = begin[c + 1];
    }
    out.resize(items.size());
    for (const auto& [group, value] : items) out[begin[group]++] = value;
  };
  std::vector<std::pair<std::uint32_t, HomeBody*>> bodies;
  std::vector<std::pair<std::uint32_t, BodyId>> clones;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> contacts;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const Nodes::Node& node = nodes[n];
    if (!node.dynamic || component[n] == kUnused) continue;
    Component& c = sector.components[component[n]];
    if (node.home != nullptr) {
      bodies.emplace_back(component[n], node.home);
    } else {
      clones.emplace_back(component[n], node.id);
    }
    c.any_awake |= pushed[n];
    c.all_drowsy &= !pushed[n];
    if (node.home == nullptr && !clones_are_solved) continue;
    c.any_awake |= node.awake;
    c.all_drowsy &= node.drowsy_or_asleep;
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (pair_node[i] == kNone || component[pair_node[i]] == kUnused) continue;
    contacts.emplace_back(component[pair_node[i]], static_cast<std::uint32_t>(i));
  }
  distribute(sector.component_bodies, &Component::bodies_begin, &Component::bodies_end, bodies);
  distribute(sector.component_clones, &Component::clones_begin, &Component::clones_end, clones);
  distribute(sector.component_pairs, &Component::pairs_begin, &Component::pairs_end, contacts);
  if (!clones_are_solved) list_parts(sector);
}

// The components of a sector in which nothing touches anything.
void Share::list_lone_bodies(Sector& sector) {
  sector.has_kinematics = false;
  for (HomeBody* body : sector.homes) {
    if (body->properties.motion != Motion::kDynamic) continue;
    const Activity activity = sector.world->activity(body->slot);
    Component component;
    component.bodies_begin = static_cast<std::uint32_t>(sector.component_bodies.size());
    component.bodies_end = component.bodies_begin + 1;
    component.any_awake = activity != Activity::kAsleep;
    component.all_drowsy = activity != Activity::kAwake;
    sector.components.push_back(component);
    sector.component_bodies.push_back(body);
  }
}

// What others must know of the components that reach over a border, or may be touched from beyond it.
void Share::list_parts(Sector& sector) {
  for (Component& component : sector.components) {
    IslandPart part;
    part.links.assign(sector.component_clones.begin() + component.clones_begin,
                      sector.component_clones.begin() + component.clones_end);
    for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
      const HomeBody& body = *sector.component_bodies[i];
      if (!body.targets.empty()) part.links.push_back(body.id);
    }
    link_joints(sector, component, part.links);
    if (part.links.empty()) continue;
    part.first = sector.component_bodies[component.bodies_begin]->id;
    part.bodies = component.bodies_end - component.bodies_begin;
    part.contacts = component.pairs_end - component.pairs_begin;
    part.any_awake = component.any_awake;
    part.all_drowsy = component.all_drowsy;
    component.part = static_cast<std::int32_t>(sector.parts.size());
    sector.part_components.push_back(static_cast<std::uint32_t>(&component - sector.components.data()));
    sector.parts.push_back(std::move(part));
  }
}

}  // namespace tessera
