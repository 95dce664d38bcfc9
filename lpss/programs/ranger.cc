// Ranger: distances along rays that fan out from a place of the body, as a laser scanner measures them.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/measuring.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/places.h"
#include "lpss/programs/ray_fan.h"

namespace tessera {
namespace ranger {
namespace {

constexpr std::size_t kRaysMax = RayFan::kRaysMax;

enum class Parameter {
  kX,
  kY,
  kZ,
  kRays,
  kAngle,
  kHeading,
  kElevation,
  kLeast,
  kMost,
  kMask,
  kNoise,
  kRows,
  kRowAngle,
  kRoll,
  kPitch,
  kYaw,
  kRate,
  kPlane,
  kBody,
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m", 0, -1e3, 1e3, "Where it is in the body frame,"},
    {"y", "m", 0, -1e3, 1e3, "along its y axis,"},
    {"z", "m", 0, -1e3, 1e3, "and along its z axis."},
    {"rays", "", 1, 1, static_cast<double>(kRaysMax),
     "How many rays in a row; a part of one does not count."},
    {"angle", "rad", 0, 0, 6.2832,
     "From the first to the last ray of a row, about the z axis of the sensor."},
    {"heading", "rad", 0, -6.2832, 6.2832,
     "Of the middle of the fan, from the x axis of the sensor; above 0 to the left."},
    {"elevation", "rad", 0, -1.5708, 1.5708, "Of the middle row, above the x-y plane of the sensor."},
    {"least", "m", 0, 0, kProgramCastMax, "Nearer than that, a ray meets nothing."},
    {"most", "m", 30, 0.001, kProgramCastMax, "What is farther away is not seen."},
    {"mask", "", 4294967295, 0, 4294967295, "The collision categories that it sees, as bits."},
    {"noise", "m", 0, 0, 1e3, "The standard deviation of each distance, in a measurement."},
    {"rows", "", 1, 1, static_cast<double>(kRaysMax),
     "How many rows of rays; of more than 1,024 rays in all, the last rows are left out."},
    {"row_angle", "rad", 0, 0, 3.1416, "From the lowest row to the highest one."},
    {"roll", "rad", 0, -7, 7, "How the sensor is turned in the body frame: about the x axis first,"},
    {"pitch", "rad", 0, -7, 7, "then about the y axis,"},
    {"yaw", "rad", 0, -7, 7, "then about the z axis of the body."},
    {"rate", "Hz", 0, 0, 1e4,
     "How often it measures; 0: in every tick. In between it shows what it has measured."},
    {"plane", "", 0, 0, 1,
     "1: rays go through the middles of even parts of a plane, as those of a depth camera; the angles of a "
     "row and of the rows, at most 3, are from edge to edge."},
    {"body", kBodyUnit, 0, 0, static_cast<double>(kBodyIdMax),
     "The body that rays pass through; 0: the own one."},
});

enum class Value { kHits, kNearest, kRange };

// "range_0" to the last one that there may be.
std::span<const NumberSpec> value_table() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (std::size_t n = 0; n < kRaysMax; ++n) names.push_back(absl::StrCat("range_", n));
    return names;
  }();
  static const std::vector<NumberSpec> kTable = [] {
    std::vector<NumberSpec> table = {
        {"hits", "", 0, 0, 0, "How many rays meet something."},
        {"nearest", "m", 0, 0, 0, "The smallest distance; `most` if no ray meets anything."}};
    for (const std::string& name : kNames) {
      table.push_back(
          {name, "m", 0, 0, 0,
           "The distance along each ray; `most` if it meets nothing. In a row from the right to the "
           "left, the lowest row first."});
    }
    return table;
  }();
  return kTable;
}

double parameter(std::span<const double> parameters, Parameter place) {
  return static_cast<std::size_t>(place) < parameters.size()
             ? at(parameters, place)
             : kParameters[static_cast<std::size_t>(place)].first;
}

class Ranger final : public Program {
 public:
  absl::string_view kind() const override { return "ranger"; }
  absl::string_view summary() const override {
    return "Measures distances along up to 1,024 rays in rows, as laser scanners, sonars and depth cameras "
           "do.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return value_table(); }
  std::size_t value_count(std::span<const double> parameters) const override {
    return static_cast<std::size_t>(Value::kRange) + fan_of(parameters).count();
  }

  void ask(const Senses& senses, std::span<const double> values, Asker& asker) const override {
    if (!measures(senses, values)) return;
    const auto of = [&](Parameter place) { return at(senses.parameters, place); };
    const Eigen::Quaterniond body = senses.orientation();
    const Eigen::Vector3d from =
        senses.position() + lever_of(senses, body, Eigen::Vector3d(senses.parameters.data()));
    const Eigen::Quaterniond turn = body * mounting(senses, Parameter::kRoll);
    const auto mask = static_cast<std::uint32_t>(of(Parameter::kMask));
    const RayFan fan = fan_of(senses.parameters);
    const double least = least_of(senses);
    const BodyId through = body_or_own(senses, Parameter::kBody);
    for (std::size_t n = 0; n < fan.count(); ++n) {
      const Eigen::Vector3d direction = turn * fan.direction(n);
      asker.cast(from + least * direction, direction, of(Parameter::kMost) - least, 0, mask, through);
    }
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    if (!measures(senses, values)) return keep_measuring(senses, actor);
    keep_measuring(senses, actor, ticks_until_next(senses));
    const double most = at(senses.parameters, Parameter::kMost);
    const double noise = at(senses.parameters, Parameter::kNoise);
    double& hits = at(values, Value::kHits);
    double& nearest = at(values, Value::kNearest);
    hits = 0;
    nearest = most;
    const std::span<double> ranges = values.subspan(static_cast<std::size_t>(Value::kRange));
    for (std::uint32_t n = 0; n < ranges.size(); ++n) {
      double& range = ranges[n];
      range = most;
      const std::span<const ProgramFinding> found = senses.of(n);
      if (found.empty()) continue;
      hits += 1;
      range = least_of(senses) + found.front().distance;
      if (noise > 0) range = std::clamp(range + noise * normal(senses, n), 0.0, most);
      nearest = std::min(nearest, range);
    }
  }

 private:
  static std::size_t whole(double number) {
    return number >= 1 ? static_cast<std::size_t>(std::min(number, static_cast<double>(kRaysMax))) : 1;
  }
  static RayFan fan_of(std::span<const double> parameters) {
    const auto of = [&](Parameter place) { return parameter(parameters, place); };
    return {.rays = whole(of(Parameter::kRays)),
            .rows = whole(of(Parameter::kRows)),
            .heading = of(Parameter::kHeading),
            .angle = of(Parameter::kAngle),
            .elevation = of(Parameter::kElevation),
            .row_angle = of(Parameter::kRowAngle),
            .on_plane = of(Parameter::kPlane) >= 0.5};
  }
  static double least_of(const Senses& senses) {
    return std::min(at(senses.parameters, Parameter::kLeast), at(senses.parameters, Parameter::kMost));
  }
  // After a measurement.
  static std::uint64_t ticks_until_next(const Senses& senses) {
    const double rate = at(senses.parameters, Parameter::kRate);
    if (rate == 0) return 1;
    const auto until = [&](std::uint64_t tick) {
      return measurements_until(senses.body, senses.program, tick, senses.dt, rate);
    };
    constexpr std::uint64_t kTicksMax = 1'000'000'000;
    const double between = 1 / (rate * senses.dt);
    if (!(between < static_cast<double>(kTicksMax))) return kTicksMax;
    auto ticks = std::max(static_cast<std::uint64_t>(between), std::uint64_t{1});
    while (ticks < kTicksMax && until(senses.tick + ticks) == until(senses.tick)) ++ticks;
    return ticks;
  }
  // In the first tick, and whenever another measurement is due.
  static bool measures(const Senses& senses, std::span<const double> values) {
    const double rate = at(senses.parameters, Parameter::kRate);
    if (rate == 0 || at(values, Value::kNearest) == 0) return true;
    const auto until = [&](std::uint64_t tick) {
      return measurements_until(senses.body, senses.program, tick, senses.dt, rate);
    };
    return until(senses.tick) != until(senses.tick - 1);
  }
};

}  // namespace
}  // namespace ranger

const Program& ranger_program() {
  static const ranger::Ranger kRanger;
  return kRanger;
}

}  // namespace tessera
