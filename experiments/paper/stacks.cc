#include "experiments/paper/stacks.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "cli/measure/local_world.h"
#include "cli/measure/positions.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr int kBoxes = 10;
constexpr double kStandingMax = 0.5;  // m
constexpr Tick kStandingTicks = 600;

struct Place {
  const char* name;
  int log2;  // of the distance in m
  bool at_origin = false;
};

constexpr int kSectorLog2 = 7;  // of 128 m
constexpr Place kPlaces[] = {
    {"origin", 0, true}, {"2^24 m", 24}, {"2^40 m", 40}, {"2^53 m", 53}, {"2^62 sectors", 62 + kSectorLog2}};

class StackMeasurement {
 public:
  StackMeasurement(const ExperimentOptions& options, const Progress& progress)
      : options_(options),
        progress_(progress, 2 * std::size(kPlaces), report_),
        engine_(name_of(options.precision)) {}

  absl::StatusOr<Report> measure() {
    for (const bool sectored : {false, true}) {
      for (const Place& place : kPlaces) {
        if (absl::Status status = measure(sectored, place); !status.ok()) return status;
        if (absl::Status status = progress_.advance(); !status.ok()) return status;
      }
    }
    return std::move(report_);
  }

 private:
  absl::Status measure(bool sectored, const Place& place) {
    WorldSettings settings;
    settings.precision = options_.precision;
    settings.sector_size = std::ldexp(1, kSectorLog2);
    WorldDescription world = tower_world(settings, kBoxes, Eigen::Vector3d::Zero());
    const std::int64_t sectors = place.at_origin ? 0 : std::int64_t{1} << (place.log2 - kSectorLog2);
    if (absl::Status status = move_by(world, {sectors, sectors, sectors}); !status.ok()) return status;
    const SectorIndex foot = world.anchor;
    // In sectors the place of the anchor does not matter; one world has its origin there.
    if (!sectored) world.anchor = {};
    const absl::StatusOr<std::unique_ptr<LocalWorld>> local =
        sectored ? in_sectors(world) : in_one_world(world);
    if (!local.ok()) return local.status();
    (*local)->run(kStandingTicks);
    const absl::StatusOr<std::vector<BodyRecord>> start = records_of(world);
    if (!start.ok()) return start.status();
    add(sectored, place, foot, *start, **local);
    return absl::OkStatus();
  }

  void add(bool sectored, const Place& place, const SectorIndex& foot,
           const std::vector<BodyRecord>& all_at_start, const LocalWorld& world) {
    const double size = std::ldexp(1, kSectorLog2);
    std::vector<BodyRecord> start;
    for (const BodyRecord& record : all_at_start) {
      if (record.properties.motion == Motion::kDynamic) start.push_back(record);
    }
    const std::vector<BodyRecord> end = world.bodies();
    const WorldHash hash = world.hash();
    const WorldPosition origin{foot, Eigen::Vector3d::Zero()};
    const std::vector<Eigen::Vector3d> positions = positions_from(origin, end, size);
    const double moved = largest_distance(positions, positions_from(origin, start, size));
    double top = -std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& position : positions) top = std::max(top, position.z());
    if (sectored && place.at_origin) reference_hash_ = hash;
    const char* system = sectored ? "lpss" : "one-world";
    const bool stands = std::isfinite(moved) && moved < kStandingMax;
    Row row = {{"system", system}, {"engine", engine_}, {"place", place.name}};
    row["distance_m"] = place.at_origin ? 0 : std::ldexp(1, place.log2);
    row["top_m"] = std::isfinite(moved) ? Row(top) : Row();
    row["moved_max_m"] = std::isfinite(moved) ? Row(moved) : Row();
    row["stands"] = stands;
    row["same_bits"] = sectored && hash == reference_hash_;
    report_.table("rows").push_back(std::move(row));
    if (sectored && hash != reference_hash_) {
      report_.misses.push_back(absl::StrCat(engine_, ": different bits at ", place.name));
    }
    for (std::size_t box = 0; box < end.size(); ++box) {
      add_edges(system, place, box, positions[box], end[box].state);
    }
  }

  // The twelve edges of a box of 1 m.
  void add_edges(const char* system, const Place& place, std::size_t box, const Eigen::Vector3d& position,
                 const BodyState& state) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(state.rotation.data());
    for (int axis = 0; axis < 3; ++axis) {
      for (const double across : {-0.5, 0.5}) {
        for (const double along : {-0.5, 0.5}) {
          for (const double end : {-0.5, 0.5}) {
            Eigen::Vector3d corner;
            corner[axis] = end;
            corner[(axis + 1) % 3] = across;
            corner[(axis + 2) % 3] = along;
            const Eigen::Vector3d at = position + rotation * corner;
            report_.table("edges").push_back({{"system", system},
                                              {"engine", engine_},
                                              {"place", place.name},
                                              {"box", box},
                                              {"x", at.x()},
                                              {"z", at.z()}});
          }
        }
      }
    }
  }

  const ExperimentOptions& options_;
  ProgressCount progress_;
  const char* engine_;
  WorldHash reference_hash_;
  Report report_;
};

}  // namespace

absl::StatusOr<Report> measure_stacks(const ExperimentOptions& options, const Progress& progress) {
  return StackMeasurement(options, progress).measure();
}

}  // namespace tessera
