// What a server is to solve in one tick: its jobs, and the islands that wait for other servers.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <compare>
#include <map>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/tick/island_task.h"
#include "lpss/tick/recipients.h"

namespace tessera {

// An island that waits for the parts that other servers ship.
struct PendingIsland {
  BodyId id;
  TaskBuilder builder;  // in the island
};

// A part of an island that lives here.
struct HostedPart {
  Sector* sector = nullptr;
  const Component* component = nullptr;
};

// A contact of an island between dynamic bodies of different homes.
struct SeamContact {
  BodyId island;
  BodyId a;  // in either order
  BodyId b;
  SectorIndex home_a;
  SectorIndex home_b;
};

// The sectors in which an island has parts, and who hosts them.
using IslandSectors = absl::flat_hash_map<SectorIndex, Rank>;

// The hosted parts of islands that are solved in step with other servers (staged.h).
struct StagedIslands {
  explicit StagedIslands(const Partition& partition) : builder(partition) { builder.begin_island(); }

  std::map<BodyId, IslandSectors> islands;
  TaskBuilder builder;                           // of all islands as one
  absl::flat_hash_map<BodyId, SectorIndex> own;  // homes of those that others may touch, or that touch others
  absl::flat_hash_map<BodyId, SeamStages> seam_stages;  // of all that are known; see ShippedBody
  std::vector<SeamContact> contacts;                    // that were detected here
};

// Islands of one kind are one task.
struct StagedKind {
  int substeps = 0;
  bool bounces = false;

  friend auto operator<=>(const StagedKind&, const StagedKind&) = default;
};

struct IslandPlan {
  std::vector<SolveJob> jobs;
  std::vector<PendingIsland> pending;                            // ascending by id
  absl::flat_hash_map<BodyId, std::vector<HostedPart>> shipped;  // by island: in the order of shipping
  std::map<StagedKind, StagedIslands> staged;

  // By rank.
  std::vector<bool> awaits_shipment;  // it ships a part of an island that is solved here, or in step with it
  std::vector<bool> awaits_solution;  // it solves an island that has a part here
  Ranks in_step;                      // the servers with which this one solves islands in step
};

}  // namespace tessera
