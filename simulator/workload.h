// Random requests of clients, drawn from a seed. By default, all are valid, and clients wait for each answer:
// bodies are spawned, removed, pushed, moved, changed and joined, one by one and in lists; in worlds with
// programs, they have programs of every kind, which are told something. With extremes, commands and queries
// are of every kind there is, with fields up to their bounds and beyond, and some clients do not wait.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "lpss/model/world_description.h"
#include "simulator/any_program.h"
#include "simulator/dice.h"
#include "simulator/known_world.h"
#include "simulator/simulated_cluster.h"

namespace tessera {

struct WorkloadCounts {
  std::uint64_t commands = 0;  // that were sent
  std::uint64_t queries = 0;
  std::uint64_t refused = 0;  // requests
};

class Workload {
 public:
  // For a loaded world that nobody else changes.
  Workload(std::uint64_t seed, const WorldDescription& world, bool has_extremes);

  // Makes the request with this place in the sequence, which depends on no other one but for what the world
  // has; some are made twice, and some again when the coordinator is lost, as clients do. Errors are the
  // cluster's: those that say what is wrong with a request count as refusals where there are extremes.
  absl::Status give(std::uint32_t place, SimulatedCluster& cluster);

  // Waits for all answers.
  absl::Status settle(SimulatedCluster& cluster);

  // Another world runs, or the same one from an earlier tick: nothing is known of it but its settings.
  void begin_world();

  // Those that were taken since the last call; snapshots() has them until then.
  std::vector<SnapshotChunks> take_snapshots() { return std::exchange(snapshots_, {}); }
  const std::vector<SnapshotChunks>& snapshots() const { return snapshots_; }

  std::uint64_t last_number() const { return last_number_; }
  const WorkloadCounts& counts() const { return counts_; }

 private:
  struct Sent {
    RequestId id;
    v1::Request request;
    SimulatedCluster::Pending<v1::Reply> first;
    SimulatedCluster::Pending<v1::Reply> again;  // the same, or made twice
    int tries = 0;
  };

  // any_requests.cc
  absl::Status give_any(SimulatedCluster& cluster);
  absl::Status look_around(SimulatedCluster& cluster);
  absl::Status collect(SimulatedCluster& cluster);
  v1::Request any_request();

  void add_command(v1::Request& request);
  void spawn(v1::Request& request, const WorldPosition& place, Motion motion);
  void spawn_pair(v1::Request& request);
  void remove_body(v1::Request& request);
  void remove_joint(v1::Request& request);
  void push(v1::Request& request);
  void burst(v1::Request& request);
  void set_velocity(v1::Request& request);
  void set_properties(v1::Request& request);
  void set_force(v1::Request& request);
  void place_pair(v1::Request& request);
  void apply_force(v1::Request& request);
  void teleport(v1::Request& request);
  void set_target(v1::Request& request);
  void tell(v1::Request& request);
  AnyProgram any_program();
  void add_programs(v1::Model& model);
  Sent post(SimulatedCluster& cluster, const v1::Request& request);
  void post_again(SimulatedCluster& cluster, Sent& sent);
  absl::Status send(SimulatedCluster& cluster, const v1::Request& request);
  void take(const v1::Request& request, const v1::Applied& applied);
  absl::Status take_snapshot(SimulatedCluster& cluster);

  std::uint64_t any(const std::vector<std::uint64_t>& ids) { return ids[dice_.below(ids.size())]; }
  std::vector<std::uint64_t> dynamic() const { return known_.bodies_that_are(v1::MOTION_DYNAMIC); }
  std::vector<std::uint64_t> kinematic() const { return known_.bodies_that_are(v1::MOTION_KINEMATIC); }
  std::uint64_t any_pair();
  void forget_body(std::uint64_t id);
  void forget_joint(std::uint64_t id);
  bool is_of_torn_joint(const absl::Status& status) const;
  v1::Vector3 any_vector(double longest);
  WorldPosition any_place();
  WorldPosition any_place_for(std::uint64_t body);
  v1::Body any_body(Motion motion, v1::Model& model);

  const std::uint64_t seed_;
  const bool has_extremes_;
  Dice dice_;  // of the request that is being made
  const std::uint64_t session_;
  std::uint64_t last_number_ = 0;
  KnownWorld known_;
  bool has_programs_ = false;  // the world, from the start
  std::vector<Sent> sent_;     // that are not waited for
  std::vector<SnapshotChunks> snapshots_;
  WorkloadCounts counts_;
};

}  // namespace tessera
