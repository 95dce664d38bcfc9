#include "cli/tune/tune.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

#include "cli/measure/own_process.h"

namespace tessera {
namespace {

struct Passes {
  int substeps;
  int iterations;
};
// From cheap and coarse to dear and fine.
constexpr Passes kPasses[] = {{1, 10}, {1, 30}, {2, 8}, {4, 12}, {4, 24}, {8, 24}, {8, 48}};
constexpr double kStepShares[] = {2, 1, 0.5, 0.25};  // of the world's time step, which all divide the first
constexpr double kStepMax = 1.0 / 30;                // s; beyond, nobody calls it real time

std::vector<Knobs> candidates(const WorldSettings& settings, Precision precision) {
  std::vector<Knobs> list;
  for (const double share : kStepShares) {
    const double step = settings.time_step * share;
    if (share > 1 && step > kStepMax) continue;
    for (const Passes& passes : kPasses) {
      Knobs knobs;
      knobs.set(&WorldSettings::precision, precision);
      knobs.set(&WorldSettings::time_step, step);
      knobs.set(&WorldSettings::substeps, passes.substeps);
      knobs.set(&WorldSettings::solver_iterations, passes.iterations);
      list.push_back(knobs);
    }
  }
  return list;
}

Knobs own_knobs(const WorldSettings& settings) {
  Knobs knobs;
  knobs.set(&WorldSettings::precision, settings.precision);
  knobs.set(&WorldSettings::time_step, settings.time_step);
  knobs.set(&WorldSettings::substeps, settings.substeps);
  knobs.set(&WorldSettings::solver_iterations, settings.solver_iterations);
  return knobs;
}

class Search {
 public:
  Search(const WorldDescription& world, const TuneOptions& options, const Progress& progress)
      : world_(world),
        options_(options),
        progress_(progress, 0),
        moments_(Moments::within(options.horizon, kStepShares[0] * world.settings.time_step)) {
    for (const Precision precision : {Precision::kFloat32, Precision::kFloat64}) {
      std::vector<Knobs>& list = candidates_[static_cast<std::size_t>(precision)];
      if (precision == world.settings.precision) list.push_back(own_knobs(world.settings));
      for (const Knobs& knobs : candidates(world.settings, precision)) {
        // Sectors may be too large for single precision, or steps out of bounds.
        if (with_knobs(world, knobs).ok()) list.push_back(knobs);
      }
      progress_.expect(list.size());
    }
    progress_.expect(2);  // references
  }

  absl::StatusOr<Report> run() {
    absl::StatusOr<Report> references = in_own_process([this] { return measure_references(); });
    if (!references.ok()) return references.status();
    reference_ = samples_from(references->table("reference"));
    progress_.skip(2);
    Report report;
    report.table("rows");
    report.table("chosen");
    report.table("trust") = references->table("trust");
    for (const Precision precision : {Precision::kFloat32, Precision::kFloat64}) {
      const std::vector<Knobs>& list = candidates_[static_cast<std::size_t>(precision)];
      if (list.empty()) continue;
      absl::StatusOr<Report> part = in_own_process([&] { return measure(list); });
      if (!part.ok()) return part.status();
      report.append(*std::move(part));
      progress_.skip(list.size());
    }
    judge(report);
    return report;
  }

 private:
  absl::StatusOr<Trial> run_with(const Knobs& knobs) {
    const absl::StatusOr<WorldDescription> turned = with_knobs(world_, knobs);
    if (!turned.ok()) return turned.status();
    absl::StatusOr<Trial> trial = run_trial(*turned, moments_);
    if (!trial.ok()) return trial.status();
    if (absl::Status status = progress_.advance(); !status.ok()) return status;
    return trial;
  }

  absl::StatusOr<Report> measure_references() {
    const absl::StatusOr<Trial> fine = run_with(reference_knobs(world_.settings, /*coarser=*/false));
    if (!fine.ok()) return fine.status();
    const absl::StatusOr<Trial> coarse = run_with(reference_knobs(world_.settings, /*coarser=*/true));
    if (!coarse.ok()) return coarse.status();
    Report report;
    report.table("reference") = to_rows(fine->samples);
    const double error = error_between(fine->samples, coarse->samples);
    report.table("trust").push_back({{"reference_error_m", std::isfinite(error) ? Row(error) : Row()}});
    return report;
  }

  absl::StatusOr<Report> measure(const std::vector<Knobs>& list) {
    Report report;
    for (const Knobs& knobs : list) {
      const absl::StatusOr<Trial> trial = run_with(knobs);
      if (!trial.ok()) return trial.status();
      const double error = error_between(trial->samples, reference_);
      report.table("rows").push_back({{"engine", name_of(*knobs.get(&WorldSettings::precision))},
                                      {"time_step", *knobs.get(&WorldSettings::time_step)},
                                      {"substeps", *knobs.get(&WorldSettings::substeps)},
                                      {"solver_iterations", *knobs.get(&WorldSettings::solver_iterations)},
                                      {"error_m", std::isfinite(error) ? Row(error) : Row()},
                                      {"cost_us", trial->cost_us},
                                      {"own", &knobs == &list.front() && is_own(knobs)},
                                      {"hash", trial->hash}});
    }
    return report;
  }

  bool is_own(const Knobs& knobs) const {
    return *knobs.get(&WorldSettings::precision) == world_.settings.precision;
  }

  void judge(Report& report) const {
    std::vector<Row>& rows = report.table("rows");
    double own_us = 0;
    for (const Row& row : rows) {
      if (row["own"].get<bool>()) own_us = row["cost_us"];
    }
    for (Row& row : rows) {
      const double cost = row["cost_us"];
      row["ratio"] = cost / own_us;
      row["meets"] = !row["error_m"].is_null() && row["error_m"].get<double>() <= options_.max_error &&
                     (options_.max_cost <= 0 || cost <= options_.max_cost);
    }
    mark_front(rows, {});
    std::stable_sort(rows.begin(), rows.end(),
                     [](const Row& a, const Row& b) { return a["cost_us"] < b["cost_us"]; });
    const auto cheapest =
        std::find_if(rows.begin(), rows.end(), [](const Row& row) { return row["meets"].get<bool>(); });
    if (cheapest != rows.end()) {
      Row chosen = {{"precision", (*cheapest)["engine"]}};
      for (const char* name : {"time_step", "substeps", "solver_iterations"})
        chosen[name] = (*cheapest)[name];
      report.table("chosen").push_back(std::move(chosen));
      return;
    }
    const Row& trust = report.table("trust").front()["reference_error_m"];
    report.misses.push_back(absl::StrFormat(
        "nothing that was tried keeps every body within %g m for %g s%s; two fine references differ by %s m",
        options_.max_error, options_.horizon, options_.max_cost > 0 ? " at that cost" : "",
        trust.is_null() ? "more than can be said" : absl::StrFormat("%.3g", trust.get<double>())));
  }

  const WorldDescription& world_;
  const TuneOptions& options_;
  ProgressCount progress_;
  Moments moments_;
  std::vector<Knobs> candidates_[2];  // by precision
  std::vector<Positions> reference_;
};

}  // namespace

absl::StatusOr<Report> tune(const WorldDescription& world, const TuneOptions& options,
                            const Progress& progress) {
  return Search(world, options, progress).run();
}

}  // namespace tessera
