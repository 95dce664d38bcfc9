// Runs the ticks of a scenario, with requests of clients in between, and worlds that take each other's place.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"
#include "recording.pb.h"
#include "simulator/dice.h"
#include "simulator/scenario.h"
#include "simulator/simulated_cluster.h"
#include "simulator/tick_gaps.h"
#include "simulator/workload.h"

namespace tessera {

// A world from its load, or from the snapshot that was restored, until another one took its place.
struct WorldHistory {
  std::optional<SnapshotChunks> from;        // none: as the scenario describes it
  std::vector<v1::RecordedInput> hashes;     // in the order in which they came
  std::vector<v1::StoredInput> stored;       // all lists of commands
  std::vector<SimulatedCluster::Told> told;  // those that clients were told of
  std::vector<SnapshotChunks> snapshots;     // taken of it
};

class Driver {
 public:
  // `hashes` receives those of the world that runs.
  Driver(SimulatedCluster& cluster, const WorldDescription& world, const Scenario& scenario, TickGaps& gaps,
         std::vector<v1::RecordedInput>& hashes);

  // At least `ticks`, from now on.
  absl::Status run(Tick ticks);

  // So many more, once all faults are over.
  absl::Status finish(Tick ticks);

  Tick tick() const { return tick_; }  // of the world that runs
  Tick done() const { return done_; }  // in all
  std::uint64_t moves() const { return moves_; }
  std::uint64_t replaced() const { return ended_.size(); }
  const WorkloadCounts& counts() const { return workload_.counts(); }

  // All worlds, the last one as it is now.
  std::vector<WorldHistory> take_histories();

 private:
  bool is_left_out(std::uint32_t command) const;
  absl::Status give(std::uint32_t command);
  void start_step(Tick ticks);
  absl::Status end_step();
  absl::Status pause();
  absl::Status balance();
  absl::Status run_freely();
  void set_tick(Tick tick);

  // Another world takes the place of the one that runs.
  absl::Status replace_world();
  absl::Status unload();
  absl::Status load_another(const std::optional<SnapshotChunks>& from, std::uint64_t before);
  WorldHistory end_world();

  SimulatedCluster& cluster_;
  const WorldDescription world_;
  const Scenario scenario_;
  TickGaps& gaps_;
  std::vector<v1::RecordedInput>& hashes_;
  Dice dice_;
  Workload workload_;
  const bool may_balance_;  // a coordinator refuses to, where authority moves at random
  std::uint64_t moves_ = 0;
  Tick tick_ = 0;
  Tick done_ = 0;
  SimulatedCluster::Pending<v1::Reply> step_;
  std::optional<SnapshotChunks> from_;  // of the world that runs
  std::size_t told_before_ = 0;         // as of the end of the world before it
  std::uint64_t requests_before_ = 0;
  std::vector<WorldHistory> ended_;
};

}  // namespace tessera
