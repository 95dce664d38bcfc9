// Random requests of a client, drawn from a seed: bodies are spawned, removed, pushed, moved, changed and
// joined, one by one and in lists.
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

  // Makes one request and waits for the answer; some are made twice, and some again when the coordinator is
  // lost, as clients do. Errors are the cluster's: every request is valid.
  absl::Status give_next(SimulatedCluster& cluster);

  // Those that were taken.
  const std::vector<SnapshotChunks>& snapshots() const { return snapshots_; }

 private:
  struct OwnJoint {
    std::uint64_t id;
    std::uint64_t parent;
    std::uint64_t child;
  };

  void add_command(v1::Request& request);
  void spawn(v1::Request& request, const WorldPosition& place, Motion motion);
  void spawn_pair(v1::Request& request);
  void remove_body(v1::Request& request);
  void remove_joint(v1::Request& request);
  void push(v1::Request& request);
  void burst(v1::Request& request);
  void set_velocity(v1::Request& request);
  void set_properties(v1::Request& request);
  void place_pair(v1::Request& request);
  void apply_force(v1::Request& request);
  void teleport(v1::Request& request);
  void set_target(v1::Request& request);
  absl::Status send(SimulatedCluster& cluster, const v1::Request& request);
  void take(const v1::Request& request, const v1::Applied& applied);
  absl::Status take_snapshot(SimulatedCluster& cluster);

  std::uint64_t any(const std::vector<std::uint64_t>& ids) { return ids[dice_.below(ids.size())]; }
  v1::Vector3 any_vector(double longest);
  WorldPosition any_place();
  v1::Body any_body(Motion motion, v1::Model& model);

  Dice dice_;
  const std::uint64_t session_;
  std::uint64_t last_number_ = 0;
  WorldSettings settings_;
  std::vector<WorldPosition> places_;     // where bodies of the world started
  std::vector<std::uint64_t> dynamic_;    // ids of bodies, as below
  std::vector<std::uint64_t> kinematic_;  // made here
  std::vector<OwnJoint> joints_;          // made here
  std::vector<SnapshotChunks> snapshots_;
};

}  // namespace tessera
