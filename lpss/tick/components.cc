#include "lpss/tick/components.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "lpss/base/disjoint_sets.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/packing.h"
#include "lpss/tick/contact_graph.h"

namespace tessera {
namespace {

constexpr std::uint32_t kNoComponent = ~std::uint32_t{0};
constexpr std::size_t kNoNode = ~std::size_t{0};

// What connects the nodes of a graph.
struct Connections {
  DisjointSets sets;
  std::vector<bool> pushed;            // by node: something kinematic on its way keeps it awake
  std::vector<std::size_t> pair_node;  // by contact pair: a dynamic body of it
};

void connect_by_contacts(const ContactGraph& graph, std::span<const ContactPair> pairs,
                         Connections& connections) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ContactGraph::Node* a = graph.in_slot(pairs[i].slot_a);
    const ContactGraph::Node* b = graph.in_slot(pairs[i].slot_b);
    const bool a_dynamic = a != nullptr && a->dynamic;
    const bool b_dynamic = b != nullptr && b->dynamic;
    if (a_dynamic && b_dynamic) {
      connections.sets.unite(graph.index(a), graph.index(b));
    } else if (a_dynamic && b != nullptr && b->awake) {
      connections.pushed[graph.index(a)] = true;
    } else if (b_dynamic && a != nullptr && a->awake) {
      connections.pushed[graph.index(b)] = true;
    }
    if (a_dynamic || b_dynamic) connections.pair_node[i] = graph.index(a_dynamic ? a : b);
  }
}

void connect_by_joints(const Partition& partition, const ContactGraph& graph, bool clones_are_solved,
                       Connections& connections) {
  for (std::size_t n = 0; n < graph.homes(); ++n) {
    if (!graph[n].jointed || !graph[n].dynamic) continue;
    for (const JointId id : partition.joints.of(graph[n].id)) {
      const JointTie& joint = *partition.joints.find(id);
      if (is_pushed_by(partition, joint)) connections.pushed[n] = true;
      for_each_tied(partition.joints, joint, graph[n].id, [&](BodyId body) {
        const ContactGraph::Node* partner = graph.named(body);
        if (partner != nullptr && partner->dynamic && (partner->home != nullptr || clones_are_solved))
          connections.sets.unite(n, graph.index(partner));
      });
    }
  }
}

// The component of each node. They are numbered in the order of their smallest bodies; only those with a body
// that lives here count.
std::vector<std::uint32_t> number_components(Sector& sector, const ContactGraph& graph, DisjointSets& sets) {
  std::vector<std::uint32_t> component(graph.size(), kNoComponent);
  for (std::size_t n = 0; n < graph.homes(); ++n) {
    if (!graph[n].dynamic) continue;
    const std::size_t root = sets.find(n);
    if (component[root] == kNoComponent) {
      component[root] = static_cast<std::uint32_t>(sector.components.size());
      sector.components.emplace_back();
    }
    component[n] = component[root];
  }
  for (std::size_t n = graph.homes(); n < graph.size(); ++n) component[n] = component[sets.find(n)];
  return component;
}

// Items of components, in any order of these.
template <typename T>
using Members = std::vector<std::pair<std::uint32_t, T>>;

// Sorts members by component into one list, of which each component has a range.
template <typename T>
void distribute(const Members<T>& members, std::vector<Component>& components,
                std::uint32_t Component::*begin, std::uint32_t Component::*end, std::vector<T>& out) {
  std::vector<std::uint32_t> next(components.size() + 1, 0);
  for (const auto& [component, member] : members) ++next[component + 1];
  for (std::size_t c = 0; c < components.size(); ++c) {
    next[c + 1] += next[c];
    components[c].*begin = next[c];
    components[c].*end = next[c + 1];
  }
  out.resize(members.size());
  for (const auto& [component, member] : members) out[next[component]++] = member;
}

// Fills the components of a sector with their bodies, clones and contacts.
void fill_components(Sector& sector, const ContactGraph& graph, const Connections& connections,
                     const std::vector<std::uint32_t>& component, bool clones_are_solved) {
  Members<HomeBody*> bodies;
  Members<Clone*> clones;
  Members<std::uint32_t> contacts;
  bodies.reserve(graph.homes());
  clones.reserve(graph.size() - graph.homes());
  contacts.reserve(connections.pair_node.size());
  for (std::size_t n = 0; n < graph.size(); ++n) {
    const ContactGraph::Node& node = graph[n];
    if (!node.dynamic || component[n] == kNoComponent) continue;
    Component& c = sector.components[component[n]];
    if (node.home != nullptr) {
      bodies.emplace_back(component[n], node.home);
    } else {
      clones.emplace_back(component[n], node.clone);
    }
    c.any_asleep |= node.home != nullptr && !node.awake;
    c.any_awake |= connections.pushed[n];
    c.all_want_sleep &= !connections.pushed[n];
    if (node.home == nullptr && !clones_are_solved) continue;
    c.any_awake |= node.awake;
    c.all_want_sleep &= node.wants_sleep;
  }
  for (std::size_t i = 0; i < connections.pair_node.size(); ++i) {
    const std::size_t node = connections.pair_node[i];
    if (node == kNoNode || component[node] == kNoComponent) continue;
    contacts.emplace_back(component[node], static_cast<std::uint32_t>(i));
  }
  distribute(bodies, sector.components, &Component::bodies_begin, &Component::bodies_end,
             sector.component_bodies);
  distribute(clones, sector.components, &Component::clones_begin, &Component::clones_end,
             sector.component_clones);
  distribute(contacts, sector.components, &Component::pairs_begin, &Component::pairs_end,
             sector.component_pairs);
}

// The components of a sector in which nothing touches anything.
void list_single_bodies(Sector& sector) {
  for (HomeBody* body : sector.homes) {
    if (body->properties.motion != Motion::kDynamic) continue;
    const Activity activity = sector.world->activity(body->slot);
    Component component;
    component.bodies_begin = static_cast<std::uint32_t>(sector.component_bodies.size());
    component.bodies_end = component.bodies_begin + 1;
    component.any_awake = activity != Activity::kAsleep;
    component.any_asleep = !component.any_awake;
    component.all_want_sleep = activity != Activity::kAwake;
    sector.components.push_back(component);
    sector.component_bodies.push_back(body);
  }
}

// The component of a sector with one body, and nothing else that can move: it has all contacts.
void list_lone_body(Sector& sector, std::size_t pairs) {
  list_single_bodies(sector);
  if (sector.components.empty()) return;
  sector.component_pairs.resize(pairs);
  std::iota(sector.component_pairs.begin(), sector.component_pairs.end(), 0u);
  sector.components.front().pairs_end = static_cast<std::uint32_t>(pairs);
}

// Both sides of a joint that runs over a border name both of its bodies.
void add_jointed(const Partition& partition, const Sector& sector, const Component& component,
                 std::vector<BodyId>& shared) {
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    const HomeBody& body = *sector.component_bodies[i];
    if (!body.jointed) continue;
    for (const JointId id : partition.joints.of(body.id)) {
      const JointTie& joint = *partition.joints.find(id);
      for_each_tied(partition.joints, joint, body.id, [&](BodyId tied) {
        const bool is_fixed = tied == joint.parent && joint.parent_motion != Motion::kDynamic;
        if (tied.value == 0 || is_fixed || lives_in(partition, tied, sector)) return;
        shared.push_back(body.id);
        shared.push_back(tied);
      });
    }
  }
  std::sort(shared.begin(), shared.end());
  shared.erase(std::unique(shared.begin(), shared.end()), shared.end());
}

// Whether only a single solver can solve what it belongs to; see IslandPart.
bool is_indivisible(const Sector& sector, const Component& component) {
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    if (sector.component_bodies[i]->jointed) return true;
  }
  for (std::uint32_t i = component.clones_begin; i < component.clones_end; ++i) {
    const SectorIndex& home = sector.component_clones[i]->replica->home;
    if (chebyshev_distance(home, sector.index) > 1) return true;
  }
  return false;
}

// What others must know of the components that reach over a border, or may be touched from beyond it.
void list_parts(const Partition& partition, Sector& sector) {
  const std::span<const ContactPair> pairs = sector.world->contacts();
  for (Component& component : sector.components) {
    IslandPart part;
    for (std::uint32_t i = component.clones_begin; i < component.clones_end; ++i) {
      part.shared.push_back(sector.component_clones[i]->replica->id);
    }
    for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
      const HomeBody& body = *sector.component_bodies[i];
      if (!body.replicated_in.empty()) part.shared.push_back(body.id);
    }
    add_jointed(partition, sector, component, part.shared);
    if (part.shared.empty()) continue;
    part.first = sector.component_bodies[component.bodies_begin]->id;
    part.bodies = component.bodies_end - component.bodies_begin;
    part.contacts = component.pairs_end - component.pairs_begin;
    part.any_awake = component.any_awake;
    part.all_want_sleep = component.all_want_sleep;
    for (std::uint32_t i = component.pairs_begin; i < component.pairs_end; ++i) {
      const ContactPair& pair = pairs[sector.component_pairs[i]];
      part.substeps = std::max<std::uint32_t>(part.substeps, pair.substeps);
      part.bounces |= pair.bounces;
    }
    part.is_indivisible = is_indivisible(sector, component);
    component.part = static_cast<std::int32_t>(sector.parts.size());
    sector.part_components.push_back(static_cast<std::uint32_t>(&component - sector.components.data()));
    sector.parts.push_back(std::move(part));
  }
}

void find_components_of(const Partition& partition, Sector& sector, const ParallelFor& parallel) {
  clear_components(sector);
  const bool clones_are_solved = partition.rules.clones_are_solved();
  const std::span<const ContactPair> pairs = sector.world->contacts();
  const auto any_jointed = [&sector] {
    return std::ranges::any_of(sector.homes, [](const HomeBody* body) { return body->jointed; });
  };
  if (pairs.empty() && !any_jointed()) {
    list_single_bodies(sector);
  } else if (sector.homes.size() == 1 && sector.placed.empty() && !any_jointed()) {
    list_lone_body(sector, pairs.size());
  } else {
    const ContactGraph graph(sector, parallel);
    Connections connections{DisjointSets(graph.size()), std::vector<bool>(graph.size(), false),
                            std::vector<std::size_t>(pairs.size(), kNoNode)};
    connect_by_contacts(graph, pairs, connections);
    connect_by_joints(partition, graph, clones_are_solved, connections);
    const std::vector<std::uint32_t> component = number_components(sector, graph, connections.sets);
    fill_components(sector, graph, connections, component, clones_are_solved);
  }
  if (!clones_are_solved) list_parts(partition, sector);
}

bool are_known(std::span<const IslandPart> parts, std::span<const SeamPart> known) {
  return std::equal(
      parts.begin(), parts.end(), known.begin(), known.end(),
      [](const IslandPart& part, const SeamPart& said) { return part.shared == said.said.shared; });
}

}  // namespace

bool resume_components(Partition& partition) {
  bool all_known = true;
  for (const auto& [index, sector] : partition.sectors) {
    if (!sector->world || sector->active) continue;
    find_components_of(partition, *sector, {});
    all_known &= are_known(sector->parts, partition.seam_graph.parts_of(index));
    sector->parts.clear();
  }
  return all_known;
}

Sector& with_components(Partition& partition, const SectorIndex& index) {
  bring_back(partition, index);
  Sector& sector = *partition.sectors.at(index);
  if (sector.components_stale) {
    find_components_of(partition, sector, {});
    sector.parts.clear();
  }
  return sector;
}

Seams find_components(Partition& partition, const ParallelFor& parallel, const Vacated& vacated) {
  std::vector<Sector*> changed;
  for (Sector* sector : partition.active) {
    if (sector->world && (sector->awake || sector->components_stale)) changed.push_back(sector);
  }
  run_parallel(parallel, changed.size(),
               [&](std::size_t i) { find_components_of(partition, *changed[i], parallel); });
  Seams seams;
  for (const SectorIndex& index : vacated.sectors) seams.sectors.push_back({index, {}});
  for (Sector* sector : changed) {
    if (sector->parts.empty() && !sector->parts_reported) continue;
    sector->parts_reported = !sector->parts.empty();
    seams.sectors.push_back({sector->index, std::move(sector->parts)});
  }
  return seams;
}

}  // namespace tessera
