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

class Driver;
struct WorldHistory;

struct Scenario {
  std::uint64_t seed = 1;  // determines when each message arrives, and everything below
  std::uint32_t servers = 3;
  bool links = false;          // servers talk to those around them alone, however few they are
  Tick ticks = 120;            // at least 1; some more where the world runs by itself for a while
  std::uint32_t commands = 0;  // requests of clients, while the world runs
  // They are of every kind and with fields at their bounds and beyond, some clients do not wait for answers,
  // and worlds take each other's place.
  bool extremes = false;
  // ms of processor time that one process, or a server, may take for a tick; 0: any. Measured, so that it
  // differs from run to run.
  double tick_work_ms_max = 0;
  FaultNumbers faults{};
  // Of the faults that are drawn, only these, by their places; all if there is no such list.
  std::optional<std::vector<std::uint32_t>> only_faults;
  // Likewise of the commands; ascending.
  std::optional<std::vector<std::uint32_t>> only_commands;
};

// "0,3-5" of 0, 3, 4, 5; "none" of no place.
std::string text_of_places(const std::vector<std::uint32_t>& places);

// The faults of it, as far as they are not left out.
FaultSchedule faults_of(const Scenario& scenario);

// The command that repeats it; `world` as it is given to that, empty for corner_pile().
std::string command_of(const Scenario& scenario, const std::string& world = "");

// What happened in a scenario, or in several.
struct Coverage {
  FaultCounts faults{};  // that hit something
  DiskFaultCounts disk;
  SimCounts packets;
  std::uint64_t recoveries = 0;      // how often the world went on from a checkpoint
  std::uint64_t lists = 0;           // of commands, that took effect
  std::uint64_t told = 0;            // of these, those that a client was told of
  std::uint64_t commands = 0;        // that clients sent
  std::uint64_t queries = 0;         // likewise
  std::uint64_t refused = 0;         // requests of these
  std::uint64_t replaced = 0;        // worlds, by a load or a snapshot
  std::uint64_t work_ns = 0;         // the longest tick of one process with commands
  std::uint64_t server_ns = 0;       // of a server, if that is measured
  std::uint64_t coordinator_ns = 0;  // likewise, of what the coordinator does at a stretch
  std::uint64_t snapshots = 0;
  std::uint64_t moves = 0;          // of sectors to other servers, while the world runs: so many times
  std::uint64_t joined = 0;         // servers that began to take part without the world going back
  std::uint64_t left = 0;           // likewise, that ended to
  std::uint64_t standstill_ns = 0;  // the longest time without a tick during a step

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
// - After every tick the hash is that of one process with the same commands, in which no authority moves
//   (WorldSettings::shuffle).
// - Every command that was acknowledged took effect once, at the tick that was told.
// - A command that a lost coordinator did not answer took effect once or not at all.
// - Where links are cut for good, and nothing else happens, the world does not stand still for long.
// - What was stored is found again; snapshots have the world of their tick.
// - No tick takes more work than it may.
class ScenarioRunner {
 public:
  explicit ScenarioRunner(const WorldDescription& world);

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
  absl::Status check(const Scenario& scenario, SimulatedCluster& cluster, Driver& driver,
                     ScenarioReport& report);
  absl::Status check(WorldHistory& history);

  WorldDescription world_;
  Checker checker_;
  std::function<bool()> is_ended_ = [] { return false; };
  std::function<void(const std::string&)> log_;
};

// A small pile around the common corner of eight sectors.
WorldDescription corner_pile();

}  // namespace tessera
