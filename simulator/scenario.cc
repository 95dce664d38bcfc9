#include "simulator/scenario.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "lpss/simulation/example_worlds.h"
#include "simulator/dice.h"
#include "simulator/fault_schedule.h"
#include "simulator/simulated_cluster.h"
#include "simulator/workload.h"

namespace tessera {
namespace {

constexpr std::uint32_t kScenarioStream = 3;

// About the duration of a tick, so that most faults begin while ticks are running.
constexpr std::uint64_t kNsPerTick = 4'000'000;

// An unexpected error becomes ABORTED; CANCELLED stays.
absl::Status broken(const absl::Status& status) {
  return absl::IsCancelled(status) ? status : absl::AbortedError(status.message());
}

// Runs the ticks of a scenario, and requests of clients in between.
absl::Status drive(SimulatedCluster& cluster, const WorldDescription& world, const Scenario& scenario,
                   Tick ticks) {
  using Step = SimulatedCluster::Pending<v1::StepReply>;
  Dice dice(scenario.seed, kScenarioStream);
  Workload workload(scenario.seed, world);
  const Tick longest = 2 * (ticks / (scenario.commands + 1)) + 1;
  Step step;
  const auto start_step = [&](Tick most) {
    v1::StepRequest request;
    request.set_ticks(std::min(most, ticks));
    ticks -= request.ticks();
    step = cluster.post<v1::StepRequest, v1::StepReply>(std::move(request));
  };
  for (std::uint32_t command = 0; command < scenario.commands; ++command) {
    if (step && *step) {
      if (!(*step)->ok()) return (*step)->status();
      step.reset();
    }
    if (!step && ticks > 0 && !dice.one_in(3)) start_step(dice.between(std::uint64_t{1}, longest));
    for (std::uint64_t events = dice.below(20); step && !*step && events > 0; --events) cluster.run_events(1);
    if (absl::Status given = workload.give_next(cluster); !given.ok()) return given;
  }
  for (;;) {
    if (step) {
      if (absl::Status stepped = cluster.wait<v1::StepReply>(step).status(); !stepped.ok()) return stepped;
    }
    if (ticks == 0) return absl::OkStatus();
    start_step(ticks);
  }
}

}  // namespace

std::string command_of(const Scenario& scenario) {
  std::string command = absl::StrCat("tessera simulate --seed ", scenario.seed, " --servers ",
                                     scenario.servers, " --ticks ", scenario.ticks);
  if (scenario.commands > 0) absl::StrAppend(&command, " --commands ", scenario.commands);
  if (scenario.cuts > 0) absl::StrAppend(&command, " --cuts ", scenario.cuts);
  if (scenario.crashes > 0) absl::StrAppend(&command, " --crashes ", scenario.crashes);
  return command;
}

WorldDescription corner_pile() {
  WorldSettings settings;
  settings.sector_size = 8;
  return pile_world(settings, 40);
}

absl::StatusOr<ScenarioReport> ScenarioRunner::run(const Scenario& scenario) {
  const bool is_quiet = scenario.commands == 0 && scenario.cuts == 0 && scenario.crashes == 0;
  std::vector<v1::RecordedInput> log;
  SimulatedClusterOptions options;
  if (!is_quiet) options.inputs = [&log](const v1::RecordedInput& input) { log.push_back(input); };
  SimulatedCluster cluster(scenario.seed, scenario.servers, world_.settings.precision, options);
  cluster.end_when(is_ended_);
  if (absl::Status loaded = cluster.load(world_); !loaded.ok()) return loaded;

  const FaultSchedule faults = draw_faults(
      scenario.seed, {scenario.cuts, scenario.crashes, scenario.ticks * kNsPerTick}, cluster.servers());
  cluster.meet(faults);
  // The last tick comes after all faults, so that all their consequences are visible.
  const Tick after_faults = scenario.cuts + scenario.crashes > 0 ? 1 : 0;
  absl::Status outcome = drive(cluster, world_, scenario, scenario.ticks - after_faults);
  cluster.outlast_faults();
  if (outcome.ok() && after_faults > 0) outcome = cluster.step(after_faults).status();

  if (!outcome.ok()) return broken(outcome);
  const absl::StatusOr<v1::HashReply> hash = cluster.hash();
  if (!hash.ok()) return broken(hash.status());
  ScenarioReport report;
  report.hash = hash->hash();
  v1::RecordedHash& last = *log.emplace_back().mutable_hash();
  last.set_tick(hash->tick());
  last.set_hash(hash->hash());
  if (hash->tick() != scenario.ticks) {
    return absl::AbortedError(absl::StrCat("the world is at tick ", hash->tick()));
  }
  const absl::StatusOr<v1::StatusReply> status = cluster.status();
  if (!status.ok()) return broken(status.status());
  report.recoveries = status->recoveries();
  for (const v1::RecordedInput& input : log) report.tick = std::max(report.tick, input.hash().tick());
  report.events = cluster.events();
  if (absl::Status same = checker_.check(log); !same.ok()) return same;
  return report;
}

}  // namespace tessera
