#include "experiments/tradeoff/tradeoff.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "cli/measure/own_process.h"
#include "cli/tune/trial.h"
#include "experiments/paper/small_scenes.h"
#include "experiments/seams/piles.h"
#include "experiments/seams/scene.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

struct Subject {
  std::string name;
  std::function<absl::StatusOr<WorldDescription>(const WorldSettings&)> build;
  double horizon = 1;       // s
  bool is_chaotic = false;  // measured by overlap instead of error
  bool has_joints = false;
};

// A satellite 630 km above a planet: only gravity, which changes slowly.
WorldDescription orbit_scene(const WorldSettings& settings) {
  constexpr double kRadius = 7e6;  // m
  constexpr double kSurface = 9.81;
  constexpr double kPlanetRadius = 6.371e6;
  WorldBuilder builder(settings);
  builder.world().settings.gravity = CentralGravity{{}, kSurface, kPlanetRadius};
  builder.add("satellite", builder.shape(Box{{2, 1, 1}}), 100, {kRadius, 0, 0}).linear_velocity.y() =
      kPlanetRadius * std::sqrt(kSurface / kRadius);
  return builder.world();
}

constexpr double kCoarsestStep = 1.0 / 30;  // s

Moments moments_of(const Subject& subject) { return Moments::within(subject.horizon, kCoarsestStep); }

Subject scene_of(const std::vector<seams::Scene>& scenes, const std::string& wanted, const std::string& name,
                 double horizon, bool has_joints) {
  const auto found =
      std::find_if(scenes.begin(), scenes.end(), [&](const auto& scene) { return scene.name == wanted; });
  Subject subject{name, nullptr, horizon, false, has_joints};
  if (found != scenes.end()) subject.build = found->build;
  return subject;
}

std::vector<Subject> subjects(const ExperimentOptions& options) {
  const double longer = options.quick ? 0.5 : 1;
  const std::vector<seams::Scene> scenes = seams::all_scenes(options.worlds);
  std::vector<Subject> list = {
      {"collision", collision_scene, 1},
      {"stack", [](const WorldSettings& s) { return tower_world(s, 10, Eigen::Vector3d::Zero()); },
       8 * longer},
      {"pile", [](const WorldSettings& s) { return seams::bin_world(s, 200); }, 8 * longer,
       /*is_chaotic=*/true},
      {"chain",
       [](const WorldSettings& s) {
         return chain_world(s, 10, {0, 0, 8});
       },
       1, false, /*has_joints=*/true},
      scene_of(scenes, "diff_drive", "vehicle", 2 * longer, /*has_joints=*/true),
      {"orbit", orbit_scene, 60 * longer},
      scene_of(scenes, "roll_mesh_along", "rolling", 4 * longer, /*has_joints=*/false)};
  std::erase_if(list, [](const Subject& subject) { return !subject.build; });
  return list;
}

struct Setting {
  std::string knob;  // "default", "grid", or the setting that is changed
  std::string value;
  Knobs knobs;
};

void turn(std::vector<Setting>& list, const std::string& knob, const std::vector<double>& values,
          const std::function<void(Knobs&, double)>& set) {
  for (const double value : values) {
    Setting setting{knob, absl::StrFormat("%g", value), {}};
    set(setting.knobs, value);
    list.push_back(std::move(setting));
  }
}

std::vector<Setting> single_knobs() {
  std::vector<Setting> list = {{"default", "", {}}};
  turn(list, "time_step", {kCoarsestStep, 1.0 / 120, 1.0 / 240},
       [](Knobs& k, double v) { k.set(&WorldSettings::time_step, v); });
  turn(list, "substeps", {1, 2, 8},
       [](Knobs& k, double v) { k.set(&WorldSettings::substeps, static_cast<int>(v)); });
  turn(list, "adapt", {0}, [](Knobs& k, double v) { k.set(&WorldSettings::adapt, v != 0); });
  turn(list, "solver_iterations", {4, 8, 24, 48},
       [](Knobs& k, double v) { k.set(&WorldSettings::solver_iterations, static_cast<int>(v)); });
  turn(list, "continuous_collision", {0},
       [](Knobs& k, double v) { k.set(&WorldSettings::continuous_collision, v != 0); });
  turn(list, "sector_size", {16, 64, 512}, [](Knobs& k, double v) { k.set(&WorldSettings::sector_size, v); });
  turn(list, "sleep_after", {0, 0.25}, [](Knobs& k, double v) { k.set(&WorldSettings::sleep_after, v); });
  turn(list, "clone_depth", {1, 4}, [](Knobs& k, double v) {
    k.set(&WorldSettings::seams, SeamPolicy::kClone);
    k.set(&WorldSettings::clone_depth, static_cast<int>(v));
  });
  // For Bullet's own solver only.
  turn(list, "friction_in_two_directions", {0}, [](Knobs& k, double v) {
    k.set(&WorldSettings::seams, SeamPolicy::kClone);
    k.set(&WorldSettings::friction_in_two_directions, v != 0);
  });
  turn(list, "warm_starting", {0, 0.85, 1}, [](Knobs& k, double v) {
    k.set(&WorldSettings::seams, SeamPolicy::kClone);
    k.set(&WorldSettings::warm_starting, v);
  });
  turn(list, "split_from", {0, 1e6}, [](Knobs& k, double v) {
    k.set(&WorldSettings::seams, SeamPolicy::kClone);
    k.set(&WorldSettings::split_from, v);
  });
  return list;
}

void add_grid(std::vector<Setting>& list, bool quick) {
  const std::vector<double> steps = quick
                                        ? std::vector<double>{1.0 / 60, 1.0 / 120}
                                        : std::vector<double>{kCoarsestStep, 1.0 / 60, 1.0 / 120, 1.0 / 240};
  constexpr std::pair<int, int> kPasses[] = {{1, 4},  {1, 10}, {1, 30}, {1, 100}, {2, 4},
                                             {2, 12}, {4, 12}, {4, 32}, {8, 24},  {8, 64}};
  for (const double step : steps) {
    for (const auto& [substeps, iterations] : kPasses) {
      Setting setting{"grid", absl::StrFormat("%g s %d steps %d passes", step, substeps, iterations), {}};
      setting.knobs.set(&WorldSettings::time_step, step);
      setting.knobs.set(&WorldSettings::substeps, substeps);
      setting.knobs.set(&WorldSettings::solver_iterations, iterations);
      list.push_back(std::move(setting));
    }
  }
}

class Tradeoff {
 public:
  Tradeoff(const ExperimentOptions& options, const Progress& progress)
      : options_(options),
        progress_(progress, 0, report_),
        subjects_(subjects(options)),
        settings_(single_knobs()) {
    add_grid(settings_, options.quick);
    progress_.expect(subjects_.size() * (settings_.size() + 2));
  }

  absl::StatusOr<Report> measure() {
    // Before this process has loaded the engine for the requested precision.
    absl::StatusOr<Report> references = in_own_process([this] { return measure_references(); });
    if (!references.ok()) return references.status();
    progress_.skip(2 * subjects_.size());
    report_.table("rows");
    report_.table("prices");
    report_.table("trust") = references->table("trust");
    for (const Subject& subject : subjects_) {
      const std::vector<Positions> reference = samples_from(references->table(subject.name));
      if (absl::Status status = measure(subject, reference); !status.ok()) return status;
    }
    mark_front(report_.table("rows"), {"scene"});
    if (options_.worlds.empty()) report_.misses.push_back("the vehicle needs $TESSERA_WORLDS");
    return std::move(report_);
  }

 private:
  absl::StatusOr<WorldDescription> world_of(const Subject& subject, const Knobs& knobs) const {
    WorldSettings settings;
    settings.precision = options_.precision;
    absl::StatusOr<WorldDescription> world = subject.build(settings);
    if (!world.ok()) return world.status();
    return with_knobs(*world, knobs);
  }

  absl::StatusOr<Trial> run_with(const Subject& subject, const Knobs& knobs) {
    const absl::StatusOr<WorldDescription> world = world_of(subject, knobs);
    if (!world.ok()) return world.status();
    absl::StatusOr<Trial> trial = run_trial(*world, moments_of(subject));
    if (!trial.ok()) return trial.status();
    if (absl::Status status = progress_.advance(); !status.ok()) return status;
    return trial;
  }

  absl::StatusOr<Report> measure_references() {
    Report report;
    for (const Subject& subject : subjects_) {
      const absl::StatusOr<Trial> fine =
          run_with(subject, reference_knobs(WorldSettings(), /*coarser=*/false));
      if (!fine.ok()) return fine.status();
      const absl::StatusOr<Trial> coarse =
          run_with(subject, reference_knobs(WorldSettings(), /*coarser=*/true));
      if (!coarse.ok()) return coarse.status();
      report.table(subject.name) = to_rows(fine->samples);
      report.table("trust").push_back(
          {{"scene", subject.name}, {"reference_error_m", error_between(fine->samples, coarse->samples)}});
    }
    return report;
  }

  // The cost of plain Bullet at this time step, with ten passes of its own solver.
  absl::StatusOr<double> plain_cost(const Subject& subject, const Knobs& knobs) const {
    Knobs plain;
    if (const auto step = knobs.get(&WorldSettings::time_step)) plain.set(&WorldSettings::time_step, *step);
    plain.set(&WorldSettings::solver_iterations, 10);
    const absl::StatusOr<WorldDescription> world = world_of(subject, plain);
    if (!world.ok()) return world.status();
    const absl::StatusOr<Trial> trial = run_trial(*world, moments_of(subject), /*is_plain=*/true);
    if (!trial.ok()) return trial.status();
    return trial->cost_us;
  }

  absl::Status measure(const Subject& subject, const std::vector<Positions>& reference) {
    Row base;
    for (const Setting& setting : settings_) {
      const absl::StatusOr<Trial> trial = run_with(subject, setting.knobs);
      // A sector may be too small for a body, or too large for the precision: such settings are skipped.
      if (trial.status().code() == absl::StatusCode::kInvalidArgument) continue;
      if (!trial.ok()) return trial.status();
      Row ratio;
      if (!subject.has_joints) {
        const absl::StatusOr<double> plain = plain_cost(subject, setting.knobs);
        if (!plain.ok()) return plain.status();
        ratio = trial->cost_us / *plain;
      }
      const double error = subject.is_chaotic ? trial->overlap_m : error_between(trial->samples, reference);
      Row row = {{"scene", subject.name},
                 {"engine", name_of(options_.precision)},
                 {"knob", setting.knob},
                 {"value", setting.value},
                 {"time_step", setting.knobs.values().time_step},
                 {"substeps", setting.knobs.values().substeps},
                 {"solver_iterations", setting.knobs.values().solver_iterations},
                 {"error_m", std::isfinite(error) ? Row(error) : Row()},
                 {"overlap_m", trial->overlap_m},
                 {"speed_m_s", trial->speed_m_s},
                 {"cost_us", trial->cost_us},
                 {"ratio", ratio},
                 {"hash", trial->hash}};
      if (setting.knob == "default") base = row;
      if (setting.knob != "default" && setting.knob != "grid") add_price(row, base);
      report_.table("rows").push_back(std::move(row));
    }
    return absl::OkStatus();
  }

  void add_price(const Row& row, const Row& base) {
    Row price = {
        {"scene", row["scene"]}, {"engine", row["engine"]}, {"knob", row["knob"]}, {"value", row["value"]}};
    const bool comparable = !row["error_m"].is_null() && !base["error_m"].is_null() && base["error_m"] > 0;
    price["error_ratio"] =
        comparable ? Row(row["error_m"].get<double>() / base["error_m"].get<double>()) : Row();
    price["cost_ratio"] = row["cost_us"].get<double>() / base["cost_us"].get<double>();
    report_.table("prices").push_back(std::move(price));
  }

  const ExperimentOptions& options_;
  ProgressCount progress_;
  std::vector<Subject> subjects_;
  std::vector<Setting> settings_;
  Report report_;
};

}  // namespace

absl::StatusOr<Report> measure_tradeoff(const ExperimentOptions& options, const Progress& progress) {
  return Tradeoff(options, progress).measure();
}

}  // namespace tessera
