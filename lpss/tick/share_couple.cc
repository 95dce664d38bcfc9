// Islands beyond the cap: each part is solved where it is, and after every pass the copies of shared bodies
// agree. What comes out is a function of the sectors and the cap, not of which servers they are on.
#include <algorithm>
#include <bit>

#include "lpss/base/invariant.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

bool comes_first(const SharedChange& a, const SharedChange& b) {
  return std::tie(a.body, a.part) < std::tie(b.body, b.part);
}

// How much lighter the copies of a body are. With 1, what the parts do to it adds up too far, and towers
// whose boxes are parts of their own fall; with one for each copy nothing overshoots, but they creep, and
// chains are long.
double lighter(int copies) { return std::max(1.0, 0.7 * copies); }

}  // namespace

bool Share::beyond_cap(const SeamIsland& island) const {
  std::uint64_t bodies = 0;
  for (const PartRef& ref : island.parts) bodies += seam_graph_.part(ref).bodies;
  return island.parts.size() > 1 && bodies > options_.settings.island_cap;
}

void Share::couple(const SeamIsland& island, std::vector<Shipment>& outbox) {
  struct Holders {
    std::uint64_t ranks = 0;
    int parts = 0;
  };
  absl::flat_hash_map<BodyId, Holders> holders;
  for (const PartRef& ref : island.parts) {
    for (const BodyId id : seam_graph_.part(ref).links) {
      Holders& entry = holders[id];
      entry.ranks |= std::uint64_t{1} << options_.map.owner(ref.sector);
      ++entry.parts;
    }
  }
  if (mine(island.parts.front().sector) && !island.all_drowsy) ++counts_.islands_cut;
  bool takes_part = false;
  for (const PartRef& ref : island.parts) {
    if (!mine(ref.sector)) continue;
    Sector& sector = *sectors_.at(ref.sector);
    const std::uint32_t component = sector.part_components[ref.part];
    settle(sector, sector.components[component], island.all_drowsy);
    if (island.all_drowsy) continue;
    CoupledPart part;
    part.name = seam_graph_.part(ref).first;
    part.sector = &sector;
    part.component = component;
    for (const BodyId id : seam_graph_.part(ref).links) {
      const Holders& entry = holders.at(id);
      if (entry.parts < 2) continue;
      part.shared.push_back({id, 0, entry.ranks});
      if (!lives_in(id, sector)) continue;
      const HomeBody& body = *bodies_.at(id);
      for (Rank rank = 0; rank < outbox.size(); ++rank) {
        if ((entry.ranks >> rank & 1) == 0) continue;
        outbox[rank].shared.push_back({record_of(body), sector.world->total_wrench(body.slot)});
      }
    }
    coupled_.push_back(std::move(part));
    takes_part = true;
  }
  if (!takes_part) return;
  for (const PartRef& ref : island.parts) coupled_with_[options_.map.owner(ref.sector)] = true;
}

// Gives every part its own bodies and copies of those that it shares, and sets up its rows.
void Share::begin_parts(const std::vector<Shipment>& inbox) {
  absl::flat_hash_map<BodyId, const ShippedBody*> originals;
  for (const Shipment& message : inbox) {
    for (const ShippedBody& body : message.shared) originals.emplace(body.record.id, &body);
  }
  for (CoupledPart& part : coupled_) {
    Sector& sector = *part.sector;
    const Component& component = sector.components[part.component];
    TaskBuilder builder;
    contribute(sector, component, builder, /*clones_as_bodies=*/true);
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
    for (const BodyId parent : far_parents(sector, component)) {
      if (!present.insert(parent).second) continue;
      const ShippedBody& original = *originals.at(parent);
      if (!part.copies) part.copies = engine_.make_world();
      const BodySlot slot = part.copies->add(original.record, Role::kHome);
      part.copies->set_total_wrench(slot, original.wrench);
      builder.add_copy(parent, {part.copies.get(), slot}, original.record.home);
    }
    part.job = built(builder);
    // What only hangs on a joint of another part has no rows here.
    std::erase_if(part.shared, [&](CoupledPart::Shared& shared) {
      const std::optional<std::size_t> place = builder.place_of(shared.id);
      shared.place = place.value_or(0);
      return !place.has_value();
    });
    part.solver = engine_.make_part_solver();
  }
  // One after the other where kinematic bodies are about: engines keep solver state in them during the
  // set-up.
  const auto begin = [&](std::size_t n) {
    std::vector<std::size_t> places;
    for (const CoupledPart::Shared& shared : coupled_[n].shared) places.push_back(shared.place);
    coupled_[n].solver->begin(coupled_[n].job.task, places, dt());
  };
  const bool kinematics = std::any_of(coupled_.begin(), coupled_.end(),
                                      [](const CoupledPart& part) { return !part.job.kinematics.empty(); });
  if (kinematics) {
    for (std::size_t n = 0; n < coupled_.size(); ++n) begin(n);
  } else {
    run_parallel(coupled_.size(), begin);
  }
}

std::vector<Coupling> Share::changes_of_parts() const {
  std::vector<Coupling> outbox(options_.map.servers());
  for (const CoupledPart& part : coupled_) {
    for (std::size_t n = 0; n < part.shared.size(); ++n) {
      const SharedChange change{part.shared[n].id, part.name, part.solver->change(n)};
      for (std::uint64_t ranks = part.shared[n].ranks; ranks != 0; ranks &= ranks - 1) {
        outbox[static_cast<std::size_t>(std::countr_zero(ranks))].changes.push_back(change);
      }
    }
  }
  return outbox;
}

// Gives every copy of a body what all parts did to it (engine.h, PartSolver).
void Share::agree(const std::vector<Coupling>& inbox) {
  std::vector<SharedChange> changes;
  for (const Coupling& message : inbox) {
    changes.insert(changes.end(), message.changes.begin(), message.changes.end());
  }
  std::sort(changes.begin(), changes.end(), comes_first);
  run_parallel(coupled_.size(), [&](std::size_t p) {
    CoupledPart& part = coupled_[p];
    for (std::size_t n = 0; n < part.shared.size(); ++n) {
      VelocityChange sum;
      int copies = 0;
      const SharedChange first{part.shared[n].id, BodyId{}, {}};
      for (auto change = std::lower_bound(changes.begin(), changes.end(), first, comes_first);
           change != changes.end() && change->body == part.shared[n].id; ++change) {
        sum += change->change;
        ++copies;
      }
      part.solver->agree(n, pass_ == 0 ? sum : scaled(sum, 1 / lighter(copies)));
      if (pass_ == 0) part.solver->split(n, lighter(copies));
    }
  });
}

}  // namespace tessera
