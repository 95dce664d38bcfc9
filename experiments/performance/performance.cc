#include "experiments/performance/performance.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "cli/measure/stopwatch.h"
#include "experiments/performance/scenes.h"
#include "lpss/observe/state.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/partition_cluster.h"
#include "lpss/simulation/plain_world.h"

namespace tessera {
namespace {

constexpr double kSector = 16;      // m
constexpr double kOneSector = 512;  // m: all of a scene is in it

struct Scene {
  std::string name;
  std::function<WorldDescription(const WorldSettings&)> make;
  bool sleeps = false;
  Tick ticks = 0;
};

std::vector<Scene> scenes(bool quick) {
  const int share = quick ? 16 : 1;
  const auto boxes = [share](const WorldSettings& s) { return dropped_boxes(s, 8192 / share); };
  const auto stacks = [share](const WorldSettings& s) { return towers_of_ten(s, 800 / share); };
  const auto rows = [quick](const WorldSettings& s) { return pyramid_world(s, quick ? 10 : 30); };
  const Tick ticks = quick ? 60 : 200;
  const Tick ten_seconds = quick ? 120 : 600;
  return {{"pile", boxes, false, ticks},
          {"pile_to_rest", boxes, true, ten_seconds},
          {"towers", stacks, false, ticks},
          {"pyramid", rows, false, ten_seconds}};
}

// A world in sectors, or a plain one.
class Runner {
 public:
  static absl::StatusOr<Runner> create(std::string name, const WorldDescription& world, Precision precision,
                                       bool is_plain) {
    Runner runner;
    runner.name_ = std::move(name);
    runner.sector_size_ = world.settings.sector_size;
    runner.anchor_ = world.anchor;
    if (is_plain) {
      absl::StatusOr<std::unique_ptr<PlainWorld>> plain = PlainWorld::create(world, precision);
      if (!plain.ok()) return plain.status();
      runner.plain_ = *std::move(plain);
    } else {
      absl::StatusOr<std::unique_ptr<PartitionCluster>> cluster =
          PartitionCluster::create(world, /*partitions=*/1, /*threads=*/1);
      if (!cluster.ok()) return cluster.status();
      runner.cluster_ = *std::move(cluster);
    }
    runner.start_ = runner.places();
    return runner;
  }

  void step() {
    const std::chrono::nanoseconds start = processor_time();
    if (plain_) {
      plain_->step();
    } else {
      cluster_->step();
    }
    spent_us_ += microseconds(processor_time() - start);
  }

  double spent_us() const { return spent_us_; }

  Row row(Tick ticks) const {
    const std::vector<Eigen::Vector3d> now = places();
    double drift = 0;
    for (std::size_t n = 0; n < now.size(); ++n) {
      drift = std::max(drift, (now[n] - start_[n]).head<2>().norm());
    }
    return {{"world", name_},   {"bodies", now.size()},
            {"ticks", ticks},   {"tick_us", spent_us_ / static_cast<double>(ticks)},
            {"drift_m", drift}, {"hash", (plain_ ? plain_->hash() : cluster_->hash()).to_string()}};
  }

 private:
  // m, from the anchor's centre; ascending by id.
  std::vector<Eigen::Vector3d> places() const {
    std::vector<std::pair<BodyId, Eigen::Vector3d>> found;
    const auto add = [&](const BodyRecord& record) {
      found.emplace_back(record.id, metres_between(anchor_, record.home, sector_size_) +
                                        Eigen::Vector3d(record.state.position.data()));
    };
    if (plain_) {
      plain_->for_each_body(add);
    } else {
      for_each_body(cluster_->partition(0), add);
    }
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Eigen::Vector3d> places;
    for (const auto& [id, place] : found) places.push_back(place);
    return places;
  }

  std::string name_;
  double sector_size_ = 0;
  SectorIndex anchor_;
  std::unique_ptr<PlainWorld> plain_;
  std::unique_ptr<PartitionCluster> cluster_;
  std::vector<Eigen::Vector3d> start_;
  double spent_us_ = 0;
};

absl::StatusOr<std::vector<Runner>> runners_of(const Scene& scene, Precision precision) {
  std::vector<Runner> runners;
  const auto add = [&](const std::string& name, double sector_size, bool is_plain) {
    WorldSettings settings;
    settings.precision = precision;
    settings.sector_size = sector_size;
    if (!scene.sleeps) settings.sleep_after = 0;
    absl::StatusOr<Runner> runner = Runner::create(name, scene.make(settings), precision, is_plain);
    if (!runner.ok()) return runner.status();
    runners.push_back(*std::move(runner));
    return absl::OkStatus();
  };
  if (absl::Status status = add("sectors of 16 m", kSector, false); !status.ok()) return status;
  if (absl::Status status = add("one sector", kOneSector, false); !status.ok()) return status;
  if (absl::Status status = add("plain Bullet", kOneSector, true); !status.ok()) return status;
  return runners;
}

}  // namespace

absl::StatusOr<Report> measure_performance(const ExperimentOptions& options, const Progress& progress) {
  const std::vector<Scene> all = scenes(options.quick);
  Tick total = 0;
  for (const Scene& scene : all) total += scene.ticks;
  ProgressCount count(progress, total);
  Report report;
  for (const Scene& scene : all) {
    absl::StatusOr<std::vector<Runner>> runners = runners_of(scene, options.precision);
    if (!runners.ok()) return runners.status();
    for (Tick tick = 0; tick < scene.ticks; ++tick) {
      for (Runner& runner : *runners) runner.step();
      if (absl::Status status = count.advance(); !status.ok()) return status;
    }
    const double plain_us = runners->back().spent_us();
    for (const Runner& runner : *runners) {
      Row row = {{"engine", name_of(options.precision)}, {"scene", scene.name}};
      row.update(runner.row(scene.ticks));
      row["ratio"] = runner.spent_us() / plain_us;
      report.table("rows").push_back(std::move(row));
    }
  }
  return report;
}

}  // namespace tessera
