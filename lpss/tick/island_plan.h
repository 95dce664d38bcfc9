// What a server is to solve in one tick: its jobs, and the islands that wait for other servers.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "lpss/engine/engine.h"
#include "lpss/partition/sector.h"
#include "lpss/tick/island_task.h"

namespace tessera {

// An island that waits for the parts that other servers ship.
struct PendingIsland {
  BodyId id;
  TaskBuilder builder;
  absl::flat_hash_map<BodyId, BodyRecord> own;
};

// A part of an island beyond the cap, which is solved beside the others (engine.h, PartSolver).
struct CoupledPart {
  struct Shared {
    BodyId id;
    std::size_t place = 0;    // in the task's bodies
    std::uint64_t ranks = 0;  // bits: which servers have a copy, or the body
  };

  BodyId id;  // the first of its bodies
  Sector* sector = nullptr;
  std::uint32_t component = 0;          // of the sector
  std::vector<Shared> shared;           // ascending by id
  std::unique_ptr<SectorWorld> copies;  // bodies that only joints reach to
  SolveJob job;
  std::unique_ptr<PartSolver> solver;
};

struct IslandPlan {
  std::vector<SolveJob> jobs;
  std::vector<PendingIsland> pending;  // ascending by id
  std::vector<CoupledPart> coupled;

  // By rank.
  std::vector<bool> awaits_shipment;  // it ships a part of an island that is solved here
  std::vector<bool> awaits_solution;  // it solves an island that has a part here
  std::vector<bool> coupled_with;     // its parts share bodies with ours
};

}  // namespace tessera
