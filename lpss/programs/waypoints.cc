// Waypoints: takes a body over the ground from place to place, by a force ahead and a torque that turns it.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "lpss/base/portable_math.h"
#include "lpss/programs/body_inertia.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace waypoints {
namespace {

constexpr std::size_t kPlacesMax = 64;
constexpr double kWayMost = 1e7;                            // m
constexpr double kStraight = 0.1 * std::numbers::pi / 180;  // rad: a bearing that counts as straight ahead

enum class Parameter {
  kCount,
  kLoop,
  kForce,
  kTorque,
  kRange,
  kBearing,
  kHold,
  kAxes,
  kFrom,
  kX = 10,
  kY = 74
};

// "x_0" to the last one that there may be, and likewise for y.
std::span<const NumberSpec> parameter_table() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const char* axis : {"x_", "y_"}) {
      for (std::size_t n = 0; n < kPlacesMax; ++n) names.push_back(absl::StrCat(axis, n));
    }
    return names;
  }();
  static const std::vector<NumberSpec> kTable = [] {
    std::vector<NumberSpec> table = {
        {"count", "", 0, 0, static_cast<double>(kPlacesMax), "How many places it goes to."},
        {"loop", "", 0, 0, 1, "1: after the last place, it goes to the first one again."},
        {"force", "N", 60, 0, 1e9, "It pushes its body ahead, along the body's x axis,"},
        {"torque", "N m", 50, 0, 1e9, "and turns it about the body's z axis."},
        {"range", "m", 0.5, 1e-3, 1e4, "It has reached a place that is no farther away than this."},
        {"bearing", "rad", 0.0349, 1e-4, std::numbers::pi,
         "It pushes if the next place is no farther to a side than this; otherwise it turns."},
        {"hold", "", 0, 0, 1, "1: it stops turning once the next place is straight ahead."},
        {"axes", "", 0, 0, 2,
         "Places are along the world's axes: 0 from the point where the body started at `from_x`, `from_y`; "
         "1 "
         "from where it started. 2: from there, along the axes of its first heading."},
        {"from_x", "m", 0, -kWayMost, kWayMost, "Where the body started, along the world's x axis,"},
        {"from_y", "m", 0, -kWayMost, kWayMost, "and its y axis."},
    };
    for (std::size_t n = 0; n < 2 * kPlacesMax; ++n) {
      table.push_back({kNames[n], "m", 0, -kWayMost, kWayMost,
                       n < kPlacesMax ? "The places: along the x axis," : "and along the y axis."});
    }
    return table;
  }();
  return kTable;
}

enum class Input { kPaused };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"paused", "", 0, 0, 1, "1: it does nothing."},
});

enum class Value { kNext, kDistance, kBearing, kHeading, kRuns, kHolds };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"next", "", 0, 0, 0, "The place that it goes to, or has reached as the last one; the first one is 0."},
    {"distance", "m", 0, 0, 0, "Of its centre of mass from there, along the ground."},
    {"bearing", "rad", 0, 0, 0, "How far to the left of its x axis that place is."},
    {"heading", "rad", 0, 0, 0, "Its first heading, from the world's x axis to the left."},
    {"runs", "", 0, 0, 0, "1 once it has run."},
    {"holds", "", 0, 0, 0, "1 while it keeps its body from turning."},
});

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

class Waypoints final : public Program {
 public:
  absl::string_view kind() const override { return "waypoints"; }
  absl::string_view summary() const override {
    return "Takes its body over the ground from place to place: it turns it towards the next one, and "
           "pushes.";
  }
  std::span<const NumberSpec> parameters() const override { return parameter_table(); }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const auto count = static_cast<std::size_t>(parameter(senses, Parameter::kCount));
    if (count == 0 || at(senses.inputs, Input::kPaused) >= 0.5) return;
    if (at(values, Value::kRuns) == 0) {
      const Eigen::Vector3d ahead = senses.orientation() * Eigen::Vector3d::UnitX();
      at(values, Value::kHeading) = portable::atan2(ahead.y(), ahead.x());
      at(values, Value::kRuns) = 1;
    }
    auto next = std::min(static_cast<std::size_t>(at(values, Value::kNext)), count - 1);
    Eigen::Vector3d way = way_to(senses, values, next);
    if (way.norm() <= parameter(senses, Parameter::kRange)) {
      const bool loops = parameter(senses, Parameter::kLoop) >= 0.5;
      next = loops ? (next + 1) % count : std::min(next + 1, count - 1);
      way = way_to(senses, values, next);
    }
    at(values, Value::kNext) = static_cast<double>(next);
    at(values, Value::kDistance) = way.norm();
    const Eigen::Vector3d seen = senses.orientation().conjugate() * way;
    at(values, Value::kBearing) = portable::atan2(seen.y(), seen.x());
    if (way.norm() > parameter(senses, Parameter::kRange)) go(senses, values, actor);
  }

 private:
  // Along the ground, to a place from where the centre of mass is.
  static Eigen::Vector3d way_to(const Senses& senses, std::span<const double> values, std::size_t place) {
    const double* const x = &at(senses.parameters, Parameter::kX);
    const double* const y = &at(senses.parameters, Parameter::kY);
    const double axes = parameter(senses, Parameter::kAxes);
    Eigen::Vector3d from_start(x[place], y[place], 0);
    if (axes < 0.5) {
      const double* const from = &at(senses.parameters, Parameter::kFrom);
      from_start -= Eigen::Vector3d(from[0], from[1], 0);
    } else if (axes >= 1.5) {
      const auto [sin, cos] = portable::sincos(at(values, Value::kHeading));
      from_start = {cos * x[place] - sin * y[place], sin * x[place] + cos * y[place], 0};
    }
    Eigen::Vector3d way = from_start - (senses.position() - senses.start);
    way.z() = 0;
    return way;
  }

  static void go(const Senses& senses, std::span<double> values, Actor& actor) {
    const Eigen::Quaterniond turn = senses.orientation();
    const Eigen::Matrix3d inertia = body_inertia(senses.properties);
    const Eigen::Vector3d spin = turn.conjugate() * senses.angular_velocity();
    const double bearing = at(values, Value::kBearing);
    double& holds = at(values, Value::kHolds);
    if (std::abs(bearing) > parameter(senses, Parameter::kBearing)) {
      holds = 0;
      // Not more than what takes it there within a tick.
      const double side = bearing > 0 ? 1 : -1;
      const double enough = inertia(2, 2) * (bearing / senses.dt - spin.z()) / senses.dt;
      const double torque = side * std::clamp(side * enough, 0.0, parameter(senses, Parameter::kTorque));
      return actor.push_awake(Eigen::Vector3d::Zero(), turn * Eigen::Vector3d(0, 0, torque));
    }
    const bool is_straight = std::abs(bearing) <= std::max(kStraight, std::abs(spin.z()) * senses.dt);
    if (parameter(senses, Parameter::kHold) >= 0.5 && is_straight) holds = 1;
    const Eigen::Vector3d torque = holds == 1 ? Eigen::Vector3d(-(inertia * spin) / senses.dt)
                                              : Eigen::Vector3d(Eigen::Vector3d::Zero());
    actor.push_awake(turn * Eigen::Vector3d(parameter(senses, Parameter::kForce), 0, 0), turn * torque);
  }
};

}  // namespace
}  // namespace waypoints

const Program& waypoints_program() {
  static const waypoints::Waypoints kWaypoints;
  return kWaypoints;
}

}  // namespace tessera
