#include "experiments/requirements/requirements.h"

#include <absl/strings/str_cat.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <future>
#include <iterator>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "cli/measure/own_process.h"
#include "cli/tune/trial.h"
#include "experiments/contestant.h"
#include "experiments/heap.h"
#include "experiments/requirements/choices.h"
#include "experiments/requirements/spread.h"
#include "worlds/loader/world_file.h"

namespace tessera {
namespace {

constexpr double kDisturbance = 1e-5;  // m: the resolution of a float at 128 m
constexpr Tick kTicksForMemory = 3;
constexpr char kPeak[] = "peak_kb";
constexpr char kReference[] = "reference";
constexpr char kCoarser[] = "coarser";

// Compares one world with all choices and without each of them.
class Comparison {
 public:
  Comparison(const RequirementsSubject& subject, ProgressCount& count)
      : subject_(subject),
        count_(count),
        choices_(choices_for(subject.world)),
        ticks_(ticks_in(subject.seconds)),
        horizon_(ticks_in(subject.horizon)) {
    for (const BodyDescription& body : subject.world.bodies) {
      if (body.properties.motion == Motion::kDynamic) ++bodies_;
    }
  }

  // Number of tasks in measure(), for the progress display.
  std::uint64_t work() const { return work_for_references() + work_for_memory() + ticks_; }

  absl::StatusOr<Report> measure() {
    malloc_trim(0);  // otherwise memory freed earlier would hide what the processes need
    absl::StatusOr<Report> peaks = measure_memory();
    if (!peaks.ok()) return peaks.status();
    absl::StatusOr<Report> references = in_own_process([this] { return measure_references(); });
    if (!references.ok()) return references.status();
    count_.skip(work_for_references());
    // In a thread with a new heap: holes in the old one would slow down the first contestant.
    absl::StatusOr<Report> report = in_own_process([&] {
      return std::async(std::launch::async, [&] { return measure_turns(peaks->table(kPeak), *references); })
          .get();
    });
    if (report.ok()) count_.skip(ticks_);
    return report;
  }

 private:
  static constexpr std::uint64_t work_for_references() { return 2; }
  std::uint64_t work_for_memory() const { return choices_.size() + 1; }

  Tick ticks_in(double seconds) const {
    return static_cast<Tick>(std::lround(seconds / subject_.world.settings.time_step));
  }

  absl::StatusOr<Report> measure_references() {
    Report report;
    for (const bool coarser : {false, true}) {
      const absl::StatusOr<WorldDescription> world =
          with_knobs(subject_.world, reference_knobs(subject_.world.settings, coarser));
      if (!world.ok()) return world.status();
      const absl::StatusOr<Trial> trial = run_trial(*world, {.interval = subject_.horizon, .count = 1});
      if (!trial.ok()) return trial.status();
      report.table(coarser ? kCoarser : kReference) = to_rows({trial->samples.back()});
      if (absl::Status status = count_.advance(); !status.ok()) return status;
    }
    return report;
  }

  // The world with all choices (0), without one of them (1 and up), and disturbed (the last).
  absl::StatusOr<WorldDescription> variant(std::size_t n) const {
    WorldDescription world = subject_.world;
    if (n > choices_.size()) {
      if (absl::Status status = disturb(world, kDisturbance); !status.ok()) return status;
    } else if (n > 0 && choices_[n - 1].unmake) {
      choices_[n - 1].unmake(world);
    }
    return world;
  }
  bool free_flight(std::size_t n) const {
    return n == 0 || n > choices_.size() || choices_[n - 1].free_flight;
  }

  // Peak memory of the world, without its description.
  absl::StatusOr<Report> measure_peak(std::size_t n) const {
    constexpr double kUnit = 1000;
    const absl::StatusOr<WorldDescription> world = variant(n);
    if (!world.ok()) return world.status();
    const std::size_t before = peak_bytes();
    const absl::StatusOr<std::unique_ptr<LocalWorld>> local = in_sectors(*world, free_flight(n));
    if (!local.ok()) return local.status();
    (*local)->run(kTicksForMemory);
    Report report;
    report.table(kPeak).push_back({{kPeak, static_cast<double>(peak_bytes() - before) / kUnit}});
    return report;
  }

  absl::StatusOr<Report> measure_memory() {
    Report report;
    for (std::size_t n = 0; n <= choices_.size(); ++n) {
      absl::StatusOr<Report> peak = in_own_process([&] { return measure_peak(n); });
      if (!peak.ok()) return peak.status();
      report.append(*std::move(peak));
      if (absl::Status status = count_.advance(); !status.ok()) return status;
    }
    return report;
  }

  absl::Status create_contestants() {
    for (std::size_t n = 0; n <= choices_.size() + 1; ++n) {
      const absl::StatusOr<WorldDescription> world = variant(n);
      if (!world.ok()) return world.status();
      absl::StatusOr<std::unique_ptr<LocalWorld>> local = in_sectors(*world, free_flight(n));
      if (!local.ok()) return local.status();
      contestants_.emplace_back(*std::move(local), *world);
    }
    return absl::OkStatus();
  }

  absl::StatusOr<Report> measure_turns(const std::vector<Row>& peaks, Report& references) {
    if (absl::Status status = create_contestants(); !status.ok()) return status;
    for (Tick tick = 1; tick <= ticks_; ++tick) {
      for (std::size_t n = 0; n < contestants_.size(); ++n) {
        contestants_[(n + tick) % contestants_.size()].step();  // in rotating order
      }
      if (tick == horizon_) {
        for (const Contestant& contestant : contestants_) at_horizon_.push_back(contestant.positions());
      }
      if (absl::Status status = count_.advance(); !status.ok()) return status;
    }
    return report(peaks, references);
  }

  // The distance of each body asleep at the end from its position in another run.
  std::vector<double> distances_at_rest(const Contestant& other) const {
    const std::vector<BodyRecord> bodies = contestants_.front().bodies();
    std::vector<double> all = distances(contestants_.front().positions(), other.positions());
    std::vector<double> resting;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (bodies[i].state.activity == Activity::kAsleep) resting.push_back(all[i]);
    }
    return resting;
  }

  Report report(const std::vector<Row>& peaks, Report& references) const {
    Report report;
    const std::string hash = on().hash();
    const auto peak_kb = [&](std::size_t n) { return peaks[n].at(kPeak).get<double>() / bodies_; };
    for (std::size_t n = 0; n < choices_.size(); ++n) {
      const Contestant& off = contestants_[n + 1];
      const std::string hash_off = off.hash();
      if (!choices_[n].free_flight && !has_fine_orbits() && hash != hash_off) {
        report.misses.push_back(absl::StrCat(subject_.name, " ends in different bits if lone bodies coast"));
      }
      Row row = first_columns(choices_[n].name);
      row["cpu_us_on"] = cpu_us(on());
      row["cpu_us_off"] = cpu_us(off);
      row["saving"] = cpu_us(off) / cpu_us(on());
      row["saving_at_end"] = off.spent_us(last_second()) / on().spent_us(last_second());
      row["peak_kb_on"] = peak_kb(0);
      row["peak_kb_off"] = peak_kb(n + 1);
      row["error_m"] = Spread(distances(at_horizon_.front(), at_horizon_[n + 1])).largest;
      row["hash_on"] = hash;
      row["hash_off"] = hash_off;
      report.table("rows").push_back(std::move(row));
    }
    add_errors(references, report);
    report.table("worlds").push_back({{"world", subject_.name},
                                      {"engine", name_of(subject_.world.settings.precision)},
                                      {"bodies", on().bodies().size()},
                                      {"asleep", distances_at_rest(on()).size()},
                                      {"sectors", sectors().size()},
                                      {"seconds", subject_.seconds},
                                      {"horizon_s", subject_.horizon},
                                      {"cost_of_same", cpu_us(disturbed()) / cpu_us(on())}});
    return report;
  }

  void add_errors(Report& references, Report& report) const {
    const Positions reference = samples_from(references.table(kReference)).front();
    const Positions coarser = samples_from(references.table(kCoarser)).front();
    const Spread noise(distances(at_horizon_.front(), at_horizon_.back()));
    const Spread noise_at_rest(distances_at_rest(disturbed()));
    const Spread trust(distances(reference, coarser));
    const Spread on_to_reference(distances(at_horizon_.front(), reference));
    for (std::size_t n = 0; n < choices_.size(); ++n) {
      const Spread error(distances(at_horizon_.front(), at_horizon_[n + 1]));
      const Spread at_rest(distances_at_rest(contestants_[n + 1]));
      const Spread off_to_reference(distances(at_horizon_[n + 1], reference));
      for (const auto& [name, of] : {std::pair{"median", &Spread::middle}, {"largest", &Spread::largest}}) {
        Row row = first_columns(choices_[n].name);
        row["body"] = name;
        row["error_m"] = error.*of;
        row["noise_m"] = noise.*of;
        row["error_at_rest_m"] = at_rest.*of;
        row["noise_at_rest_m"] = noise_at_rest.*of;
        row["to_reference_on_m"] = on_to_reference.*of;
        row["to_reference_off_m"] = off_to_reference.*of;
        row["reference_error_m"] = trust.*of;
        report.table("errors").push_back(std::move(row));
      }
    }
  }

  Row first_columns(const std::string& choice) const {
    return {
        {"world", subject_.name}, {"choice", choice}, {"engine", name_of(subject_.world.settings.precision)}};
  }
  double cpu_us(const Contestant& contestant) const {
    return contestant.spent_us(ticks_) / bodies_ / subject_.seconds;
  }
  // Where a dynamic body is.
  std::set<SectorIndex> sectors() const {
    std::set<SectorIndex> homes;
    for (const BodyRecord& body : on().bodies()) homes.insert(body.home);
    return homes;
  }
  Tick last_second() const { return std::min(ticks_, ticks_in(1)); }
  const Contestant& on() const { return contestants_.front(); }
  const Contestant& disturbed() const { return contestants_.back(); }

  // Lone bodies fly in a higher precision than the engine's.
  bool has_fine_orbits() const { return engine_settings(subject_.world.settings).fine_flight; }

  const RequirementsSubject& subject_;
  ProgressCount& count_;
  std::vector<Choice> choices_;
  Tick ticks_;
  Tick horizon_;
  double bodies_ = 0;                    // dynamic ones
  std::vector<Contestant> contestants_;  // with all choices, without each, and disturbed
  std::vector<Positions> at_horizon_;    // of contestants_
};

struct WorldFile {
  const char* name;
  std::filesystem::path folder;
  const char* folder_name;
  const char* file;
};

absl::StatusOr<WorldDescription> load(const WorldFile& file, Precision precision) {
  absl::StatusOr<LoadedWorld> loaded = load_world_file(file.folder / file.file);
  if (!loaded.ok()) return loaded.status();
  loaded->world.settings.precision = precision;
  loaded->world.settings.time_step = WorldSettings().time_step;
  return std::move(loaded->world);
}

}  // namespace

absl::StatusOr<Report> measure_requirements_of(std::span<const RequirementsSubject> subjects,
                                               const Progress& progress) {
  Report report;
  ProgressCount count(progress, 0, report);
  std::vector<Comparison> comparisons;
  for (const RequirementsSubject& subject : subjects) {
    comparisons.emplace_back(subject, count);
    count.expect(comparisons.back().work());
  }
  for (Comparison& comparison : comparisons) {
    absl::StatusOr<Report> part = comparison.measure();
    if (!part.ok()) return part.status();
    report.append(*std::move(part));
  }
  return report;
}

absl::StatusOr<Report> measure_requirements(const ExperimentOptions& options, const Progress& progress) {
  const int lone_bodies = options.quick ? 1'000 : 10'000;
  const double seconds = options.quick ? 1.1 : 6;
  const double horizon = options.quick ? 0.1 : 0.5;
  WorldSettings settings;
  settings.precision = options.precision;
  std::vector<RequirementsSubject> subjects = {
      {"sparse", sparse_world(settings, lone_bodies), seconds / 2, horizon}};
  std::vector<std::string> misses;
  for (const WorldFile& file : {WorldFile{"earth", ".", "the working directory", "worlds/earth.sdf"},
                                {"3k_shapes", options.worlds, "$TESSERA_WORLDS", "gazebo/3k_shapes.sdf"}}) {
    if (file.folder.empty() || !std::filesystem::exists(file.folder / file.file)) {
      misses.push_back(absl::StrCat(file.name, " is skipped: ", file.folder_name, " has no ", file.file));
      continue;
    }
    absl::StatusOr<WorldDescription> world = load(file, options.precision);
    if (!world.ok()) return world.status();
    subjects.push_back({file.name, *std::move(world), seconds, horizon});
  }
  absl::StatusOr<Report> report = measure_requirements_of(subjects, progress);
  if (!report.ok()) return report.status();
  std::ranges::move(misses, std::back_inserter(report->misses));
  return report;
}

}  // namespace tessera
