// Wing: lift and drag of an aerofoil, such as a wing, a fin, a sail or a parachute.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "lpss/base/portable_math.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/places.h"

namespace tessera {
namespace wing {
namespace {

enum class Parameter {
  kX,
  kY,
  kZ,
  kRoll,
  kArea,
  kSlope,
  kZeroLift,
  kStall,
  kDrag,
  kInduced,
  kDensity,
  kTurn,
  kRise,
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m", 0, -1e3, 1e3, "Where the air pushes, in the body frame,"},
    {"y", "m", 0, -1e3, 1e3, "along its y axis,"},
    {"z", "m", 0, -1e3, 1e3, "and along its z axis."},
    {"roll", "rad", 0, -7, 7, "Of its upper side, about the chord: 0 is upwards; pi / 2 is a fin."},
    {"area", "m^2", 1, 0, 1e6, "Seen from above."},
    {"slope", "1/rad", 6.28, 0, 100, "By which the lift coefficient grows with the angle of attack."},
    {"zero_lift", "rad", 0, -1, 1, "The angle of attack without lift; below 0 for what is cambered."},
    {"stall", "rad", 0.26, 0, 1.5, "From there on, both ways, it is as a flat plate."},
    {"drag", "", 0.02, 0, 100, "Its coefficient without lift."},
    {"induced", "", 0.06, 0, 100, "What the square of the lift coefficient adds to it: 1 / (pi e aspect)."},
    {"density", "kg/m^3", 1.2, 0, 1e5, "Of the air."},
    {"turn", "rad", 0, -7, 7,
     "Where the chord points, forwards: turned from the body's x axis towards its y axis,"},
    {"rise", "rad", 0, -7, 7, "and from there towards its z axis."},
});

enum class Input { kDeflection, kWindX, kWindY, kWindZ };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"deflection", "rad", 0, -1.5, 1.5, "Of a flap or rudder: as much is added to the angle of attack."},
    {"wind_x", "m/s", 0, -1e3, 1e3, "Of the air, along the world's x axis,"},
    {"wind_y", "m/s", 0, -1e3, 1e3, "its y axis,"},
    {"wind_z", "m/s", 0, -1e3, 1e3, "and its z axis."},
});

enum class Value { kAngle, kLift, kDrag };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"angle", "rad", 0, 0, 0, "The angle of attack, deflection included."},
    {"lift", "N", 0, 0, 0, "Across the way of the air."},
    {"drag", "N", 0, 0, 0, "Along it."},
});

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

struct Coefficients {
  double lift = 0;
  double drag = 0;
};

Coefficients coefficients_at(const Senses& senses, double angle) {
  const double drag = parameter(senses, Parameter::kDrag);
  if (std::abs(angle) <= parameter(senses, Parameter::kStall)) {
    const double lift =
        parameter(senses, Parameter::kSlope) * (angle - parameter(senses, Parameter::kZeroLift));
    return {lift, drag + parameter(senses, Parameter::kInduced) * lift * lift};
  }
  const auto [sin, cos] = portable::sincos(angle);
  return {2 * sin * cos, drag + 2 * sin * sin};
}

class Wing final : public Program {
 public:
  absl::string_view kind() const override { return "wing"; }
  absl::string_view summary() const override {
    return "Gives its body the lift and drag of an aerofoil: a wing, a fin, a sail, a parachute.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const Eigen::Quaterniond turn = senses.orientation();
    const Eigen::Vector3d place(senses.parameters.data());
    const Eigen::Vector3d lever = lever_of(senses, turn, place);
    const Axes axes = axes_of(senses);
    const Eigen::Vector3d chord = turn * axes.chord;
    const Eigen::Vector3d up = turn * axes.up;
    const Eigen::Vector3d wind(senses.inputs.data() + static_cast<std::size_t>(Input::kWindX));
    const Eigen::Vector3d through_air = senses.velocity() + senses.angular_velocity().cross(lever) - wind;
    // What goes along the span does nothing.
    const double forwards = through_air.dot(chord);
    const double upwards = through_air.dot(up);
    const double speed = std::sqrt(forwards * forwards + upwards * upwards);
    at(values, Value::kAngle) = at(values, Value::kLift) = at(values, Value::kDrag) = 0;
    if (speed == 0) return;
    const double angle = portable::atan2(-upwards, forwards) + at(senses.inputs, Input::kDeflection);
    const Coefficients coefficients = coefficients_at(senses, angle);
    const double pressure = parameter(senses, Parameter::kDensity) / 2 * speed * speed;
    const double area = pressure * parameter(senses, Parameter::kArea);
    const double drag = std::min(area * coefficients.drag, stopping(senses, speed));
    const double lift = area * coefficients.lift;
    at(values, Value::kAngle) = angle;
    at(values, Value::kLift) = lift;
    at(values, Value::kDrag) = drag;
    const Eigen::Vector3d way = (forwards * chord + upwards * up) / speed;
    const Eigen::Vector3d across = (forwards * up - upwards * chord) / speed;
    const Eigen::Vector3d force = lift * across - drag * way;
    actor.push(force, lever.cross(force));
  }

 private:
  struct Axes {
    Eigen::Vector3d chord;  // forwards
    Eigen::Vector3d up;
  };
  // In the body frame.
  static Axes axes_of(const Senses& senses) {
    const auto [sin, cos] = portable::sincos(parameter(senses, Parameter::kRoll));
    const auto [turn_sin, turn_cos] = portable::sincos(parameter(senses, Parameter::kTurn));
    const auto [rise, flat] = portable::sincos(parameter(senses, Parameter::kRise));
    const Eigen::Vector3d up(-rise * cos, -sin, flat * cos);  // before it turns
    return {{flat * turn_cos, flat * turn_sin, rise},
            {turn_cos * up.x() - turn_sin * up.y(), turn_sin * up.x() + turn_cos * up.y(), up.z()}};
  }
  // N: more would turn the way of the body round within a tick.
  static double stopping(const Senses& senses, double speed) {
    return senses.properties.mass * speed / senses.dt;
  }
};

}  // namespace
}  // namespace wing

const Program& wing_program() {
  static const wing::Wing kWing;
  return kWing;
}

}  // namespace tessera
