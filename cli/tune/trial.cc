#include "cli/tune/trial.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "cli/measure/local_world.h"
#include "cli/measure/stopwatch.h"
#include "lpss/model/validate.h"

namespace tessera {
namespace {

constexpr double kRounding = 1e-6;  // of quotients that are whole

Tick ticks_in(double seconds, const WorldDescription& world) {
  return static_cast<Tick>(std::lround(seconds / world.settings.time_step));
}

Positions positions_of(const LocalWorld& local, const WorldDescription& world, double& fastest) {
  std::vector<BodyRecord> records = local.bodies();
  std::erase_if(records,
                [](const BodyRecord& record) { return record.properties.motion != Motion::kDynamic; });
  fastest = 0;
  for (const BodyRecord& record : records) {
    fastest =
        std::max(fastest, Eigen::Map<const Eigen::Vector3d>(record.state.linear_velocity.data()).norm());
  }
  return positions_from({world.anchor, Eigen::Vector3d::Zero()}, records, world.settings.sector_size);
}

// `tick_us` is the mean of its ticks, but for those before samples, which look for overlaps, too.
absl::StatusOr<Trial> run_once(const WorldDescription& world, const Moments& moments, bool is_plain,
                               double& tick_us) {
  const absl::StatusOr<std::unique_ptr<LocalWorld>> created =
      is_plain ? in_one_world(world) : in_sectors(world);
  if (!created.ok()) return created.status();
  LocalWorld& local = **created;
  Trial trial;
  const Tick between = ticks_in(moments.interval, world) - 1;
  double spent_us = 0;
  for (int sample = 0; sample < moments.count; ++sample) {
    const std::chrono::nanoseconds start = processor_time();
    local.run(between);
    spent_us += microseconds(processor_time() - start);
    trial.overlap_m = std::max(trial.overlap_m, local.step_for_overlap());
    trial.samples.push_back(positions_of(local, world, trial.speed_m_s));
  }
  tick_us = spent_us / static_cast<double>(between * static_cast<Tick>(moments.count));
  trial.hash = local.hash().to_string();
  return trial;
}

}  // namespace

Moments Moments::within(double horizon, double coarsest_step) {
  constexpr double kMost = 32;
  constexpr double kStepsMin = 2;  // a tick to be timed before that of the sample
  const double steps = std::max(kStepsMin, std::ceil(horizon / kMost / coarsest_step - kRounding));
  const double interval = steps * coarsest_step;
  return {interval, std::max(1, static_cast<int>(std::ceil(horizon / interval - kRounding)))};
}

absl::StatusOr<Trial> run_trial(const WorldDescription& world, const Moments& moments, bool is_plain) {
  constexpr double kEnoughUs = 30e3;  // what is shorter is measured again, and the least counts
  constexpr int kRunsMax = 5;
  const auto ticks =
      static_cast<double>(ticks_in(moments.interval, world) * static_cast<Tick>(moments.count));
  double least_us = 0;
  double total_us = 0;
  absl::StatusOr<Trial> trial;
  for (int n = 0; n < kRunsMax && (n == 0 || total_us < kEnoughUs); ++n) {
    double tick_us = 0;
    trial = run_once(world, moments, is_plain, tick_us);
    if (!trial.ok()) return trial;
    least_us = n == 0 ? tick_us : std::min(least_us, tick_us);
    total_us += tick_us * ticks;
  }
  const auto bodies = static_cast<double>(std::max<std::size_t>(trial->samples.back().size(), 1));
  trial->cost_us = least_us / world.settings.time_step / bodies;
  return trial;
}

double error_between(const std::vector<Positions>& a, const std::vector<Positions>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    largest = std::max(largest, largest_distance(a[i], b[i]));
  }
  return largest;
}

std::vector<Row> to_rows(const std::vector<Positions>& samples) {
  std::vector<Row> rows;
  for (const Positions& positions : samples) {
    std::vector<double> numbers;
    for (const Eigen::Vector3d& position : positions)
      numbers.insert(numbers.end(), position.begin(), position.end());
    rows.push_back({{"positions", numbers}});
  }
  return rows;
}

std::vector<Positions> samples_from(const std::vector<Row>& rows) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<Positions> samples;
  for (const Row& row : rows) {
    Positions positions;
    const Row& numbers = row.at("positions");
    for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
      const auto number = [&](std::size_t n) {
        return numbers[n].is_number() ? numbers[n].get<double>() : kNone;
      };
      positions.emplace_back(number(i), number(i + 1), number(i + 2));
    }
    samples.push_back(std::move(positions));
  }
  return samples;
}

absl::StatusOr<WorldDescription> with_knobs(const WorldDescription& world, const Knobs& knobs) {
  WorldDescription turned = world;
  if (absl::Status status = apply(knobs, turned); !status.ok()) return status;
  if (absl::Status status = validate(turned); !status.ok()) return status;
  return turned;
}

Knobs reference_knobs(const WorldSettings& settings, bool coarser) {
  constexpr double kFinestStep = 1e-4;  // s
  Knobs knobs;
  knobs.set(&WorldSettings::precision, Precision::kFloat64);
  knobs.set(&WorldSettings::time_step, std::max(settings.time_step / (coarser ? 4 : 8), kFinestStep));
  knobs.set(&WorldSettings::substeps, 4);
  knobs.set(&WorldSettings::solver_iterations, 60);
  knobs.set(&WorldSettings::sleep_after, 0);
  return knobs;
}

void mark_front(std::vector<Row>& rows, const std::vector<std::string>& group) {
  const auto is_better = [&](const Row& a, const Row& b) {
    if (a["error_m"].is_null() || b["error_m"].is_null()) return !a["error_m"].is_null();
    const double error_a = a["error_m"], error_b = b["error_m"];
    const double cost_a = a["cost_us"], cost_b = b["cost_us"];
    return error_a <= error_b && cost_a <= cost_b && (error_a < error_b || cost_a < cost_b);
  };
  const auto are_rivals = [&](const Row& a, const Row& b) {
    return std::all_of(group.begin(), group.end(),
                       [&](const std::string& name) { return a[name] == b[name]; });
  };
  for (Row& row : rows) {
    row["front"] = std::none_of(rows.begin(), rows.end(), [&](const Row& other) {
      return are_rivals(row, other) && is_better(other, row);
    });
  }
}

}  // namespace tessera
