// Random requests of clients, drawn from a seed: bodies are spawned, removed, pushed, moved and joined.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <vector>

#include "lpss/model/world_description.h"
#include "simulator/dice.h"
#include "simulator/simulated_cluster.h"

namespace tessera {

class Workload {
 public:
  // For a loaded world that nobody else changes.
  Workload(std::uint64_t seed, const WorldDescription& world);

  // Makes one request and waits for the answer. Errors are the cluster's: every request is valid.
  absl::Status give_next(SimulatedCluster& cluster);

  // Those that were taken.
  const std::vector<SnapshotChunks>& snapshots() const { return snapshots_; }

 private:
  struct OwnJoint {
    std::uint64_t id;
    std::uint64_t parent;
    std::uint64_t child;
  };

  absl::StatusOr<std::uint64_t> spawn(SimulatedCluster& cluster, const WorldPosition& place, Motion motion);
  absl::Status spawn_pair(SimulatedCluster& cluster);
  absl::Status remove_body(SimulatedCluster& cluster);
  absl::Status remove_joint(SimulatedCluster& cluster);
  absl::Status push(SimulatedCluster& cluster);
  absl::Status set_velocity(SimulatedCluster& cluster);
  absl::Status apply_force(SimulatedCluster& cluster);
  absl::Status teleport(SimulatedCluster& cluster);
  absl::Status set_target(SimulatedCluster& cluster);
  absl::Status take_snapshot(SimulatedCluster& cluster);

  std::uint64_t any(const std::vector<std::uint64_t>& ids) { return ids[dice_.below(ids.size())]; }
  v1::Vector3 any_vector(double longest);
  WorldPosition any_place();

  Dice dice_;
  WorldSettings settings_;
  std::vector<WorldPosition> places_;     // where bodies of the world started
  std::vector<std::uint64_t> dynamic_;    // ids of bodies, as below
  std::vector<std::uint64_t> kinematic_;  // made here
  std::vector<OwnJoint> joints_;          // made here
  std::vector<SnapshotChunks> snapshots_;
};

}  // namespace tessera
