// Rounds two to four: islands over sectors and servers, each solved once, whole.
#include <algorithm>
#include <bit>
#include <numeric>

#include "lpss/base/disjoint_sets.h"
#include "lpss/base/invariant.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

// Components with more contacts than this are jobs of their own; the rest of a sector is one job.
constexpr std::uint32_t kLargeComponent = 256;

}  // namespace

std::vector<Shipment> Share::join(const std::vector<const Seams*>& inbox) {
  std::vector<SectorIndex> awake;
  for (const Seams* message : inbox) {
    for (const SectorSeams& seams : message->sectors) {
      seam_graph_.replace(seams);
      awake.push_back(seams.sector);
    }
  }
  std::sort(awake.begin(), awake.end());

  std::vector<Shipment> outbox(options_.map.servers());
  awaits_shipment_.assign(options_.map.servers(), false);
  awaits_solution_.assign(options_.map.servers(), false);
  jobs_.clear();
  pending_.clear();
  coupled_.clear();
  coupled_with_.assign(options_.map.servers(), false);
  for (Sector* sector : stepped_) assemble_interior(*sector);
  if (options_.settings.seams == SeamPolicy::kIsland) {
    for (const SeamIsland& island : seam_graph_.awake_islands(awake)) {
      if (beyond_cap(island)) {
        couple(island, outbox);
      } else {
        assemble(island, outbox);
      }
    }
  }
  std::sort(stepped_.begin(), stepped_.end(),
            [](const Sector* a, const Sector* b) { return a->index < b->index; });
  return outbox;
}

// Lets a component that is part of an awake island wake up, or fall asleep with it. What wakes moves in this
// tick, as it does where nobody lives beyond a border.
void Share::settle(Sector& sector, const Component& component, bool all_drowsy) {
  SectorWorld& world = *sector.world;
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    HomeBody& body = *sector.component_bodies[i];
    const Activity activity = world.activity(body.slot);
    if (all_drowsy && activity != Activity::kAsleep) {
      world.sleep(body.slot);
      body.news = true;
    } else if (!all_drowsy && activity == Activity::kAsleep) {
      world.wake(body.slot);
      if (sector.awake) continue;
      sector.awake = true;
      stepped_.push_back(&sector);
      activate(sector);
    }
  }
}

// Whether the component is one body that nothing touches and no joint holds.
bool Share::is_lone(const Sector& sector, const Component& component) const {
  return options_.lone_bodies_coast && component.bodies_end - component.bodies_begin == 1 &&
         component.pairs_begin == component.pairs_end &&
         !sector.component_bodies[component.bodies_begin]->jointed;
}

// Adds a component's bodies and contacts to a task. Its clones are bodies of the task themselves, or stand
// for their originals.
void Share::contribute(Sector& sector, const Component& component, TaskBuilder& builder,
                       bool clones_as_bodies) {
  SectorWorld& world = *sector.world;
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    builder.add_body(sector.component_bodies[i]->id, {&world, sector.component_bodies[i]->slot},
                     sector.index);
  }
  for (std::uint32_t i = component.clones_begin; i < component.clones_end; ++i) {
    const BodyId id = sector.component_clones[i];
    const WorldBody place{&world, sector.clones.at(id).slot};
    if (clones_as_bodies) {
      builder.add_copy(id, place, sector.index);
    } else {
      builder.add_clone(place, id);
    }
  }
  const std::span<const ContactPair> pairs = world.contacts();
  for (std::uint32_t i = component.pairs_begin; i < component.pairs_end; ++i) {
    const ContactPair& pair = pairs[sector.component_pairs[i]];
    builder.add_contact(pair, {&world, sector.component_pairs[i]});
    if (!sector.has_kinematics) continue;
    if (motion_of(pair.a) == Motion::kKinematic) builder.add_kinematic({&world, pair.slot_a});
    if (motion_of(pair.b) == Motion::kKinematic) builder.add_kinematic({&world, pair.slot_b});
  }
}

// The components that no border runs through: solved where they are.
void Share::assemble_interior(Sector& sector) {
  const bool clones_are_solved = options_.settings.seams == SeamPolicy::kClone;
  TaskBuilder small;
  for (const Component& component : sector.components) {
    if (component.part != Component::kInterior || !component.any_awake) continue;
    settle(sector, component, component.all_drowsy);
    if (component.all_drowsy) continue;
    if (is_lone(sector, component)) {
      sector.lone.push_back(sector.component_bodies[component.bodies_begin]->slot);
      continue;
    }
    if (component.pairs_end - component.pairs_begin > kLargeComponent) {
      TaskBuilder large;
      contribute(sector, component, large, clones_are_solved);
      jobs_.push_back(built(large));
    } else {
      contribute(sector, component, small, clones_are_solved);
    }
  }
  if (!small.empty()) jobs_.push_back(built(small));
}

// All shares choose the same one to solve an island: the one with most of its contacts, the lowest rank among
// equals. While authority is shuffled, any of those that have a part.
Rank Share::solver_of(const SeamIsland& island, const std::vector<std::uint64_t>& weight) const {
  if (options_.settings.shuffle == 0) {
    return static_cast<Rank>(std::max_element(weight.begin(), weight.end()) - weight.begin());
  }
  std::vector<Rank> candidates;
  for (Rank rank = 0; rank < weight.size(); ++rank) {
    if (weight[rank] > 0) candidates.push_back(rank);
  }
  return candidates[scrambled(options_.settings.shuffle ^ scrambled(tick_ ^ scrambled(island.name.value))) %
                    candidates.size()];
}

// An island that reaches over borders.
void Share::assemble(const SeamIsland& island, std::vector<Shipment>& outbox) {
  std::vector<std::uint64_t> weight(options_.map.servers(), 0);
  for (const PartRef& ref : island.parts) {
    weight[options_.map.owner(ref.sector)] += seam_graph_.part(ref).contacts + 1;
  }
  if (weight[options_.self] == 0) return;
  const Rank solver = solver_of(island, weight);
  const bool shipped = std::count_if(weight.begin(), weight.end(), [](std::uint64_t w) { return w > 0; }) > 1;

  PendingIsland pending;
  pending.name = island.name;
  ShippedIsland parcel;
  parcel.island = island.name;
  for (const PartRef& ref : island.parts) {
    if (!mine(ref.sector)) continue;
    Sector& sector = *sectors_.at(ref.sector);
    const Component& component = sector.components[sector.part_components[ref.part]];
    settle(sector, component, island.all_drowsy);
    if (island.all_drowsy) continue;
    if (island.parts.size() == 1 && is_lone(sector, component)) {
      sector.lone.push_back(sector.component_bodies[component.bodies_begin]->slot);
      return;
    }
    if (solver != options_.self) {
      pack(sector, component, parcel);
      continue;
    }
    contribute(sector, component, pending.builder, false);
    if (!shipped) continue;
    for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
      const HomeBody& body = *sector.component_bodies[i];
      pending.own.emplace(body.id, record_of(body));
    }
  }
  if (island.all_drowsy) return;
  if (solver != options_.self) {
    outbox[solver].islands.push_back(std::move(parcel));
    awaits_solution_[solver] = true;
    return;
  }
  if (island.parts.size() > 1) ++counts_.islands_across_seams;
  if (!shipped) {
    jobs_.push_back(built(pending.builder));
    return;
  }
  ++counts_.islands_shipped;
  for (Rank rank = 0; rank < weight.size(); ++rank) {
    if (rank != options_.self && weight[rank] > 0) awaits_shipment_[rank] = true;
  }
  pending_.push_back(std::move(pending));
}

void Share::pack(Sector& sector, const Component& component, ShippedIsland& parcel) {
  SectorWorld& world = *sector.world;
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    const HomeBody& body = *sector.component_bodies[i];
    parcel.bodies.push_back({record_of(body), world.total_wrench(body.slot)});
  }
  const std::span<const ContactPair> pairs = world.contacts();
  for (std::uint32_t i = component.pairs_begin; i < component.pairs_end; ++i) {
    const ContactPair& pair = pairs[sector.component_pairs[i]];
    parcel.contacts.push_back({sector.index, world.export_manifold(sector.component_pairs[i])});
    if (!sector.has_kinematics) continue;
    for (const BodyId id : {pair.a, pair.b}) {
      if (motion_of(id) != Motion::kKinematic) continue;
      if (const auto body = bodies_.find(id); body != bodies_.end()) {
        parcel.bodies.push_back({record_of(*body->second), {}});
      } else {
        const Ghost& ghost = *ghosts_.at(id);
        parcel.bodies.push_back({{id, ghost.home, ghost.properties, ghost.state}, {}});
      }
    }
  }
}

std::vector<Solution> Share::solve(std::vector<Shipment> inbox) {
  std::vector<std::unique_ptr<Carriers>> carriers;
  for (PendingIsland& pending : pending_) {
    std::vector<const ShippedIsland*> shipped;
    for (const Shipment& message : inbox) {
      for (const ShippedIsland& island : message.islands) {
        if (island.island == pending.name) shipped.push_back(&island);
      }
    }
    carriers.push_back(std::make_unique<Carriers>(engine_, size(), shipped, pending.own, pending.builder));
    jobs_.push_back(built(pending.builder));
  }
  run_jobs();
  std::vector<Solution> outbox(options_.map.servers());
  for (const std::unique_ptr<Carriers>& carried : carriers) carried->collect(options_.map, outbox);
  jobs_.clear();
  pending_.clear();
  return outbox;
}

// Largest first; jobs that touch the same kinematic body one after the other, as engines keep solver state in
// it.
void Share::run_jobs() {
  DisjointSets sets(jobs_.size());
  absl::flat_hash_map<std::pair<SectorWorld*, BodySlot>, std::size_t> user;
  for (std::size_t job = 0; job < jobs_.size(); ++job) {
    for (const WorldBody& body : jobs_[job].kinematics) {
      const auto [place, is_new] = user.try_emplace({body.world, body.slot}, job);
      if (!is_new) sets.unite(job, place->second);
    }
  }
  std::vector<std::vector<std::size_t>> groups(jobs_.size());
  for (std::size_t job = 0; job < jobs_.size(); ++job) groups[sets.find(job)].push_back(job);
  std::erase_if(groups, [](const auto& group) { return group.empty(); });
  const auto weight = [&](const std::vector<std::size_t>& group) {
    return std::accumulate(group.begin(), group.end(), std::size_t{0}, [&](std::size_t sum, std::size_t job) {
      return sum + jobs_[job].task.contacts.size() + jobs_[job].task.bodies.size();
    });
  };
  std::stable_sort(groups.begin(), groups.end(),
                   [&](const auto& a, const auto& b) { return weight(a) > weight(b); });
  run_parallel(groups.size(), [&](std::size_t g) {
    std::unique_ptr<IslandSolver> solver = solvers_.take();
    for (const std::size_t job : groups[g]) solver->solve(jobs_[job].task, dt());
    solvers_.put_back(std::move(solver));
  });
}

}  // namespace tessera
