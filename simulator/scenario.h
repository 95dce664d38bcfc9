// A cluster with requests and faults, all drawn from one seed, and the checks that must hold.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"
#include "simulator/checker.h"

namespace tessera {

struct Scenario {
  std::uint64_t seed = 1;  // determines when each message arrives, and everything below
  std::uint32_t servers = 3;
  Tick ticks = 120;                       // at least 1
  std::uint32_t commands = 0;             // of clients, while the world runs
  std::uint32_t cuts = 0;                 // of links between two processes
  std::uint32_t crashes = 0;              // of servers, each of which another one replaces
  std::uint32_t coordinator_crashes = 0;  // likewise
};

// The command that repeats it, for the world corner_pile().
std::string command_of(const Scenario& scenario);

struct ScenarioReport {
  std::string hash;  // after the last tick
  // Of the cluster, identical in every run of the scenario: the last tick that all servers completed, how
  // often the world went on from a checkpoint, and the number of events.
  Tick tick = 0;
  std::uint64_t recoveries = 0;
  std::uint64_t events = 0;
};

// Runs scenarios of one world, and checks of each:
// - All ticks are done, whatever links are cut for however long and however many servers crash.
// - After every tick the hash is that of one process with the same commands.
// - Every command that was acknowledged took effect once, at the tick that was told.
// - A command that a lost coordinator did not answer took effect once or not at all.
class ScenarioRunner {
 public:
  explicit ScenarioRunner(const WorldDescription& world) : world_(world), checker_(world) {}

  // Called repeatedly from now on: true ends the running scenario with CANCELLED.
  void end_when(std::function<bool()> is_ended) {
    checker_.end_when(is_ended);
    is_ended_ = std::move(is_ended);
  }

  // ABORTED, with a reason, if one of these does not hold; CANCELLED; otherwise the errors of loading the
  // world.
  absl::StatusOr<ScenarioReport> run(const Scenario& scenario);

  Checker& checker() { return checker_; }

 private:
  WorldDescription world_;
  Checker checker_;
  std::function<bool()> is_ended_ = [] { return false; };
};

// A small pile around the common corner of eight sectors.
WorldDescription corner_pile();

}  // namespace tessera
