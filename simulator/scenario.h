// A cluster with requests and faults, all drawn from one seed, and the checks that must hold.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"
#include "simulator/checker.h"
#include "simulator/simulated_cluster.h"

namespace tessera {

struct Scenario {
  std::uint64_t seed = 1;  // determines when each message arrives, and everything below
  std::uint32_t servers = 3;
  bool links = false;          // servers talk to those around them alone, however few they are
  Tick ticks = 120;            // at least 1; some more where the world runs by itself for a while
  std::uint32_t commands = 0;  // of clients, while the world runs
  FaultNumbers faults{};
  // Of the faults that are drawn, only these, by their places; all if there is no such list.
  std::optional<std::vector<std::uint32_t>> only_faults;
};

// The faults of it, as far as they are not left out.
FaultSchedule faults_of(const Scenario& scenario);

// The command that repeats it; `world` as it is given to that, empty for corner_pile().
std::string command_of(const Scenario& scenario, const std::string& world = "");

// What happened in a scenario, or in several.
struct Coverage {
  FaultCounts faults{};  // that hit something
  DiskFaultCounts disk;
  SimCounts packets;
  std::uint64_t recoveries = 0;  // how often the world went on from a checkpoint
  std::uint64_t lists = 0;       // of commands, that took effect
  std::uint64_t told = 0;        // of these, those that a client was told of
  std::uint64_t snapshots = 0;
  std::uint64_t moves = 0;   // of sectors to other servers, while the world runs: so many times
  std::uint64_t joined = 0;  // servers that began to take part without the world going back
  std::uint64_t left = 0;    // likewise, that ended to

  void add(const Coverage& other);
  std::string text() const;
};

struct ScenarioReport {
  std::string hash;  // after the last tick
  // Of the cluster, identical in every run of the scenario: the last tick that all servers completed, and the
  // number of events.
  Tick tick = 0;
  std::uint64_t events = 0;
  Coverage coverage;
};

// Runs scenarios of one world, and checks of each:
// - All ticks are done, whatever happens to links, processes, clocks and the disk, for however long.
// - After every tick the hash is that of one process with the same commands.
// - Every command that was acknowledged took effect once, at the tick that was told.
// - A command that a lost coordinator did not answer took effect once or not at all.
// - What was stored is found again; snapshots have the world of their tick.
class ScenarioRunner {
 public:
  explicit ScenarioRunner(const WorldDescription& world) : world_(world), checker_(world) {}

  // Called repeatedly from now on: true ends the running scenario with CANCELLED.
  void end_when(std::function<bool()> is_ended) {
    checker_.end_when(is_ended);
    is_ended_ = std::move(is_ended);
  }
  // Receives what the processes of the next scenarios log.
  void log_to(std::function<void(const std::string& line)> log) { log_ = std::move(log); }

  // ABORTED, with a reason, if one of these does not hold; CANCELLED; otherwise the errors of loading the
  // world.
  absl::StatusOr<ScenarioReport> run(const Scenario& scenario);

  Checker& checker() { return checker_; }

 private:
  absl::Status check(const Scenario& scenario, SimulatedCluster& cluster,
                     const std::vector<SnapshotChunks>& snapshots, std::vector<v1::RecordedInput> log,
                     ScenarioReport& report);

  WorldDescription world_;
  Checker checker_;
  std::function<bool()> is_ended_ = [] { return false; };
  std::function<void(const std::string&)> log_;
};

// A small pile around the common corner of eight sectors.
WorldDescription corner_pile();

}  // namespace tessera
