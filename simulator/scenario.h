// A cluster, what it is asked and what goes wrong, all of it drawn from one seed; and what must hold then.
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
  std::uint64_t seed = 1;  // decides when each message arrives, and all that is drawn below
  std::uint32_t servers = 3;
  Tick ticks = 120;            // at least 1
  std::uint32_t commands = 0;  // of clients, while the world is stepped
  std::uint32_t cuts = 0;      // of links between two processes
  std::uint32_t crashes = 0;   // of servers
};

// The command that runs it again, for the world corner_pile().
std::string command_of(const Scenario& scenario);

struct ScenarioReport {
  std::string hash;     // after the last tick; empty where the world has ended before
  std::string failure;  // what ended the world, as it had to; empty where nothing did
  // In the cluster, and the same in another run of the scenario: the last tick that all servers have done,
  // and what has happened in all.
  Tick tick = 0;
  std::uint64_t events = 0;
};

// Runs scenarios of one world, and checks of each:
// - After every tick the hash is that of one process to which the same commands were given.
// - Cuts that are shorter than the time-outs, and those between servers however long, change nothing else.
// - A server that crashes, or that the coordinator cannot hear for too long, ends the world with a message
// that
//   names it; a server that was cut off for so long ends by itself.
class ScenarioRunner {
 public:
  explicit ScenarioRunner(const WorldDescription& world) : world_(world), checker_(world) {}

  // Asked now and then from now on: true ends what runs with CANCELLED.
  void end_when(std::function<bool()> is_ended) {
    checker_.end_when(is_ended);
    is_ended_ = std::move(is_ended);
  }

  // ABORTED, with a reason, where one of these does not hold; CANCELLED; otherwise the errors of loading the
  // world.
  absl::StatusOr<ScenarioReport> run(const Scenario& scenario);

  Checker& checker() { return checker_; }

 private:
  WorldDescription world_;
  Checker checker_;
  std::function<bool()> is_ended_ = [] { return false; };
};

// A small pile around the corner where eight sectors meet.
WorldDescription corner_pile();

}  // namespace tessera
