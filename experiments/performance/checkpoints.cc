#include "experiments/performance/checkpoints.h"

#include <absl/strings/str_cat.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/stopwatch.h"
#include "experiments/local_servers.h"
#include "experiments/performance/scenes.h"

namespace tessera {
namespace {

constexpr Tick kTicksOfCall = 25;                         // ticks of a call
constexpr double kIntervals[] = {0, 4, 2, 1, 0.5, 0.25};  // s; 0: none

// One cluster, with a world, that makes checkpoints.
struct Contender {
  double every = 0;  // s
  std::unique_ptr<experiments::LocalServers> servers;
  double wall_ms = 0;
  double coordinator_ms = 0;  // its processor time
  Tick ticks = 0;
  std::uint64_t checkpoints = 0;
  Tick last_checkpoint = 0;

  absl::Status step(Tick count) {
    const Stopwatch watch;
    const double before_us = servers->coordinator_us();
    for (Tick tick = 0; tick < count; tick += kTicksOfCall) {
      if (auto done = servers->client().step(kTicksOfCall); !done.ok()) return done.status();
      const absl::StatusOr<ClusterStatus> status = servers->client().status();
      if (!status.ok()) return status.status();
      checkpoints += status->checkpoint_tick > last_checkpoint ? 1 : 0;
      last_checkpoint = status->checkpoint_tick;
    }
    wall_ms += watch.microseconds() / 1000;
    coordinator_ms += (servers->coordinator_us() - before_us) / 1000;
    ticks += count;
    return absl::OkStatus();
  }
};

// The pile falls asleep; balls go on.
WorldDescription resting(const WorldSettings& settings, int boxes, int balls) {
  WorldDescription world = dropped_boxes(settings, boxes);
  world.settings.sleep_after = 0.5;
  world.shapes.push_back(Shape{{ShapePart{Sphere{0.5}, {}}}});
  constexpr int kInRow = 25;
  for (int n = 0; n < balls; ++n) {
    BodyDescription ball;
    ball.name = absl::StrCat("ball", n);
    ball.properties.shape = static_cast<ShapeId>(world.shapes.size() - 1);
    ball.properties.inertia = {0.1, 0.1, 0.1};
    const int column = n % kInRow;
    const int row = n / kInRow;
    ball.pose.position = {{}, {300 + 3.5 * column, 3.5 * row, 0.5}};
    ball.linear_velocity = {0.1, 0, 0};
    world.bodies.push_back(std::move(ball));
  }
  return world;
}

class CheckpointPrice {
 public:
  CheckpointPrice(const ExperimentOptions& options, const Progress& progress)
      : options_(options), rounds_(options.quick ? 1 : 3), count_(progress, 0, report_) {}

  absl::StatusOr<Report> measure() {
    WorldSettings settings;
    settings.precision = options_.precision;
    const int boxes = options_.quick ? 512 : 8192;
    count_.expect(2 * rounds_ * std::size(kIntervals));
    for (const double every : kIntervals) {
      auto started = experiments::LocalServers::start(2, options_.precision, absl::Seconds(every));
      if (!started.ok()) return started.status();
      contenders_.push_back({every, *std::move(started)});
    }
    WorldSettings awake = settings;
    awake.sleep_after = 0;
    if (absl::Status status = measure("pile", dropped_boxes(awake, boxes), 0, options_.quick ? 50 : 400);
        !status.ok())
      return status;
    // Until the pile sleeps, and is packed.
    const Tick before = options_.quick ? 100 : 1000;
    if (absl::Status status =
            measure("resting", resting(settings, boxes, boxes / 16), before, options_.quick ? 100 : 3000);
        !status.ok())
      return status;
    return std::move(report_);
  }

 private:
  // After `before` ticks, each contender is stepped for `stretch` at a time.
  absl::Status measure(const std::string& scene, const WorldDescription& world, Tick before, Tick stretch) {
    for (Contender& contender : contenders_) {
      Client& client = contender.servers->client();
      if (auto loaded = client.load(world, /*replace=*/true); !loaded.ok()) return loaded.status();
      if (before > 0) {
        if (auto done = client.step(before); !done.ok()) return done.status();
      }
      contender.wall_ms = contender.coordinator_ms = 0;
      contender.ticks = contender.checkpoints = contender.last_checkpoint = 0;
    }
    for (int round = 0; round < rounds_; ++round) {
      for (Contender& contender : contenders_) {
        if (absl::Status status = contender.step(stretch); !status.ok()) return status;
        if (absl::Status status = count_.advance(); !status.ok()) return status;
      }
    }
    return report(scene);
  }

  absl::Status report(const std::string& scene) {
    const absl::StatusOr<double> bytes = snapshot_bytes();
    if (!bytes.ok()) return bytes.status();
    std::string first;
    const Contender& without = contenders_.front();
    for (Contender& contender : contenders_) {
      const absl::StatusOr<HashAt> hash = contender.servers->client().hash();
      if (!hash.ok()) return hash.status();
      if (first.empty()) first = hash->hash;
      if (hash->hash != first) report_.misses.push_back(absl::StrCat(scene, ": checkpoints change the hash"));
      const absl::StatusOr<ClusterStatus> status = contender.servers->client().status();
      if (!status.ok()) return status.status();
      const double more = contender.wall_ms - without.wall_ms;
      const double coordinators = contender.coordinator_ms - without.coordinator_ms;
      const auto made = static_cast<double>(contender.checkpoints);
      report_.table("rows").push_back(
          {{"engine", name_of(options_.precision)},
           {"scene", scene},
           {"bodies", status->bodies},
           {"every_s", contender.every},
           {"ticks", contender.ticks},
           {"tick_ms", contender.wall_ms / static_cast<double>(contender.ticks)},
           {"checkpoints", contender.checkpoints},
           {"percent", 100 * more / without.wall_ms},
           {"ms_per_checkpoint", contender.checkpoints > 0 ? Row(more / made) : Row()},
           {"coordinator_ms_per_checkpoint", contender.checkpoints > 0 ? Row(coordinators / made) : Row()},
           {"bytes_per_body", *bytes / static_cast<double>(status->bodies)},
           {"same_bits", hash->hash == first},
           {"hash", hash->hash}});
    }
    return absl::OkStatus();
  }

  absl::StatusOr<double> snapshot_bytes() {
    const std::filesystem::path file =
        std::filesystem::temp_directory_path() /
        absl::StrCat("tessera-checkpoints-", contenders_.front().servers->cluster().coordinator());
    if (auto made = contenders_.front().servers->client().snapshot(file); !made.ok()) return made.status();
    std::error_code error;
    const auto size = static_cast<double>(std::filesystem::file_size(file, error));
    std::filesystem::remove(file, error);
    return size;
  }

  const ExperimentOptions& options_;
  const int rounds_;
  ProgressCount count_;
  std::vector<Contender> contenders_;
  Report report_;
};

}  // namespace

absl::StatusOr<Report> measure_checkpoints(const ExperimentOptions& options, const Progress& progress) {
  return CheckpointPrice(options, progress).measure();
}

}  // namespace tessera
