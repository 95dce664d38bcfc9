#include "simulator/scenario.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
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
#include "simulator/driver.h"
#include "simulator/tick_gaps.h"

namespace tessera {
namespace {

constexpr int kEventsMax = 1'000'000;  // while servers join
constexpr std::size_t kSmallShapeBytes = 20'000;
constexpr std::uint64_t kSmallShapesOneIn = 4;

// About the duration of a tick, so that most faults begin while ticks are running.
constexpr std::uint64_t kNsPerTick = 4'000'000;

// After a cut for good: it is found within two seconds, then the ticks since the last checkpoint are
// repeated.
constexpr std::uint64_t kStandstillMaxNs = 3'000'000'000;

// An unexpected error becomes ABORTED; CANCELLED stays.
absl::Status broken(const absl::Status& status) {
  return absl::IsCancelled(status) ? status : absl::AbortedError(status.message());
}

// That each list that was acknowledged was stored, as it was told, and that none was stored twice.
absl::Status check_stored(const std::vector<SimulatedCluster::Told>& told,
                          const std::vector<v1::StoredInput>& stored) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, const v1::RecordedCommands*> all;
  for (const v1::StoredInput& input : stored) {
    if (input.session() == 0) continue;  // the coordinator's own, of joints that programs have removed
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
    const TickHashes hashes = hashes_of(**restored);
    for (const v1::RecordedInput& input : log) {
      if (!input.has_hash() || input.hash().tick() != tick) continue;
      const TickHashes world{input.hash().hash(), input.hash().programs()};
      if (world == hashes) continue;
      return absl::AbortedError(absl::StrCat("a snapshot of tick ", tick, " has the hash ", hashes.world,
                                             " (of programs: ", hashes.programs, "), the world ", world.world,
                                             " (", world.programs, ")"));
    }
  }
  return absl::OkStatus();
}

// Of lasting cuts alone, each stops a world once: until it is found, and the world has gone on without those
// that are cut off.
absl::Status check_standstill(const Scenario& scenario, const TickGaps& gaps) {
  const FaultSchedule faults = faults_of(scenario);
  const auto is_lasting_cut = [](const Fault& fault) { return fault.kind == FaultKind::kLastingCut; };
  if (faults.empty() || !std::ranges::all_of(faults, is_lasting_cut)) return absl::OkStatus();
  const std::uint64_t longest_ns = faults.size() * kStandstillMaxNs;
  if (gaps.longest_ns() <= longest_ns) return absl::OkStatus();
  return absl::AbortedError(absl::StrFormat("there was no tick for %.3f s, and may be none for %.1f s",
                                            static_cast<double>(gaps.longest_ns()) / 1e9,
                                            static_cast<double>(longest_ns) / 1e9));
}

// Of processes; what one process takes for all of a tick, the checker has looked at.
absl::Status check_work(const Scenario& scenario, const SimulatedCluster& cluster, Coverage& coverage) {
  if (scenario.tick_work_ms_max <= 0) return absl::OkStatus();
  const MeasuredWork& server = cluster.server_work();
  const MeasuredWork& coordinator = cluster.coordinator_work();
  coverage.server_ns = static_cast<std::uint64_t>(server.longest.count());
  coverage.coordinator_ns = static_cast<std::uint64_t>(coordinator.longest.count());
  for (const MeasuredWork& work : {server, coordinator}) {
    const double longest_ms = static_cast<double>(work.longest.count()) / 1e6;
    if (longest_ms <= scenario.tick_work_ms_max) continue;
    return absl::AbortedError(
        absl::StrFormat("%s took %.0f ms of processor time at a stretch, and may take %.0f ms; tick %d",
                        work.node == kCoordinatorNode ? "the coordinator" : "a server", longest_ms,
                        scenario.tick_work_ms_max, work.tick));
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

WorldDescription unshuffled(WorldDescription world) {
  world.settings.shuffle = 0;
  return world;
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

std::string text_of_places(const std::vector<std::uint32_t>& places) {
  std::vector<std::string> ranges;
  for (std::size_t first = 0; first < places.size();) {
    std::size_t last = first;
    while (last + 1 < places.size() && places[last + 1] == places[last] + 1) ++last;
    ranges.push_back(last == first ? absl::StrCat(places[first])
                                   : absl::StrCat(places[first], "-", places[last]));
    first = last + 1;
  }
  return ranges.empty() ? "none" : absl::StrJoin(ranges, ",");
}

std::string command_of(const Scenario& scenario, const std::string& world) {
  std::string command =
      absl::StrCat("tessera simulate ", world, world.empty() ? "" : " ", "--seed ", scenario.seed,
                   " --servers ", scenario.servers, " --ticks ", scenario.ticks);
  if (scenario.links) absl::StrAppend(&command, " --links");
  if (scenario.commands > 0) absl::StrAppend(&command, " --commands ", scenario.commands);
  if (scenario.extremes) absl::StrAppend(&command, " --extremes");
  if (scenario.tick_work_ms_max > 0)
    absl::StrAppend(&command, " --tick-work-max ", scenario.tick_work_ms_max);
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    if (scenario.faults[kind] > 0) {
      absl::StrAppend(&command, " --", kFaultNames[kind].option, " ", scenario.faults[kind]);
    }
  }
  if (scenario.only_faults)
    absl::StrAppend(&command, " --only-faults ", text_of_places(*scenario.only_faults));
  if (scenario.only_commands)
    absl::StrAppend(&command, " --only-commands ", text_of_places(*scenario.only_commands));
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
  commands += other.commands;
  queries += other.queries;
  refused += other.refused;
  replaced += other.replaced;
  work_ns = std::max(work_ns, other.work_ns);
  server_ns = std::max(server_ns, other.server_ns);
  coordinator_ns = std::max(coordinator_ns, other.coordinator_ns);
  snapshots += other.snapshots;
  moves += other.moves;
  joined += other.joined;
  left += other.left;
  standstill_ns = std::max(standstill_ns, other.standstill_ns);
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
  if (commands > 0) {
    absl::StrAppend(&text, "clients sent ", commands, " commands and ", queries, " queries; ", refused,
                    " requests were refused; ", replaced, " worlds took the place of others\n");
  }
  if (server_ns > 0) {
    absl::StrAppendFormat(&text,
                          "the longest work: %.1f ms for a tick in one process, %.1f ms on a server, %.1f ms "
                          "of the coordinator\n",
                          static_cast<double>(work_ns) / 1e6, static_cast<double>(server_ns) / 1e6,
                          static_cast<double>(coordinator_ns) / 1e6);
  }
  absl::StrAppendFormat(&text, "the longest time without a tick: %.3f s\n",
                        static_cast<double>(standstill_ns) / 1e9);
  return text;
}

WorldDescription corner_pile() {
  WorldSettings settings;
  settings.sector_size = 8;
  return pile_world(settings, 40);
}

ScenarioRunner::ScenarioRunner(const WorldDescription& world) : world_(world), checker_(unshuffled(world)) {}

absl::StatusOr<ScenarioReport> ScenarioRunner::run(const Scenario& scenario) {
  const bool has_faults = count_of(scenario.faults) > 0;
  std::vector<v1::RecordedInput> hashes;
  TickGaps gaps;
  const SimulatedCluster* running = nullptr;
  SimulatedClusterOptions options;
  if (has_faults || scenario.commands > 0) {
    options.inputs = [&](const v1::RecordedInput& input) {
      if (!input.has_hash()) return;
      hashes.push_back(input);
      gaps.tick(running->network().now_ns());
    };
  }
  options.log = log_;
  if (scenario.links) options.all_linked_max = 1;
  options.takes_all_servers = scenario.faults[static_cast<std::size_t>(FaultKind::kJoin)] > 0 ||
                              scenario.faults[static_cast<std::size_t>(FaultKind::kDrain)] > 0;
  options.measures_work = scenario.tick_work_ms_max > 0;
  if (scenario.extremes && scenario.seed % kSmallShapesOneIn == 0) options.shape_bytes_max = kSmallShapeBytes;
  checker_.set_tick_work_max(
      std::chrono::nanoseconds(static_cast<std::int64_t>(scenario.tick_work_ms_max * 1e6)));
  SimulatedCluster cluster(scenario.seed, scenario.servers, world_.settings.precision, options);
  running = &cluster;
  cluster.end_when(is_ended_);
  if (options.takes_all_servers) {
    if (absl::Status joined = all_have_joined(cluster, scenario.servers); !joined.ok()) return joined;
  }
  if (absl::Status loaded = cluster.load(world_); !loaded.ok()) return loaded;

  cluster.meet(faults_of(scenario));
  // The last tick comes after all faults, so that all their consequences are visible.
  const Tick after_faults = has_faults ? 1 : 0;
  Driver driver(cluster, world_, scenario, gaps, hashes);
  absl::Status outcome = driver.run(scenario.ticks - after_faults);
  cluster.outlast_faults();
  if (outcome.ok()) outcome = cluster.failure();
  if (outcome.ok() && after_faults > 0) outcome = driver.finish(after_faults);
  if (!outcome.ok()) return broken(outcome);
  ScenarioReport report;
  if (absl::Status right = check(scenario, cluster, driver, report); !right.ok()) return right;
  report.coverage.standstill_ns = gaps.longest_ns();
  if (absl::Status stood = check_standstill(scenario, gaps); !stood.ok()) return stood;
  return report;
}

absl::Status ScenarioRunner::check(const Scenario& scenario, SimulatedCluster& cluster, Driver& driver,
                                   ScenarioReport& report) {
  const absl::StatusOr<SimulatedCluster::HashAt> hash = cluster.hash();
  if (!hash.ok()) return broken(hash.status());
  report.hash = hash->hash;
  report.tick = hash->tick;
  if (hash->tick != driver.tick() || driver.done() < scenario.ticks) {
    return absl::AbortedError(absl::StrCat("the world is at tick ", hash->tick, ", not ", driver.tick()));
  }
  const absl::StatusOr<v1::StatusReply> status = cluster.status();
  if (!status.ok()) return broken(status.status());
  report.events = cluster.events();
  Coverage& coverage = report.coverage;
  coverage = {.faults = cluster.faults(),
              .disk = cluster.disk_faults(),
              .packets = cluster.network().counts(),
              .recoveries = status->recoveries(),
              .commands = driver.counts().commands,
              .queries = driver.counts().queries,
              .refused = driver.counts().refused,
              .replaced = driver.replaced(),
              .moves = driver.moves(),
              .joined = status->joined_servers(),
              .left = status->left_servers()};
  std::vector<WorldHistory> histories = driver.take_histories();
  v1::RecordedHash& last = *histories.back().hashes.emplace_back().mutable_hash();
  last.set_tick(hash->tick);
  last.set_hash(hash->hash);
  last.set_programs(hash->programs);
  for (WorldHistory& history : histories) {
    coverage.lists += history.stored.size();
    coverage.snapshots += history.snapshots.size();
    std::set<std::pair<std::uint64_t, std::uint64_t>> told;  // some were told twice
    for (const SimulatedCluster::Told& request : history.told)
      told.emplace(request.id.session, request.id.number);
    coverage.told += told.size();
    if (absl::Status right = check(history); !right.ok()) return right;
  }
  coverage.work_ns = static_cast<std::uint64_t>(checker_.longest_tick().count());
  return check_work(scenario, cluster, coverage);
}

absl::Status ScenarioRunner::check(WorldHistory& history) {
  if (absl::Status kept = check_stored(history.told, history.stored); !kept.ok()) return kept;
  std::vector<v1::RecordedInput> log = std::move(history.hashes);
  if (absl::Status right = check_snapshots(history.snapshots, log); !right.ok()) return right;
  // Also those that nobody was told of.
  for (const v1::StoredInput& input : history.stored)
    *log.emplace_back().mutable_commands() = input.commands();
  return checker_.check(log, history.from ? &*history.from : nullptr);
}

}  // namespace tessera
