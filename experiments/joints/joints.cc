#include "experiments/joints/joints.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "cli/measure/local_world.h"
#include "cli/measure/own_process.h"
#include "cli/measure/positions.h"
#include "cli/measure/stopwatch.h"
#include "experiments/joints/mechanism.h"
#include "experiments/scenes.h"
#include "lpss/observe/mechanics.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera {
namespace mechanisms {
namespace {

constexpr char kTessera[] = "Tessera";
constexpr char kWithBorder[] = "sectors of 4 m";
constexpr double kGapMax = 1e-3;         // m
constexpr double kEnergyGainMax = 0.01;  // of the largest kinetic energy
constexpr double kWholeGapMax = 0.1;     // m
constexpr double kReferenceTime = 1;     // s

// A way to simulate a mechanism.
struct Variant {
  std::string world;
  WorldSettings settings;
  bool is_plain = false;
};

std::vector<Variant> variants_of(const Mechanism& mechanism, const ExperimentOptions& options) {
  WorldSettings settings;
  settings.precision = options.precision;
  settings.sleep_after = 0;
  std::vector<Variant> variants = {{kTessera, settings}};
  const auto add = [&](const std::string& world, const WorldSettings& own, bool is_plain) {
    if (!is_plain || mechanism.in_bullet) variants.push_back({world, own, is_plain});
  };
  add("plain Bullet", settings, true);
  if (mechanism.is_large) return variants;
  WorldSettings small = settings;
  small.sector_size = 4;
  add(kWithBorder, small, false);
  if (options.quick) return variants;
  for (const int substeps : {1, 16}) {
    WorldSettings fixed = settings;
    fixed.substeps = substeps;
    fixed.adapt = false;
    add(absl::StrCat("Tessera with substeps: ", substeps), fixed, false);
  }
  WorldSettings passes = settings;
  passes.solver_iterations = 100;
  add("plain Bullet with 100 passes", passes, true);
  for (const double time_step : {1.0 / 240, 1.0 / 1000}) {
    WorldSettings fine = settings;
    fine.time_step = time_step;
    add(kTessera, fine, false);
    add("plain Bullet", fine, true);
  }
  return variants;
}

absl::StatusOr<std::unique_ptr<LocalWorld>> local_world(const WorldDescription& world, bool is_plain) {
  return is_plain ? in_one_world(world) : in_sectors(world);
}

Tick ticks_in(double seconds, const WorldSettings& settings) {
  return static_cast<Tick>(std::llround(seconds / settings.time_step));
}

Positions positions_of(const WorldDescription& world, const std::vector<BodyRecord>& bodies) {
  return positions_from({world.anchor, Eigen::Vector3d::Zero()}, bodies, world.settings.sector_size);
}

// What a run showed.
struct Course {
  Mechanics start;
  Mechanics end;
  bool whole = true;
  double gap = 0;
  double twist = 0;
  double energy_gain = 0;  // J
  double kinetic = 0;      // J
  double momentum_drift = 0;
  double angular_momentum_drift = 0;
  double way = std::numeric_limits<double>::quiet_NaN();
  std::vector<Sighting> sightings;
  std::vector<double> ticks_us;
  std::string hash;

  void see(const Mechanics& now, bool diverged) {
    gap = std::max(gap, now.gap);
    twist = std::max(twist, now.twist);
    kinetic = std::max(kinetic, now.kinetic);
    energy_gain = std::max(energy_gain, now.energy() - start.energy());
    momentum_drift = std::max(momentum_drift, (now.momentum - start.momentum).norm());
    angular_momentum_drift =
        std::max(angular_momentum_drift, (now.angular_momentum - start.angular_momentum).norm());
    if (diverged || !(gap < kWholeGapMax) || !std::isfinite(now.energy())) whole = false;
    end = now;
  }
};

absl::StatusOr<Course> run(const Mechanism& mechanism, const Variant& variant, const Positions& reference) {
  const WorldDescription world = mechanism.world(variant.settings);
  absl::StatusOr<MechanicsOfWorld> mechanics = MechanicsOfWorld::create(world);
  if (!mechanics.ok()) return mechanics.status();
  const absl::StatusOr<std::unique_ptr<LocalWorld>> made = local_world(world, variant.is_plain);
  if (!made.ok()) return made.status();
  LocalWorld& local = **made;
  const double dt = variant.settings.time_step;
  const double lag = dt / (variant.is_plain ? 1 : variant.settings.substeps) / 2;
  Course course;
  course.start = mechanics->at(local.bodies());
  course.kinetic = course.start.kinetic;
  const Tick ticks = ticks_in(mechanism.seconds, variant.settings);
  for (Tick tick = 1; tick <= ticks; ++tick) {
    const double time = static_cast<double>(tick) * dt;
    std::vector<Command> commands;
    if (mechanism.drive) commands.emplace_back(SetDrives{JointId{1}, {mechanism.drive(time - dt / 2), {}}});
    const std::chrono::nanoseconds before = processor_time();
    local.step(commands);
    course.ticks_us.push_back(microseconds(processor_time() - before));
    const std::vector<BodyRecord> bodies = local.bodies();
    course.see(mechanics->at(bodies, lag), local.diverged() > 0);
    if (mechanism.error) course.sightings.push_back({time, course.end.joints});
    if (!reference.empty() && tick == ticks_in(kReferenceTime, variant.settings))
      course.way = largest_distance(positions_of(world, bodies), reference);
  }
  course.hash = local.hash().to_string();
  return course;
}

// Where a mechanism is after kReferenceTime in small steps of f64. Call in a process without an engine.
absl::StatusOr<Positions> reference_of(const Mechanism& mechanism, bool quick) {
  WorldSettings settings;
  settings.precision = Precision::kFloat64;
  settings.time_step = 1.0 / (quick ? 1920 : 7680);
  settings.substeps = 1;
  settings.adapt = false;
  settings.sleep_after = 0;
  absl::StatusOr<Report> found = in_own_process([&]() -> absl::StatusOr<Report> {
    const WorldDescription world = mechanism.world(settings);
    const absl::StatusOr<std::unique_ptr<LocalWorld>> local = in_sectors(world);
    if (!local.ok()) return local.status();
    (*local)->run(ticks_in(kReferenceTime, settings));
    Report report;
    for (const Eigen::Vector3d& place : positions_of(world, (*local)->bodies()))
      report.table("rows").push_back({{"x", place.x()}, {"y", place.y()}, {"z", place.z()}});
    return report;
  });
  if (!found.ok()) return found.status();
  Positions positions;
  for (const Row& row : found->table("rows"))
    positions.emplace_back(row["x"].get<double>(), row["y"].get<double>(), row["z"].get<double>());
  return positions;
}

// Whether 1, 2 and 4 partitions end every tick alike.
absl::StatusOr<bool> has_same_bits(const WorldDescription& world, Tick ticks) {
  std::vector<std::unique_ptr<PartitionCluster>> clusters;
  for (const std::uint32_t partitions : {1u, 2u, 4u}) {
    absl::StatusOr<std::unique_ptr<PartitionCluster>> cluster = PartitionCluster::create(world, partitions);
    if (!cluster.ok()) return cluster.status();
    clusters.push_back(*std::move(cluster));
  }
  for (Tick tick = 0; tick < ticks; ++tick) {
    for (const auto& cluster : clusters) cluster->step();
    if (clusters[0]->hash() != clusters[1]->hash() || clusters[0]->hash() != clusters[2]->hash())
      return false;
  }
  return true;
}

Row optional(bool measured, double value) { return measured && std::isfinite(value) ? Row(value) : Row(); }

Row row_of(const Mechanism& mechanism, const Variant& variant, const Course& course) {
  const WorldDescription world = mechanism.world(variant.settings);
  Row row = {{"engine", name_of(variant.settings.precision)},
             {"group", mechanism.group},
             {"mechanism", mechanism.name},
             {"world", variant.world},
             {"time_step", variant.settings.time_step},
             {"bodies", world.bodies.size()},
             {"joints", world.joints.size()},
             {"seconds", mechanism.seconds},
             {"whole", course.whole}};
  row["gap_um"] = optional(true, course.gap * 1e6);
  row["twist_urad"] = optional(true, course.twist * 1e6);
  const bool has_energy = mechanism.keeps_energy && course.kinetic > 0;
  row["energy_gain"] = optional(has_energy, course.energy_gain / course.kinetic);
  row["energy_end"] = optional(has_energy, (course.end.energy() - course.start.energy()) / course.kinetic);
  row["momentum_drift"] = optional(mechanism.is_free, course.momentum_drift / course.start.momentum.norm());
  row["angular_momentum_drift"] =
      optional(mechanism.is_free, course.angular_momentum_drift / course.start.angular_momentum.norm());
  row["way_m"] = optional(true, course.way);
  row["error"] = mechanism.error ? optional(true, mechanism.error(course.sightings)) : Row();
  row["error_is"] = mechanism.error_is;
  row["tick_us"] = median(course.ticks_us);
  row["same_bits"] = Row();
  row["hash"] = course.hash;
  return row;
}

void add_misses(const Row& row, std::vector<std::string>& misses) {
  const auto miss = [&](const std::string& what) {
    misses.push_back(absl::StrCat(row["engine"].get<std::string>(), ", ", row["mechanism"].get<std::string>(),
                                  ": ", what));
  };
  if (row["same_bits"].is_boolean() && !row["same_bits"].get<bool>())
    miss("other bits with 2 or 4 partitions");
  if (row["world"] != kTessera || row["time_step"] != WorldSettings().time_step) return;
  if (!row["whole"].get<bool>()) miss("comes apart");
  if (!row["gap_um"].is_number() || row["gap_um"].get<double>() > kGapMax * 1e6)
    miss(absl::StrCat("a gap of ", row["gap_um"].dump(), " um, more than 1 mm"));
  if (row["energy_gain"].is_number() && row["energy_gain"].get<double>() > kEnergyGainMax)
    miss(absl::StrFormat("gains %.1f %% of the energy that moves", 100 * row["energy_gain"].get<double>()));
}

absl::StatusOr<Report> measure(const Mechanism& mechanism, const ExperimentOptions& options) {
  Positions reference;
  if (mechanism.has_reference) {
    absl::StatusOr<Positions> found = reference_of(mechanism, options.quick);
    if (!found.ok()) return found.status();
    reference = *std::move(found);
  }
  return in_own_process([&]() -> absl::StatusOr<Report> {
    Report report;
    for (const Variant& variant : variants_of(mechanism, options)) {
      const absl::StatusOr<Course> course = run(mechanism, variant, reference);
      if (!course.ok()) return course.status();
      Row row = row_of(mechanism, variant, *course);
      if (variant.world == kWithBorder) {
        const double seconds = options.quick ? 0.5 : 2;
        const absl::StatusOr<bool> same =
            has_same_bits(mechanism.world(variant.settings), ticks_in(seconds, variant.settings));
        if (!same.ok()) return same.status();
        row["same_bits"] = *same;
      }
      add_misses(row, report.misses);
      report.table("rows").push_back(std::move(row));
    }
    return report;
  });
}

}  // namespace
}  // namespace mechanisms

absl::StatusOr<Report> measure_joints(const ExperimentOptions& options, const Progress& progress) {
  std::vector<mechanisms::Mechanism> all = mechanisms::all_mechanisms();
  if (options.quick)
    std::erase_if(all, [](const mechanisms::Mechanism& mechanism) { return mechanism.is_large; });
  if (absl::Status status = choose(options.only, all); !status.ok()) return status;
  return measure_each(all, progress, [&](const mechanisms::Mechanism& mechanism) {
    return mechanisms::measure(mechanism, options);
  });
}

}  // namespace tessera
