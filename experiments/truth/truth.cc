#include "experiments/truth/truth.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/own_process.h"
#include "experiments/mujoco/mujoco.h"
#include "experiments/scenes.h"
#include "experiments/truth/scene.h"

namespace tessera {
namespace truth {

double Result::error() const {
  const double error = std::abs(got - right);
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

std::vector<Scene> all_scenes() {
  return joined({rest_scenes(), slide_scenes(), carrier_scenes(), impact_scenes(), through_scenes(),
                 flush_scenes(), flight_scenes(), ray_scenes(), trigger_scenes(), program_scenes(),
                 force_scenes(), robot_scenes(), sensor_scenes(), fluid_scenes(), frame_scenes()});
}

namespace {

// Of processor time: several times what the slowest scene needs.
constexpr std::chrono::seconds kSecondsMax{900};
constexpr double kAboveRounding = 0.02;  // of a bound: smaller errors have no order
constexpr double kOrderBase = 2;         // by how much the time step is shortened

// Who simulates a scene, and how.
struct Variant {
  std::string engine;
  WorldSettings settings;
  Make make;
  bool is_ours = false;
};

std::vector<Variant> variants_of(const Scene& scene, const ExperimentOptions& options) {
  WorldSettings settings;
  settings.precision = options.precision;
  const std::string engine = name_of(options.precision);
  std::vector<Variant> variants = {
      {engine, settings, [](const WorldDescription& world) { return in_sectors(world); }, true}};
  if (scene.has_border) {
    variants.push_back(variants.front());
    variants.back().settings.sector_size = kBorderSectors;
  }
  if (scene.in_bullet) variants.push_back({absl::StrCat("Bullet ", engine), settings, in_one_world, false});
  if (has_mujoco() && scene.in_bullet && options.precision == Precision::kFloat64)
    variants.push_back({"MuJoCo", settings, in_mujoco, false});
  return variants;
}

absl::StatusOr<Results> results_of(const Scene& scene, const Variant& variant, bool quick) {
  if (scene.measure) return scene.measure(variant.settings, variant.make, quick);
  const WorldDescription world = scene.world(variant.settings);
  const absl::StatusOr<std::unique_ptr<LocalWorld>> local = variant.make(world);
  if (!local.ok()) return local.status();
  Course course(world, scene.every);
  const bool is_shorter = quick && scene.quick_seconds > 0;
  run(**local, is_shorter ? scene.quick_seconds : scene.seconds, scene.script, course, scene.keeps_contacts);
  return scene.results(course);
}

// Of the same quantity with a shorter time step.
Row order_of(const Result& result, const Result& finer) {
  if (!(finer.error() > 0) || result.error() < kAboveRounding * result.bound) return Row();
  const double order = std::log(result.error() / finer.error()) / std::log(kOrderBase);
  return std::isfinite(order) ? Row(order) : Row();
}

Row row_of(const Scene& scene, const Variant& variant) {
  Row row = {{"group", scene.group}, {"scene", scene.name}, {"engine", variant.engine}};
  row["sector_m"] = variant.is_ours ? Row(variant.settings.sector_size) : Row();
  for (const char* column : {"quantity", "unit", "right", "got", "bound"}) row[column] = Row();
  row["ok"] = false;
  for (const char* column : {"order", "message"}) row[column] = Row();
  return row;
}

// A row a quantity.
absl::StatusOr<Report> measured(const Scene& scene, const Variant& variant, bool quick) {
  const absl::StatusOr<Results> results = results_of(scene, variant, quick);
  if (!results.ok()) return results.status();
  Results finer;
  if (scene.has_order) {
    Variant fine = variant;
    fine.settings.time_step /= kOrderBase;
    const absl::StatusOr<Results> again = results_of(scene, fine, quick);
    if (!again.ok()) return again.status();
    finer = *again;
  }
  Report report;
  for (std::size_t n = 0; n < results->size(); ++n) {
    const Result& result = (*results)[n];
    Row row = row_of(scene, variant);
    row["quantity"] = result.quantity;
    row["unit"] = result.unit;
    row["right"] = result.right;
    if (std::isfinite(result.got)) row["got"] = result.got;
    row["bound"] = result.bound;
    row["ok"] = result.ok();
    if (n < finer.size()) row["order"] = order_of(result, finer[n]);
    report.table("rows").push_back(std::move(row));
  }
  return report;
}

absl::StatusOr<Report> measured_apart(const Scene& scene, const Variant& variant, bool quick) {
  absl::StatusOr<Report> report =
      in_own_process([&] { return measured(scene, variant, quick); }, kSecondsMax);
  if (report.ok() || absl::IsCancelled(report.status())) return report;
  if (!variant.is_ours && absl::IsUnimplemented(report.status())) return Report();  // not its kind of scene
  Row row = row_of(scene, variant);
  row["message"] = std::string(report.status().message());
  Report failed;
  failed.table("rows").push_back(std::move(row));
  return failed;
}

void add_misses(const std::vector<Row>& rows, std::vector<std::string>& misses) {
  for (const Row& row : rows) {
    if (row["sector_m"].is_null() || row["ok"].get<bool>()) continue;
    const std::string where = absl::StrFormat("%s, sectors of %g m, %s %s", row["engine"].get<std::string>(),
                                              row["sector_m"].get<double>(), row["group"].get<std::string>(),
                                              row["scene"].get<std::string>());
    if (!row["message"].is_null()) {
      misses.push_back(absl::StrCat(where, ": ", row["message"].get<std::string>()));
    } else {
      misses.push_back(absl::StrFormat("%s: %s is %s %s, right is %g, within %g", where,
                                       row["quantity"].get<std::string>(), row["got"].dump(),
                                       row["unit"].get<std::string>(), row["right"].get<double>(),
                                       row["bound"].get<double>()));
    }
  }
}

void add_summary(const std::vector<Row>& rows, std::vector<Row>& summary) {
  std::vector<std::string> keys;
  std::map<std::string, std::size_t> places;
  for (const Row& row : rows) {
    std::string engine = row["engine"].get<std::string>();
    const bool has_border = row["sector_m"].is_number() && row["sector_m"].get<double>() == kBorderSectors;
    if (has_border) absl::StrAppend(&engine, " with a border");
    const std::string key = absl::StrCat(row["group"].get<std::string>(), "\n", engine);
    const auto [place, is_new] = places.try_emplace(key, summary.size());
    if (is_new)
      summary.push_back({{"group", row["group"]}, {"engine", engine}, {"quantities", 0}, {"ok", 0}});
    Row& sum = summary[place->second];
    sum["quantities"] = sum["quantities"].get<int>() + 1;
    if (row["ok"].get<bool>()) sum["ok"] = sum["ok"].get<int>() + 1;
  }
}

}  // namespace
}  // namespace truth

absl::StatusOr<Report> measure_truth(const ExperimentOptions& options, const Progress& progress) {
  std::vector<truth::Scene> scenes = truth::all_scenes();
  if (options.quick) std::erase_if(scenes, [](const truth::Scene& scene) { return !scene.in_quick; });
  if (absl::Status status = choose(options.only, scenes); !status.ok()) return status;
  absl::StatusOr<Report> report = measure_each(scenes, progress, [&](const truth::Scene& scene) {
    Report of_scene;
    for (const truth::Variant& variant : truth::variants_of(scene, options)) {
      absl::StatusOr<Report> one = truth::measured_apart(scene, variant, options.quick);
      if (!one.ok()) return one;
      of_scene.append(*std::move(one));
    }
    truth::add_misses(of_scene.table("rows"), of_scene.misses);
    return absl::StatusOr<Report>(std::move(of_scene));
  });
  if (report.ok()) truth::add_summary(report->table("rows"), report->table("summary"));
  return report;
}

}  // namespace tessera
