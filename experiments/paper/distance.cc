#include "experiments/paper/distance.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "cli/measure/local_world.h"
#include "cli/measure/positions.h"
#include "experiments/paper/small_scenes.h"

namespace tessera {
namespace {

constexpr double kOneWorldSectorSize = 128;  // m, in the description of the world, which ignores it
constexpr int kNearest = 7;                  // 2^7 m
constexpr int kFarthest = 62;                // 2^62 m in one world; in sectors, 2^62 of them
constexpr int kStepsInside = 64;             // per sector
constexpr double kSceneExtent = 2.57;        // m: how far the balls get from the scene's origin
constexpr int kSectorsInside = 3;
constexpr Tick kTicks = 60;

// m. Single precision has a limit of 788 m.
std::vector<double> sector_sizes(Precision precision) {
  return {128, precision == Precision::kFloat32 ? 512.0 : 1024.0};
}

struct End {
  std::vector<Eigen::Vector3d> positions;  // m, from the scene's origin
  WorldHash hash;
};

// Runs at different places, compared with the one at the origin.
class DistanceMeasurement {
 public:
  DistanceMeasurement(const ExperimentOptions& options, const Progress& progress)
      : options_(options),
        sector_sizes_(sector_sizes(options.precision)),
        progress_(progress, sector_sizes_.size() + 3, report_),
        engine_(name_of(options.precision)) {}

  absl::StatusOr<Report> measure() {
    absl::Status status = absl::OkStatus();
    for (const double size : sector_sizes_) {
      if (status.ok()) status = measure_sectors(size);
    }
    if (status.ok()) status = measure_one_world();
    if (status.ok()) status = measure_shifted_origin(1);
    if (status.ok()) status = measure_shifted_origin(2);
    if (!status.ok()) return status;
    judge_inside();
    return std::move(report_);
  }

 private:
  WorldDescription scene(double sector_size) const {
    WorldSettings settings;
    settings.precision = options_.precision;
    settings.sector_size = sector_size;
    return collision_scene(settings);
  }

  static absl::StatusOr<End> run(const absl::StatusOr<std::unique_ptr<LocalWorld>>& world, double sector_size,
                                 const WorldPosition& origin) {
    if (!world.ok()) return world.status();
    (*world)->run(kTicks);
    return End{positions_from(origin, (*world)->bodies(), sector_size), (*world)->hash()};
  }

  // Moved with its anchor by whole sectors, so that nothing is rounded.
  absl::StatusOr<End> run_at_sector(double sector_size, const SectorOffset& offset) const {
    WorldDescription world = scene(sector_size);
    if (absl::Status status = move_by(world, offset); !status.ok()) return status;
    return run(in_sectors(world), sector_size, {world.anchor, Eigen::Vector3d::Zero()});
  }

  absl::StatusOr<End> run_at(double sector_size, double distance) const {
    WorldDescription world = scene(sector_size);
    const absl::StatusOr<WorldPosition> origin = canonical({}, {distance, 0, 0}, sector_size);
    if (!origin.ok()) return origin.status();
    if (absl::Status status = move_to(world, *origin); !status.ok()) return status;
    return run(in_sectors(world), sector_size, *origin);
  }

  // One world with its origin `distance` m from that of the scene.
  absl::StatusOr<End> run_plain_at(double distance, bool with_scene_at_origin = false) const {
    WorldDescription world = scene(kOneWorldSectorSize);
    const std::size_t bodies = world.bodies.size();
    const absl::StatusOr<WorldPosition> origin = canonical({}, {distance, 0, 0}, kOneWorldSectorSize);
    if (!origin.ok()) return origin.status();
    if (absl::Status status = move_to(world, *origin); !status.ok()) return status;
    if (with_scene_at_origin) {
      for (BodyDescription body : scene(kOneWorldSectorSize).bodies) {
        body.name += " of another observer";
        world.bodies.push_back(std::move(body));
      }
    }
    absl::StatusOr<End> end = run(in_one_world(world), kOneWorldSectorSize, *origin);
    if (end.ok()) end->positions.resize(bodies);
    return end;
  }

  absl::Status measure_sectors(double size) {
    const absl::StatusOr<End> reference = run_at_sector(size, {});
    if (!reference.ok()) return reference.status();
    add("lpss", size, 1, std::nullopt, true, *reference, *reference);
    const int log2_size = std::ilogb(size);
    for (int log2 = kNearest; log2 <= kFarthest + log2_size; ++log2) {
      const bool whole = log2 >= log2_size;
      const absl::StatusOr<End> end = whole
                                          ? run_at_sector(size, {std::int64_t{1} << (log2 - log2_size), 0, 0})
                                          : run_at(size, std::ldexp(1, log2));
      if (!end.ok()) return end.status();
      add("lpss", size, 1, log2, whole, *end, *reference);
    }
    for (int step = 0; step <= kStepsInside * kSectorsInside; ++step) {
      const double distance = step * size / kStepsInside;
      const absl::StatusOr<End> end = run_at(size, distance);
      if (!end.ok()) return end.status();
      add_inside("lpss", size, distance, largest_distance(end->positions, reference->positions));
    }
    return progress_.advance();
  }

  absl::Status measure_one_world() {
    const absl::StatusOr<End> reference = run_plain_at(0);
    if (!reference.ok()) return reference.status();
    add("one-world", std::nullopt, 1, std::nullopt, true, *reference, *reference);
    for (int log2 = kNearest; log2 <= kFarthest; ++log2) {
      const absl::StatusOr<End> end = run_plain_at(std::ldexp(1, log2));
      if (!end.ok()) return end.status();
      add("one-world", std::nullopt, 1, log2, false, *end, *reference);
    }
    for (const double size : sector_sizes_) {
      for (int step = 0; step <= kStepsInside * kSectorsInside; ++step) {
        const double distance = step * size / kStepsInside;
        const absl::StatusOr<End> end = run_plain_at(distance);
        if (!end.ok()) return end.status();
        add_inside("one-world", size, distance, largest_distance(end->positions, reference->positions));
      }
    }
    return progress_.advance();
  }

  // One world whose origin followed the scene's observer.
  absl::StatusOr<End> run_plain_with_observer(double distance) const {
    WorldDescription world = scene(kOneWorldSectorSize);
    const absl::StatusOr<SectorOffset> offset = sectors_from({distance, 0, 0}, kOneWorldSectorSize);
    if (!offset.ok()) return offset.status();
    if (absl::Status status = move_by(world, *offset); !status.ok()) return status;
    return run(in_one_world(world), kOneWorldSectorSize, {world.anchor, Eigen::Vector3d::Zero()});
  }

  absl::Status measure_shifted_origin(int observers) {
    const absl::StatusOr<End> reference = run_plain_at(0);
    if (!reference.ok()) return reference.status();
    for (int log2 = kNearest; log2 <= kFarthest; ++log2) {
      const double distance = std::ldexp(1, log2);
      const absl::StatusOr<End> end =
          observers == 1 ? run_plain_with_observer(distance) : run_plain_at(distance, true);
      if (!end.ok()) return end.status();
      add("origin-shift", std::nullopt, observers, log2, false, *end, *reference);
    }
    return progress_.advance();
  }

  void add(const char* system, std::optional<double> sector_size, int observers, std::optional<int> log2,
           bool whole, const End& end, const End& reference) {
    const double error = largest_distance(end.positions, reference.positions);
    // The hash of one world depends on where the scene is in it.
    const bool same_bits = error == 0 && (!sector_size || end.hash == reference.hash);
    Row row = {{"system", system}, {"engine", engine_}};
    row["sector_size"] = sector_size ? Row(*sector_size) : Row();
    row["observers"] = observers;
    row["distance_log2"] = log2 ? Row(*log2) : Row();
    row["distance_m"] = log2 ? std::ldexp(1, *log2) : 0.0;
    row["whole_sectors"] = whole;
    row["error_m"] = std::isfinite(error) ? Row(error) : Row();
    row["same_bits"] = same_bits;
    report_.table("rows").push_back(std::move(row));
    if (sector_size && whole && !same_bits) {
      report_.misses.push_back(absl::StrFormat("%s, sectors of %g m: different bits at 2^%d m, error %g m",
                                               engine_, *sector_size, log2.value_or(0), error));
    }
  }

  void add_inside(const char* system, double sector_size, double distance, double error) {
    report_.table("inside").push_back({{"system", system},
                                       {"engine", engine_},
                                       {"sector_size", sector_size},
                                       {"distance_m", distance},
                                       {"error_m", error}});
  }

  double worst_inside(const std::string& system, double sector_size, double farthest) {
    double worst = 0;
    for (const Row& row : report_.table("inside")) {
      if (row["system"] == system && row["sector_size"] == sector_size && row["distance_m"] <= farthest) {
        worst = std::max(worst, row["error_m"].get<double>());
      }
    }
    return worst;
  }

  void judge_inside() {
    for (const double size : sector_sizes_) {
      const double ours = worst_inside("lpss", size, kSectorsInside * size);
      // The balls of a scene at the corner of a sector reach slightly beyond it.
      const double bound = worst_inside("one-world", size, size / 2 + kSceneExtent);
      if (ours <= bound) continue;
      report_.misses.push_back(
          absl::StrFormat("%s, sectors of %g m: error %g m inside, one world has %g m up to %g m", engine_,
                          size, ours, bound, size / 2));
    }
  }

  const ExperimentOptions& options_;
  std::vector<double> sector_sizes_;
  ProgressCount progress_;
  const char* engine_;
  Report report_;
};

}  // namespace

absl::StatusOr<Report> measure_distance(const ExperimentOptions& options, const Progress& progress) {
  return DistanceMeasurement(options, progress).measure();
}

}  // namespace tessera
