#include "lpss/tick/islands.h"

#include <algorithm>
#include <iterator>
#include <map>

#include "lpss/partition/bodies.h"
#include "lpss/tick/components.h"
#include "lpss/tick/ship.h"
#include "lpss/tick/sleep.h"
#include "lpss/tick/staged.h"

namespace tessera {
namespace {

// Makes jobs of islands: small ones share a job, from whatever sectors they are, and a large one has its own.
// Where clones are solved, each sector has one, and others have clones of the same ids.
class JobMaker {
 public:
  explicit JobMaker(bool clones_are_solved) : is_by_sector_(clones_are_solved) {}

  // A part of an island, until end_island(): of so many bodies and contacts, and substeps as of TaskBuilder.
  void add(Sector& sector, const Component& component) { parts_.push_back({&sector, &component}); }
  void end_island(std::uint64_t size, int substeps = 0) {
    const bool is_full = !is_by_sector_ && size_ + size > kSizeOfJob;
    if (jobs_.empty() || is_full || is_ended_) {
      jobs_.push_back(jobs_.empty() ? 0 : jobs_.back());
      size_ = 0;
      is_ended_ = false;
    }
    size_ += size;
    islands_.push_back({parts_.size(), substeps});
    jobs_.back() = islands_.size();
  }

  void end_sector() { is_ended_ = is_by_sector_; }

  std::vector<SolveJob> build(const Partition& partition, const ParallelFor& parallel) const {
    std::vector<SolveJob> built(jobs_.size());
    run_parallel(parallel, jobs_.size(), [&](std::size_t n) {
      TaskBuilder builder(partition);
      for (std::size_t island = n > 0 ? jobs_[n - 1] : 0; island < jobs_[n]; ++island) {
        builder.begin_island(islands_[island].substeps);
        for (std::size_t part = island > 0 ? islands_[island - 1].parts_end : 0;
             part < islands_[island].parts_end; ++part)
          builder.add(*parts_[part].sector, *parts_[part].component);
        builder.end_island();
      }
      built[n] = builder.build();
    });
    return built;
  }

 private:
  // Enough to fill the solver's lanes, and few enough that what it computes with stays near the processor.
  static constexpr std::uint64_t kSizeOfJob = 512;

  struct Island {
    std::size_t parts_end;
    int substeps;
  };

  bool is_by_sector_;
  std::vector<HostedPart> parts_;
  std::vector<Island> islands_;
  std::vector<std::size_t> jobs_;  // where the islands of each end
  std::uint64_t size_ = 0;         // of the last one
  bool is_ended_ = false;
};

// Whether the component is one body that nothing touches and no joint holds.
bool flies_freely(const Partition& partition, const Sector& sector, const Component& component) {
  return partition.free_flight && component.bodies_end - component.bodies_begin == 1 &&
         component.pairs_begin == component.pairs_end &&
         !sector.component_bodies[component.bodies_begin]->jointed;
}

// Whether a component is an island of its own: no border runs through it.
bool is_alone(const Component& component, std::span<const SeamPart> parts) {
  return component.part == Component::kInterior || parts[static_cast<std::size_t>(component.part)].is_alone();
}

// Lets the components that are islands of their own wake up, fall asleep or fly. The sector is awake, so
// nothing but itself changes.
void settle_alone(Partition& partition, TickContext& context, Sector& sector) {
  const std::span<const SeamPart> parts = partition.seam_graph.parts_of(sector.index);
  for (Component& component : sector.components) {
    if (!component.any_awake || !is_alone(component, parts)) continue;
    settle(partition, context, sector, component, component.all_want_sleep);
    if (!component.all_want_sleep && flies_freely(partition, sector, component))
      sector.in_free_flight.push_back(sector.component_bodies[component.bodies_begin]->slot);
  }
}

// The others are solved where they are.
void assemble_alone(const Partition& partition, Sector& sector, JobMaker& jobs) {
  const std::span<const SeamPart> parts = partition.seam_graph.parts_of(sector.index);
  for (const Component& component : sector.components) {
    if (!component.any_awake || component.all_want_sleep || !is_alone(component, parts)) continue;
    if (flies_freely(partition, sector, component)) continue;
    const std::uint32_t size =
        component.pairs_end - component.pairs_begin + component.bodies_end - component.bodies_begin;
    jobs.add(sector, component);
    jobs.end_island(size);
  }
}

// Contacts and parts of an island, by the servers that have some.
using Weights = std::map<Rank, std::uint64_t>;

// All servers choose the same one to solve an island: the one with most of its contacts, the lowest rank
// among equals. While authority is shuffled, any of those that have a part.
Rank solver_of(const Partition& partition, Tick tick, const SeamIsland& island, const Weights& weight) {
  if (partition.settings.shuffle == 0) {
    const auto is_less = [](const auto& a, const auto& b) { return a.second < b.second; };
    return std::max_element(weight.begin(), weight.end(), is_less)->first;
  }
  const std::uint64_t drawn =
      scrambled(partition.settings.shuffle ^ scrambled(tick ^ scrambled(island.id.value)));
  return std::next(weight.begin(), static_cast<std::ptrdiff_t>(drawn % weight.size()))->first;
}

// Whether the servers of an island solve it in step. While authority is shuffled, either comes to pass.
bool is_staged(const Partition& partition, Tick tick, const SeamIsland& island) {
  if (island.is_indivisible || island.substeps == 0) return false;
  if (partition.settings.shuffle == 0) return island.contacts >= partition.in_step_from;
  return (scrambled(partition.settings.shuffle ^ scrambled(tick + island.id.value)) & 1) != 0;
}

// Calls visit(sector, component) for the parts of an island that are hosted here.
template <typename Visit>
void for_each_part(Partition& partition, const SeamIsland& island, const Visit& visit) {
  for (const PartRef& ref : island.parts) {
    if (!partition.hosts(ref.sector)) continue;
    Sector& sector = with_components(partition, ref.sector);
    visit(sector, sector.components[sector.part_components[ref.part]]);
  }
}

// An island over several servers, of which one solves it.
void ship(Partition& partition, TickContext& context, const SeamIsland& island, int substeps,
          const Weights& weight, std::vector<Shipment>& outbox) {
  const Rank solver = solver_of(partition, context.tick, island, weight);
  if (solver != partition.self) {
    ShippedIsland parcel;
    parcel.island = island.id;
    std::vector<HostedPart>& parts = context.plan.shipped[island.id];
    for_each_part(partition, island, [&](Sector& sector, const Component& component) {
      ship_part(partition, sector, component, parcel);
      parts.push_back({&sector, &component});
    });
    outbox[solver].islands.push_back(std::move(parcel));
    context.plan.awaits_solution[solver] = true;
    return;
  }
  PendingIsland pending{island.id, TaskBuilder(partition)};
  pending.builder.begin_island(substeps);
  for_each_part(partition, island,
                [&](Sector& sector, const Component& component) { pending.builder.add(sector, component); });
  context.plan.pending.push_back(std::move(pending));
  ++context.counts.islands_across_seams;
  ++context.counts.islands_shipped;
  for (const auto& [rank, share] : weight) {
    if (rank != partition.self) context.plan.awaits_shipment[rank] = true;
  }
}

// An island that reaches over borders.
void assemble(Partition& partition, TickContext& context, const SeamIsland& island, JobMaker& jobs,
              std::vector<Shipment>& outbox) {
  Weights weight;
  for (const PartRef& ref : island.parts) {
    weight[partition.map.owner(ref.sector)] += partition.seam_graph.part(ref).contacts + 1;
  }
  if (!weight.contains(partition.self)) return;
  for_each_part(partition, island, [&](Sector& sector, Component& component) {
    settle(partition, context, sector, component, island.all_want_sleep);
  });
  if (island.all_want_sleep) return;

  const int substeps = island.substeps > 0 ? partition.engine.substeps(island.substeps, island.bodies) : 0;
  if (weight.size() == 1) {
    ++context.counts.islands_across_seams;
    for_each_part(partition, island,
                  [&](Sector& sector, const Component& component) { jobs.add(sector, component); });
    jobs.end_island(weight[partition.self], substeps);
  } else if (is_staged(partition, context.tick, island)) {
    if (partition.hosts(island.parts.front().sector)) {
      ++context.counts.islands_across_seams;
      ++context.counts.islands_in_step;
    }
    plan_stages(partition, context, island, substeps, outbox);
  } else {
    ship(partition, context, island, substeps, weight, outbox);
  }
}

}  // namespace

std::vector<SectorIndex> take_parts(Partition& partition, const std::vector<const Seams*>& inbox) {
  std::vector<SectorIndex> awake;
  for (const Seams* message : inbox) {
    for (const SectorSeams& seams : message->sectors) {
      partition.seam_graph.replace(seams);
      if (seams.is_news) awake.push_back(seams.sector);
    }
  }
  std::sort(awake.begin(), awake.end());
  return awake;
}

std::vector<Shipment> plan_islands(Partition& partition, TickContext& context,
                                   std::span<const SectorIndex> awake, const ParallelFor& parallel) {
  const std::size_t servers = partition.map.servers();
  std::vector<Shipment> outbox(servers);
  context.plan.awaits_shipment.assign(servers, false);
  context.plan.awaits_solution.assign(servers, false);
  JobMaker jobs(partition.rules.clones_are_solved());
  run_parallel(parallel, context.stepped.size(),
               [&](std::size_t i) { settle_alone(partition, context, *context.stepped[i]); });
  for (Sector* sector : context.stepped) {
    assemble_alone(partition, *sector, jobs);
    jobs.end_sector();
  }
  for (const SeamIsland& island : partition.seam_graph.awake_islands(awake))
    assemble(partition, context, island, jobs, outbox);
  context.plan.in_step.for_each([&](Rank rank) { context.plan.awaits_shipment[rank] = true; });
  context.plan.jobs = jobs.build(partition, parallel);
  std::sort(context.stepped.begin(), context.stepped.end(),
            [](const Sector* a, const Sector* b) { return a->index < b->index; });
  return outbox;
}

}  // namespace tessera
