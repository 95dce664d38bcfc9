// What a server is to solve in one tick: its jobs, and the islands that wait for other servers.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <vector>

#include "lpss/model/body.h"
#include "lpss/tick/island_task.h"

namespace tessera {

// An island that waits for the parts that other servers ship.
struct PendingIsland {
  BodyId id;
  TaskBuilder builder;
  absl::flat_hash_map<BodyId, BodyRecord> own;
};

struct IslandPlan {
  std::vector<SolveJob> jobs;
  std::vector<PendingIsland> pending;  // ascending by id

  // By rank.
  std::vector<bool> awaits_shipment;  // it ships a part of an island that is solved here
  std::vector<bool> awaits_solution;  // it solves an island that has a part here
};

}  // namespace tessera
