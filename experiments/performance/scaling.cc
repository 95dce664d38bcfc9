#include "experiments/performance/scaling.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "cli/measure/stopwatch.h"
#include "experiments/local_servers.h"
#include "experiments/performance/scenes.h"
#include "experiments/scenes.h"
#include "lpss/observe/state.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera {
namespace {

constexpr Tick kStride = 25;  // ticks that a world is stepped in a row
// A map that follows the load is looked at so often, for so many ticks before anything is measured.
constexpr absl::Duration kBalanceEvery = absl::Milliseconds(100);
constexpr Tick kTicksToFollow = 400;

constexpr char kOnThreads[] = "threads";
constexpr char kOnServers[] = "servers";
constexpr char kOnServersThatFollow[] = "servers, map follows";

struct Scene {
  std::string group;  // what there are two of
  std::string name;
  double sector_size;  // m
  std::function<WorldDescription(const WorldSettings&)> make;
};

std::vector<Scene> scenes(bool quick) {
  const int share = quick ? 16 : 1;
  const auto pile = [share](const WorldSettings& s) { return dropped_boxes(s, 8192 / share); };
  const auto towers = [share](const WorldSettings& s) { return towers_of_ten(s, 800 / share); };
  const auto pyramid = [quick](const WorldSettings& s) { return pyramid_world(s, quick ? 15 : 30); };
  std::vector<Scene> all;
  const auto add = [&](const std::string& name, double sector_size, const auto& make) {
    for (const char* group : {kOnThreads, kOnServers, kOnServersThatFollow})
      all.push_back({group, name, sector_size, make});
  };
  add("pile", 16, pile);
  add("pile in one sector", 512, pile);
  add("towers", 16, towers);
  add("pyramid", 8, pyramid);
  for (const double sector_size : {32, 8, 4}) add("pile", sector_size, pile);
  return all;
}

// One of two that are compared.
struct Side {
  std::function<absl::Status()> step;  // kStride ticks
  std::function<absl::StatusOr<std::string>()> hash;
  std::function<absl::StatusOr<double>()> exchanged;  // bytes between servers so far
  double ms = 0;

  absl::Status run() {
    const Stopwatch watch;
    absl::Status status = step();
    ms += watch.microseconds() / 1000;
    return status;
  }
};

absl::StatusOr<Side> on_threads(const WorldDescription& world, int threads) {
  absl::StatusOr<std::unique_ptr<PartitionCluster>> made = PartitionCluster::create(world, 1, threads);
  if (!made.ok()) return made.status();
  const std::shared_ptr<PartitionCluster> cluster = *std::move(made);
  return Side{[cluster] {
                for (Tick tick = 0; tick < kStride; ++tick) cluster->step();
                return absl::OkStatus();
              },
              [cluster] { return cluster->hash().to_string(); }, [] { return 0.0; }};
}

absl::StatusOr<Side> on_servers(const WorldDescription& world, experiments::LocalServers& servers) {
  if (auto loaded = servers.client().load(world, /*replace=*/true); !loaded.ok()) return loaded.status();
  return Side{[&servers] { return servers.client().step(kStride).status(); },
              [&servers]() -> absl::StatusOr<std::string> {
                const absl::StatusOr<HashAt> hash = servers.client().hash();
                if (!hash.ok()) return hash.status();
                return hash->hash;
              },
              [&servers]() -> absl::StatusOr<double> {
                const absl::StatusOr<ClusterStatus> status = servers.client().status();
                if (!status.ok()) return status.status();
                double sum = 0;
                for (const ServerStatus& server : status->servers)
                  sum += static_cast<double>(server.exchange_bytes);
                return sum;
              }};
}

// The same work, once on this thread and once in halves on two.
class Machine {
 public:
  void measure() {
    const Stopwatch alone;
    spin(kRounds);
    alone_us_ += alone.microseconds();
    const Stopwatch shared;
    std::thread other([] { spin(kRounds / 2); });
    spin(kRounds / 2);
    other.join();
    shared_us_ += shared.microseconds();
  }

  // Since the last call.
  double take_speedup() { return std::exchange(alone_us_, 0) / std::exchange(shared_us_, 0); }

 private:
  static constexpr int kRounds = 4'000'000;

  static void spin(int rounds) {
    volatile double x = 1;
    for (int n = 0; n < rounds; ++n) x = x * 1.0000001;
  }

  double alone_us_ = 0;
  double shared_us_ = 0;
};

class Measurement {
 public:
  Measurement(const ExperimentOptions& options, const Progress& progress)
      : options_(options), ticks_(options.quick ? 60 : 150), count_(progress, 0, report_) {}

  absl::StatusOr<Report> measure() {
    std::vector<Scene> all = scenes(options_.quick);
    if (absl::Status status = choose(options_.only, all); !status.ok()) return status;
    for (const Scene& scene : all) count_.expect((ticks_ + ticks_before(scene)) / kStride);
    const bool has_servers = std::ranges::any_of(all, [](const Scene& s) { return s.group != kOnThreads; });
    if (absl::Status status = has_servers ? start_servers() : absl::OkStatus(); !status.ok()) return status;
    for (const Scene& scene : all) {
      if (absl::Status status = measure(scene); !status.ok()) return status;
    }
    return std::move(report_);
  }

 private:
  static Tick ticks_before(const Scene& scene) {
    return scene.group == kOnServersThatFollow ? kTicksToFollow : 0;
  }

  absl::Status start_servers() {
    const std::pair<int, absl::Duration> clusters[] = {
        {1, absl::ZeroDuration()}, {2, absl::ZeroDuration()}, {2, kBalanceEvery}};
    for (const auto& [servers, balance_every] : clusters) {
      auto started = experiments::LocalServers::start(servers, options_.precision, /*checkpoint_every=*/{},
                                                      balance_every);
      if (!started.ok()) return started.status();
      servers_.push_back(*std::move(started));
    }
    return absl::OkStatus();
  }

  absl::Status measure(const Scene& scene) {
    WorldSettings settings;
    settings.precision = options_.precision;
    settings.sector_size = scene.sector_size;
    settings.sleep_after = 0;
    const WorldDescription world = scene.make(settings);
    if (scene.group == kOnThreads) return compare(scene, on_threads(world, 1), on_threads(world, 2));
    const std::size_t two = scene.group == kOnServersThatFollow ? 2 : 1;
    return compare(scene, on_servers(world, *servers_[0]), on_servers(world, *servers_[two]));
  }

  absl::Status compare(const Scene& scene, absl::StatusOr<Side> one, absl::StatusOr<Side> two) {
    if (!one.ok()) return one.status();
    if (!two.ok()) return two.status();
    for (Tick tick = 0; tick < ticks_before(scene); tick += kStride) {
      absl::Status status = one->step();
      if (status.ok()) status = two->step();
      if (status.ok()) status = count_.advance();
      if (!status.ok()) return status;
    }
    const absl::StatusOr<double> exchanged_before = two->exchanged();
    if (!exchanged_before.ok()) return exchanged_before.status();
    for (Tick tick = 0; tick < ticks_; tick += kStride) {
      absl::Status status = one->run();
      if (status.ok()) status = two->run();
      if (status.ok()) status = count_.advance();
      if (!status.ok()) return status;
      machine_.measure();
    }
    const absl::StatusOr<double> exchanged = two->exchanged();
    if (!exchanged.ok()) return exchanged.status();
    const absl::StatusOr<std::string> hash = one->hash();
    if (!hash.ok()) return hash.status();
    const absl::StatusOr<std::string> other = two->hash();
    if (!other.ok()) return other.status();
    const bool same = *hash == *other;
    if (!same) report_.misses.push_back(scene.name + ": two " + scene.group + " end in other bits than one");
    const auto ticks = static_cast<double>(ticks_);
    report_.table("rows").push_back({{"engine", name_of(options_.precision)},
                                     {"scene", scene.name},
                                     {"sector_size", scene.sector_size},
                                     {"what", scene.group},
                                     {"ticks_before", ticks_before(scene)},
                                     {"ticks", ticks_},
                                     {"one_ms", one->ms / ticks},
                                     {"two_ms", two->ms / ticks},
                                     {"speedup", one->ms / two->ms},
                                     {"machine_speedup", machine_.take_speedup()},
                                     {"same_bits", same},
                                     {"kilobytes_per_tick", (*exchanged - *exchanged_before) / 1000 / ticks},
                                     {"hash", *hash}});
    return absl::OkStatus();
  }

  const ExperimentOptions& options_;
  const Tick ticks_;
  ProgressCount count_;
  std::vector<std::unique_ptr<experiments::LocalServers>> servers_;  // one, and two
  Machine machine_;
  Report report_;
};

}  // namespace

absl::StatusOr<Report> measure_scaling(const ExperimentOptions& options, const Progress& progress) {
  return Measurement(options, progress).measure();
}

}  // namespace tessera
