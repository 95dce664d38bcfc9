#include "simulator/scenario.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "lpss/simulation/example_worlds.h"
#include "proto/snapshot.h"
#include "simulator/dice.h"
#include "simulator/workload.h"

namespace tessera {
namespace {

constexpr std::uint32_t kScenarioStream = 3;
constexpr std::uint32_t kBalanceStream = 6;
constexpr int kEventsMax = 1'000'000;  // while there is no coordinator

// About the duration of a tick, so that most faults begin while ticks are running.
constexpr std::uint64_t kNsPerTick = 4'000'000;

// An unexpected error becomes ABORTED; CANCELLED stays.
absl::Status broken(const absl::Status& status) {
  return absl::IsCancelled(status) ? status : absl::AbortedError(status.message());
}

// What a client must expect of a cluster with faults.
bool is_expected(const absl::Status& status) {
  return status.ok() || absl::IsUnavailable(status) || absl::IsResourceExhausted(status);
}

// The tick at which the world has paused, whatever coordinators are lost meanwhile.
absl::StatusOr<Tick> paused_tick(SimulatedCluster& cluster) {
  for (int events = 0; events < kEventsMax && cluster.failure().ok(); ++events) {
    if (cluster.has_coordinator()) {
      const auto paused = cluster.call<v1::PauseRequest, v1::PauseReply>({});
      if (paused.ok()) return paused->tick();
      if (!absl::IsUnavailable(paused.status())) return paused.status();
    }
    cluster.run_events(1);
  }
  if (!cluster.failure().ok()) return cluster.failure();
  return absl::DeadlineExceededError("no coordinator came back");
}

// Runs the ticks of a scenario, with requests of clients in between.
class Driver {
 public:
  Driver(SimulatedCluster& cluster, const WorldDescription& world, const Scenario& scenario)
      : cluster_(cluster),
        dice_(scenario.seed, kScenarioStream),
        balance_dice_(scenario.seed, kBalanceStream),
        workload_(scenario.seed, world),
        commands_(scenario.commands) {}

  // At least `ticks`, from now on.
  absl::Status run(Tick ticks) {
    const Tick longest = 2 * (ticks / (commands_ + 1)) + 1;
    for (std::uint32_t command = 0; command < commands_; ++command) {
      if (step_ && *step_) {
        if (absl::Status ended = end_step(); !ended.ok()) return ended;
      }
      if (!step_ && begun_ < ticks && !dice_.one_in(3)) {
        start_step(std::min(dice_.between(std::uint64_t{1}, longest), ticks - begun_));
      } else if (!step_ && dice_.one_in(8)) {
        if (absl::Status ran = run_freely(); !ran.ok()) return ran;
      }
      for (std::uint64_t events = dice_.below(20); step_ && !*step_ && events > 0; --events) {
        cluster_.run_events(1);
      }
      if (balance_dice_.one_in(4)) {
        if (absl::Status balanced = balance(); !is_expected(balanced)) return balanced;
      }
      if (absl::Status given = workload_.give_next(cluster_); !is_expected(given)) return given;
    }
    for (;;) {
      if (step_) {
        if (absl::Status ended = end_step(); !ended.ok()) return ended;
      }
      if (begun_ >= ticks) return absl::OkStatus();
      start_step(ticks - begun_);
    }
  }

  // Ticks that were done.
  Tick done() const { return begun_; }
  const std::vector<SnapshotChunks>& snapshots() const { return workload_.snapshots(); }
  std::uint64_t moves() const { return moves_; }

 private:
  void start_step(Tick ticks) {
    v1::Request request;
    request.set_ticks(ticks);
    begun_ += ticks;
    step_ = cluster_.post<v1::Request, v1::Reply>(std::move(request));
  }

  // Where its coordinator is lost, the world does the step or has not heard of it.
  absl::Status end_step() {
    absl::Status status = cluster_.wait<v1::Reply>(step_).status();
    step_.reset();
    if (!absl::IsUnavailable(status)) return status;
    return pause();
  }

  absl::Status pause() {
    const absl::StatusOr<Tick> tick = paused_tick(cluster_);
    if (tick.ok()) begun_ = *tick;
    return tick.status();
  }

  absl::Status balance() {
    v1::BalanceRequest request;
    request.set_policy(
        std::string(name_of(kBalancePolicies[balance_dice_.below(std::size(kBalancePolicies))])));
    const auto balance = cluster_.call<v1::BalanceRequest, v1::BalanceReply>(std::move(request));
    if (balance.ok() && balance->moves()) ++moves_;
    return balance.status();
  }

  // At the pace of real time, or as fast as it goes, for a while.
  absl::Status run_freely() {
    v1::ResumeRequest request;
    request.set_real_time_factor(dice_.one_in(2) ? 1 : 0);
    const auto resumed = cluster_.call<v1::ResumeRequest, v1::ResumeReply>(std::move(request));
    if (!resumed.ok() && !is_expected(resumed.status())) return resumed.status();
    cluster_.run_events(dice_.below(100));
    return pause();
  }

  SimulatedCluster& cluster_;
  Dice dice_;
  Dice balance_dice_;
  Workload workload_;
  const std::uint32_t commands_;
  std::uint64_t moves_ = 0;
  Tick begun_ = 0;
  SimulatedCluster::Pending<v1::Reply> step_;
};

// That each list that was acknowledged was stored, as it was told, and that none was stored twice.
absl::Status check_stored(const std::vector<SimulatedCluster::Told>& told,
                          const std::vector<v1::StoredInput>& stored) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, const v1::RecordedCommands*> all;
  for (const v1::StoredInput& input : stored) {
    if (!all.emplace(std::pair(input.session(), input.number()), &input.commands()).second)
      return absl::AbortedError(absl::StrCat("request ", input.number(), " is stored twice"));
  }
  for (const SimulatedCluster::Told& request : told) {
    const auto found = all.find({request.id.session, request.id.number});
    const bool is_there =
        found != all.end() && found->second->tick() == request.tick &&
        std::ranges::equal(found->second->commands(), request.request.commands(), {},
                           &v1::Command::SerializeAsString, &v1::Command::SerializeAsString);
    if (!is_there) {
      return absl::AbortedError(absl::StrCat("request ", request.id.number, " was acknowledged for tick ",
                                             request.tick, " and is not stored so"));
    }
  }
  return absl::OkStatus();
}

absl::Status check_snapshots(const std::vector<SnapshotChunks>& snapshots,
                             const std::vector<v1::RecordedInput>& log) {
  for (const SnapshotChunks& chunks : snapshots) {
    const absl::StatusOr<ReadSnapshot> snapshot = from_chunks(chunks);
    if (!snapshot.ok()) return broken(snapshot.status());
    const auto restored = Simulation::restore(snapshot->world);
    if (!restored.ok()) return broken(restored.status());
    const Tick tick = (*restored)->tick();
    const std::string hash = (*restored)->hash().to_string();
    for (const v1::RecordedInput& input : log) {
      if (!input.has_hash() || input.hash().tick() != tick || input.hash().hash() == hash) continue;
      return absl::AbortedError(absl::StrCat("a snapshot of tick ", tick, " has the hash ", hash,
                                             ", the world ", input.hash().hash()));
    }
  }
  return absl::OkStatus();
}

absl::Status all_have_joined(SimulatedCluster& cluster, std::uint32_t servers) {
  for (int events = 0; events < kEventsMax; ++events) {
    const absl::StatusOr<v1::StatusReply> status = cluster.status();
    if (!status.ok() || status->servers_size() == static_cast<int>(servers)) return status.status();
    cluster.run_events(1);
  }
  return absl::DeadlineExceededError("not all servers have joined");
}

std::uint64_t count_of(const FaultNumbers& numbers) {
  return std::accumulate(numbers.begin(), numbers.end(), std::uint64_t{0});
}

}  // namespace

FaultSchedule faults_of(const Scenario& scenario) {
  FaultSchedule all = draw_faults(scenario.seed, scenario.faults, scenario.ticks * kNsPerTick);
  if (!scenario.only_faults) return all;
  FaultSchedule kept;
  for (const std::uint32_t place : *scenario.only_faults) {
    if (place < all.size()) kept.push_back(all[place]);
  }
  return kept;
}

std::string command_of(const Scenario& scenario, const std::string& world) {
  std::string command =
      absl::StrCat("tessera simulate ", world, world.empty() ? "" : " ", "--seed ", scenario.seed,
                   " --servers ", scenario.servers, " --ticks ", scenario.ticks);
  if (scenario.links) absl::StrAppend(&command, " --links");
  if (scenario.commands > 0) absl::StrAppend(&command, " --commands ", scenario.commands);
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    if (scenario.faults[kind] > 0) {
      absl::StrAppend(&command, " --", kFaultNames[kind].option, " ", scenario.faults[kind]);
    }
  }
  if (scenario.only_faults) {
    absl::StrAppend(&command, " --only-faults ",
                    scenario.only_faults->empty() ? "none" : absl::StrJoin(*scenario.only_faults, ","));
  }
  return command;
}

void Coverage::add(const Coverage& other) {
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) faults[kind] += other.faults[kind];
  disk.torn_writes += other.disk.torn_writes;
  disk.forgotten_writes += other.disk.forgotten_writes;
  disk.full += other.disk.full;
  disk.failed += other.disk.failed;
  packets.sent += other.packets.sent;
  packets.lost += other.packets.lost;
  packets.duplicated += other.packets.duplicated;
  recoveries += other.recoveries;
  lists += other.lists;
  told += other.told;
  snapshots += other.snapshots;
  moves += other.moves;
  joined += other.joined;
  left += other.left;
}

std::string Coverage::text() const {
  std::string text = "faults that hit something:";
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    absl::StrAppend(&text, kind == 0 ? " " : ", ", kFaultNames[kind].option, " ", faults[kind]);
  }
  absl::StrAppend(&text, "\ndisk: ", disk.torn_writes, " writes torn, ", disk.forgotten_writes,
                  " forgotten, ", disk.full, " without room, ", disk.failed, " operations failed\n");
  absl::StrAppend(&text, "packets: ", packets.sent, " sent, ", packets.lost, " lost, ", packets.duplicated,
                  " arrived twice\n");
  absl::StrAppend(&text, "the world went on from a checkpoint ", recoveries, " times; ", lists,
                  " lists of commands took effect, of which clients were told of ", told, "; ", snapshots,
                  " snapshots; it was divided anew ", moves, " times; ", joined, " servers joined it and ",
                  left, " left it without going back\n");
  return text;
}

WorldDescription corner_pile() {
  WorldSettings settings;
  settings.sector_size = 8;
  return pile_world(settings, 40);
}

absl::StatusOr<ScenarioReport> ScenarioRunner::run(const Scenario& scenario) {
  const bool has_faults = count_of(scenario.faults) > 0;
  std::vector<v1::RecordedInput> log;  // hashes
  SimulatedClusterOptions options;
  if (has_faults || scenario.commands > 0) {
    options.inputs = [&log](const v1::RecordedInput& input) {
      if (input.has_hash()) log.push_back(input);
    };
  }
  options.log = log_;
  if (scenario.links) options.all_linked_max = 1;
  options.takes_all_servers = scenario.faults[static_cast<std::size_t>(FaultKind::kJoin)] > 0 ||
                              scenario.faults[static_cast<std::size_t>(FaultKind::kDrain)] > 0;
  SimulatedCluster cluster(scenario.seed, scenario.servers, world_.settings.precision, options);
  cluster.end_when(is_ended_);
  if (options.takes_all_servers) {
    if (absl::Status joined = all_have_joined(cluster, scenario.servers); !joined.ok()) return joined;
  }
  if (absl::Status loaded = cluster.load(world_); !loaded.ok()) return loaded;

  cluster.meet(faults_of(scenario));
  // The last tick comes after all faults, so that all their consequences are visible.
  const Tick after_faults = has_faults ? 1 : 0;
  Driver driver(cluster, world_, scenario);
  absl::Status outcome = driver.run(scenario.ticks - after_faults);
  cluster.outlast_faults();
  if (outcome.ok()) outcome = cluster.failure();
  if (outcome.ok() && after_faults > 0) outcome = cluster.step(after_faults);
  if (!outcome.ok()) return broken(outcome);
  ScenarioReport report;
  report.tick = driver.done() + after_faults;
  if (absl::Status right = check(scenario, cluster, driver.snapshots(), std::move(log), report);
      !right.ok()) {
    return right;
  }
  report.coverage.moves = driver.moves();
  return report;
}

absl::Status ScenarioRunner::check(const Scenario& scenario, SimulatedCluster& cluster,
                                   const std::vector<SnapshotChunks>& snapshots,
                                   std::vector<v1::RecordedInput> log, ScenarioReport& report) {
  const absl::StatusOr<SimulatedCluster::HashAt> hash = cluster.hash();
  if (!hash.ok()) return broken(hash.status());
  report.hash = hash->hash;
  v1::RecordedHash& last = *log.emplace_back().mutable_hash();
  last.set_tick(hash->tick);
  last.set_hash(hash->hash);
  if (hash->tick != report.tick || hash->tick < scenario.ticks) {
    return absl::AbortedError(absl::StrCat("the world is at tick ", hash->tick, ", not ", report.tick));
  }
  const absl::StatusOr<v1::StatusReply> status = cluster.status();
  if (!status.ok()) return broken(status.status());
  report.events = cluster.events();
  const std::vector<v1::StoredInput> stored = cluster.stored_commands();
  std::set<std::pair<std::uint64_t, std::uint64_t>> told;  // some were told twice
  for (const SimulatedCluster::Told& request : cluster.told_commands())
    told.emplace(request.id.session, request.id.number);
  report.coverage = {.faults = cluster.faults(),
                     .disk = cluster.disk_faults(),
                     .packets = cluster.network().counts(),
                     .recoveries = status->recoveries(),
                     .lists = stored.size(),
                     .told = told.size(),
                     .snapshots = snapshots.size(),
                     .joined = status->joined_servers(),
                     .left = status->left_servers()};
  if (absl::Status kept = check_stored(cluster.told_commands(), stored); !kept.ok()) return kept;
  if (absl::Status right = check_snapshots(snapshots, log); !right.ok()) return right;
  // Also those that nobody was told of.
  for (const v1::StoredInput& input : stored) *log.emplace_back().mutable_commands() = input.commands();
  return checker_.check(log);
}

}  // namespace tessera
