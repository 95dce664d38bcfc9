#include "simulator/scenario.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <set>
#include <string>
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
constexpr int kEventsMax = 1'000'000;  // while there is no coordinator

// About the duration of a tick, so that most faults begin while ticks are running.
constexpr std::uint64_t kNsPerTick = 4'000'000;

// An unexpected error becomes ABORTED; CANCELLED stays.
absl::Status broken(const absl::Status& status) {
  return absl::IsCancelled(status) ? status : absl::AbortedError(status.message());
}

// The tick at which the world has paused, whatever coordinators are lost meanwhile.
absl::StatusOr<Tick> paused_tick(SimulatedCluster& cluster) {
  for (int events = 0; events < kEventsMax; ++events) {
    if (cluster.has_coordinator()) {
      const auto paused = cluster.call<v1::PauseRequest, v1::PauseReply>({});
      if (paused.ok()) return paused->tick();
      if (!absl::IsUnavailable(paused.status()) || cluster.has_coordinator()) return paused.status();
    }
    cluster.run_events(1);
  }
  return absl::DeadlineExceededError("no coordinator came back");
}

// Runs the ticks of a scenario, and requests of clients in between.
absl::Status drive(SimulatedCluster& cluster, const WorldDescription& world, const Scenario& scenario,
                   Tick ticks) {
  using Step = SimulatedCluster::Pending<v1::StepReply>;
  Dice dice(scenario.seed, kScenarioStream);
  Workload workload(scenario.seed, world);
  const Tick longest = 2 * (ticks / (scenario.commands + 1)) + 1;
  Tick begun = 0;
  Step step;
  const auto start_step = [&](Tick most) {
    v1::StepRequest request;
    request.set_ticks(std::min(most, ticks - begun));
    begun += request.ticks();
    step = cluster.post<v1::StepRequest, v1::StepReply>(std::move(request));
  };
  // Where its coordinator is lost, the world does the step or has not heard of it.
  const auto end_step = [&]() -> absl::Status {
    absl::Status status = cluster.wait<v1::StepReply>(step).status();
    step.reset();
    if (!absl::IsUnavailable(status)) return status;
    const absl::StatusOr<Tick> tick = paused_tick(cluster);
    if (!tick.ok()) return tick.status();
    begun = *tick;
    return absl::OkStatus();
  };
  for (std::uint32_t command = 0; command < scenario.commands; ++command) {
    if (step && *step) {
      if (absl::Status ended = end_step(); !ended.ok()) return ended;
    }
    if (!step && begun < ticks && !dice.one_in(3)) start_step(dice.between(std::uint64_t{1}, longest));
    for (std::uint64_t events = dice.below(20); step && !*step && events > 0; --events) cluster.run_events(1);
    absl::Status given = workload.give_next(cluster);
    if (!given.ok() && !absl::IsUnavailable(given)) return given;
  }
  for (;;) {
    if (step) {
      if (absl::Status ended = end_step(); !ended.ok()) return ended;
    }
    if (begun == ticks) return absl::OkStatus();
    start_step(ticks);
  }
}

// That each command that was acknowledged was stored as it was told.
absl::Status check_stored(const std::vector<v1::RecordedInput>& told,
                          const std::vector<v1::RecordedCommand>& stored) {
  std::multiset<std::string> all;
  for (const v1::RecordedCommand& command : stored) all.insert(command.SerializeAsString());
  for (const v1::RecordedInput& input : told) {
    if (!input.has_command()) continue;
    const auto found = all.find(input.command().SerializeAsString());
    if (found == all.end()) {
      return absl::AbortedError(absl::StrCat("a command was acknowledged for tick ", input.command().tick(),
                                             " and is not stored so"));
    }
    all.erase(found);
  }
  return absl::OkStatus();
}

}  // namespace

std::string command_of(const Scenario& scenario) {
  std::string command = absl::StrCat("tessera simulate --seed ", scenario.seed, " --servers ",
                                     scenario.servers, " --ticks ", scenario.ticks);
  if (scenario.commands > 0) absl::StrAppend(&command, " --commands ", scenario.commands);
  if (scenario.cuts > 0) absl::StrAppend(&command, " --cuts ", scenario.cuts);
  if (scenario.crashes > 0) absl::StrAppend(&command, " --crashes ", scenario.crashes);
  if (scenario.coordinator_crashes > 0) {
    absl::StrAppend(&command, " --coordinator-crashes ", scenario.coordinator_crashes);
  }
  return command;
}

WorldDescription corner_pile() {
  WorldSettings settings;
  settings.sector_size = 8;
  return pile_world(settings, 40);
}

absl::StatusOr<ScenarioReport> ScenarioRunner::run(const Scenario& scenario) {
  const bool is_quiet =
      scenario.commands + scenario.cuts + scenario.crashes + scenario.coordinator_crashes == 0;
  std::vector<v1::RecordedInput> log;
  SimulatedClusterOptions options;
  if (!is_quiet) options.inputs = [&log](const v1::RecordedInput& input) { log.push_back(input); };
  SimulatedCluster cluster(scenario.seed, scenario.servers, world_.settings.precision, options);
  cluster.end_when(is_ended_);
  if (absl::Status loaded = cluster.load(world_); !loaded.ok()) return loaded;

  const FaultSchedule faults = draw_faults(
      scenario.seed,
      {scenario.cuts, scenario.crashes, scenario.coordinator_crashes, scenario.ticks * kNsPerTick},
      cluster.servers());
  cluster.meet(faults);
  // The last tick comes after all faults, so that all their consequences are visible.
  const Tick after_faults = scenario.cuts + scenario.crashes + scenario.coordinator_crashes > 0 ? 1 : 0;
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
  if (absl::Status kept = check_stored(log, cluster.stored_commands()); !kept.ok()) return kept;
  // Also those that nobody was told of.
  std::erase_if(log, [](const v1::RecordedInput& input) { return input.has_command(); });
  for (const v1::RecordedCommand& command : cluster.stored_commands()) {
    *log.emplace_back().mutable_command() = command;
  }
  if (absl::Status same = checker_.check(log); !same.ok()) return same;
  return report;
}

}  // namespace tessera
