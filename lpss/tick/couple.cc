#include "lpss/tick/couple.h"

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <bit>
#include <tuple>

#include "lpss/partition/bodies.h"
#include "lpss/tick/sleep.h"

namespace tessera {
namespace {

bool comes_first(const SharedChange& a, const SharedChange& b) {
  return std::tie(a.body, a.part) < std::tie(b.body, b.part);
}

// How much lighter the copies of a body are. With 1, what the parts do to it adds up too far, and towers
// whose boxes are parts of their own fall; with one for each copy nothing overshoots, but they creep, and
// chains are long.
double lighter(int copies) { return std::max(1.0, 0.7 * copies); }

// The dynamic parents of a component's bodies that live in other sectors.
std::vector<BodyId> far_parents(const Partition& partition, const Sector& sector,
                                const Component& component) {
  std::vector<BodyId> parents;
  for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
    const HomeBody& body = *sector.component_bodies[i];
    if (!body.jointed) continue;
    for (const JointId id : partition.joints.of(body.id)) {
      const JointRecord& joint = *partition.joints.find(id);
      const BodyId parent = joint.properties.parent;
      if (parent == body.id || joint.parent_motion != Motion::kDynamic || lives_in(partition, parent, sector))
        continue;
      parents.push_back(parent);
    }
  }
  return parents;
}

// Gives every copy of a body what all parts did to it (engine.h, PartSolver).
void agree(std::vector<CoupledPart>& coupled, const std::vector<Coupling>& inbox, std::uint32_t pass,
           const ParallelFor& parallel) {
  std::vector<SharedChange> changes;
  for (const Coupling& message : inbox) {
    changes.insert(changes.end(), message.changes.begin(), message.changes.end());
  }
  std::sort(changes.begin(), changes.end(), comes_first);
  run_parallel(parallel, coupled.size(), [&](std::size_t p) {
    CoupledPart& part = coupled[p];
    for (std::size_t n = 0; n < part.shared.size(); ++n) {
      VelocityChange sum;
      int copies = 0;
      const SharedChange first{part.shared[n].id, BodyId{}, {}};
      for (auto change = std::lower_bound(changes.begin(), changes.end(), first, comes_first);
           change != changes.end() && change->body == part.shared[n].id; ++change) {
        sum += change->change;
        ++copies;
      }
      part.solver->agree(n, pass == 0 ? sum : scaled(sum, 1 / lighter(copies)));
      if (pass == 0) part.solver->split(n, lighter(copies));
    }
  });
}

}  // namespace

bool beyond_cap(const Partition& partition, const SeamIsland& island) {
  std::uint64_t bodies = 0;
  for (const PartRef& ref : island.parts) bodies += partition.seam_graph.part(ref).bodies;
  return island.parts.size() > 1 && bodies > partition.settings.island_cap;
}

void couple(Partition& partition, TickContext& context, const SeamIsland& island,
            std::vector<Shipment>& outbox) {
  struct Holders {
    std::uint64_t ranks = 0;
    int parts = 0;
  };
  absl::flat_hash_map<BodyId, Holders> holders;
  for (const PartRef& ref : island.parts) {
    for (const BodyId id : partition.seam_graph.part(ref).links) {
      Holders& entry = holders[id];
      entry.ranks |= std::uint64_t{1} << partition.map.owner(ref.sector);
      ++entry.parts;
    }
  }
  if (partition.hosts(island.parts.front().sector) && !island.all_want_sleep) ++context.counts.islands_cut;
  bool takes_part = false;
  for (const PartRef& ref : island.parts) {
    if (!partition.hosts(ref.sector)) continue;
    Sector& sector = *partition.sectors.at(ref.sector);
    const std::uint32_t component = sector.part_components[ref.part];
    settle(partition, context, sector, sector.components[component], island.all_want_sleep);
    if (island.all_want_sleep) continue;
    CoupledPart part;
    part.id = partition.seam_graph.part(ref).first;
    part.sector = &sector;
    part.component = component;
    for (const BodyId id : partition.seam_graph.part(ref).links) {
      const Holders& entry = holders.at(id);
      if (entry.parts < 2) continue;
      part.shared.push_back({id, 0, entry.ranks});
      if (!lives_in(partition, id, sector)) continue;
      const HomeBody& body = *partition.bodies.at(id);
      for (Rank rank = 0; rank < outbox.size(); ++rank) {
        if ((entry.ranks >> rank & 1) == 0) continue;
        outbox[rank].shared.push_back({record_of(body), sector.world->total_wrench(body.slot)});
      }
    }
    context.plan.coupled.push_back(std::move(part));
    takes_part = true;
  }
  if (!takes_part) return;
  for (const PartRef& ref : island.parts) context.plan.coupled_with[partition.map.owner(ref.sector)] = true;
}

void begin_parts(Partition& partition, std::vector<CoupledPart>& coupled, const std::vector<Shipment>& inbox,
                 const ParallelFor& parallel) {
  absl::flat_hash_map<BodyId, const ShippedBody*> originals;
  for (const Shipment& message : inbox) {
    for (const ShippedBody& body : message.shared) originals.emplace(body.record.id, &body);
  }
  for (CoupledPart& part : coupled) {
    Sector& sector = *part.sector;
    const Component& component = sector.components[part.component];
    TaskBuilder builder;
    add_component(partition, sector, component, builder, /*clones_as_bodies=*/true);
    absl::flat_hash_set<BodyId> present;
    for (std::uint32_t i = component.clones_begin; i < component.clones_end; ++i) {
      const BodyId id = sector.component_clones[i];
      const ShippedBody& original = *originals.at(id);
      const BodySlot slot = sector.clones.at(id).slot;
      sector.world->set_velocity(slot, Eigen::Vector3d(original.record.state.linear_velocity.data()),
                                 Eigen::Vector3d(original.record.state.angular_velocity.data()));
      sector.world->set_total_wrench(slot, original.wrench);
      present.insert(id);
    }
    for (const BodyId parent : far_parents(partition, sector, component)) {
      if (!present.insert(parent).second) continue;
      const ShippedBody& original = *originals.at(parent);
      if (!part.copies) part.copies = partition.engine.make_world();
      const BodySlot slot = part.copies->add(original.record, Role::kHome);
      part.copies->set_total_wrench(slot, original.wrench);
      builder.add_copy(parent, {part.copies.get(), slot}, original.record.home);
    }
    part.job = build_job(partition, builder);
    // A body that only a joint of another part connects has no rows here.
    std::erase_if(part.shared, [&](CoupledPart::Shared& shared) {
      const std::optional<std::size_t> place = builder.place_of(shared.id);
      shared.place = place.value_or(0);
      return !place.has_value();
    });
    part.solver = partition.engine.make_part_solver();
  }
  // One after the other where kinematic bodies are about: engines keep solver state in them during the
  // set-up.
  const auto begin = [&](std::size_t n) {
    std::vector<std::size_t> places;
    for (const CoupledPart::Shared& shared : coupled[n].shared) places.push_back(shared.place);
    coupled[n].solver->begin(coupled[n].job.task, places, partition.dt());
  };
  const bool kinematics = std::any_of(coupled.begin(), coupled.end(),
                                      [](const CoupledPart& part) { return !part.job.kinematics.empty(); });
  if (kinematics) {
    for (std::size_t n = 0; n < coupled.size(); ++n) begin(n);
  } else {
    run_parallel(parallel, coupled.size(), begin);
  }
}

std::vector<Coupling> changes_of_parts(std::size_t servers, const std::vector<CoupledPart>& coupled) {
  std::vector<Coupling> outbox(servers);
  for (const CoupledPart& part : coupled) {
    for (std::size_t n = 0; n < part.shared.size(); ++n) {
      const SharedChange change{part.shared[n].id, part.id, part.solver->change(n)};
      for (std::uint64_t ranks = part.shared[n].ranks; ranks != 0; ranks &= ranks - 1) {
        outbox[static_cast<std::size_t>(std::countr_zero(ranks))].changes.push_back(change);
      }
    }
  }
  return outbox;
}

bool next_pass(std::vector<CoupledPart>& coupled, const std::vector<Coupling>& inbox, std::uint32_t pass,
               const ParallelFor& parallel) {
  agree(coupled, inbox, pass, parallel);
  const auto passes = static_cast<std::uint32_t>(coupled.front().solver->passes());
  run_parallel(parallel, coupled.size(), [&](std::size_t n) {
    PartSolver& solver = *coupled[n].solver;
    if (pass < passes) {
      solver.pass(static_cast<int>(pass));
    } else {
      solver.end();
    }
  });
  return pass < passes;
}

}  // namespace tessera
