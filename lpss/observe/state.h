// The state of the bodies that a partition hosts; between ticks.
#pragma once

#include <absl/functional/function_ref.h>

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "lpss/observe/world_hash.h"
#include "lpss/partition/partition.h"

namespace tessera {

// Sums over all partitions are the world's.
WorldHash hash_of(const Partition& partition);

// Of programs (WorldHash::add_programs()).
WorldHash program_hash_of(const Partition& partition);

// Calls `visit` for each dynamic and kinematic body, in ascending order of ids.
void for_each_body(const Partition& partition, const std::function<void(const BodyRecord&)>& visit);

// The programs of a body, which has some. Valid within a visit, and until the next tick.
struct ProgramsView {
  BodyId id;
  const std::vector<ProgramRecord>& programs;
};

// Likewise of those that have programs.
void for_each_programmed(const Partition& partition, absl::FunctionRef<void(const ProgramsView&)> visit);

// Nothing where the body lives elsewhere, or has none.
std::optional<ProgramsView> programs_of(const Partition& partition, BodyId id);

// What one needs of many bodies, without copies of their properties. Valid within a visit.
struct BodyView {
  BodyId id;
  const SectorIndex& home;
  const BodyProperties& properties;
  BodyState state;
};

// Likewise of the sectors that `wants` names: sector by sector, which is faster, ascending within each. With
// `awake_only`, sectors that are packed, in which all bodies sleep, are left out.
void for_each_body_in(const Partition& partition, const std::function<bool(const SectorIndex&)>& wants,
                      bool awake_only, const std::function<void(const BodyView&)>& visit);

// Nothing where the body lives elsewhere, or is static.
std::optional<BodyRecord> body_of(const Partition& partition, BodyId id);

// Those of the bodies, static ones included, whose homes the partition hosts, in the order of `ids`: each
// body of the world is answered for by one server. Packed sectors stay packed.
std::vector<BodyRecord> bodies_of(const Partition& partition, std::span<const BodyId> ids);

}  // namespace tessera
