// Motorcycle: a dynamic body on two wheels that are rays, one behind the other, which its rider balances.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/wheels.h"

namespace tessera {
namespace motorcycle {
namespace {

using Eigen::Vector3d;
using wheels::Chassis;
using wheels::Suspension;
using wheels::Wheel;

enum class Parameter {
  kWheelbase,
  kMount,
  kRadius,
  kTravel,
  kStiffness,
  kDamping,
  kGrip,
  kEngine,
  kFrontBrake,
  kRearBrake,
  kSpeed,
  kSteer,
  kSteerRate,
  kLean,
  kBalance,
  kRolling
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"wheelbase", "m", 1.4, 0.01, 100, "From the rear wheel to the front wheel, along the body's x axis."},
    {"mount", "m", 0, -100, 100, "How high the upper ends of the springs are above the centre of mass."},
    {"radius", "m", 0.3, 0.001, 10, "Of a wheel."},
    {"travel", "m", 0.3, 0.001, 10,
     "Of a spring, from its upper end to where the hub is while the wheel hangs."},
    {"stiffness", "N/m", 1.5e4, 0, kGainMax, "Of a spring."},
    {"damping", "N s/m", 1.5e3, 0, kGainMax, "Of a damper."},
    {"grip", "", 1, 0, 10, "Of a tyre: the coefficient of friction, in all directions."},
    {"engine_force", "N", 1e3, 0, kForceMax, "The greatest force of the engine, on the rear wheel."},
    {"front_brake", "N", 1e3, 0, kForceMax, "Of the brake of the front wheel,"},
    {"rear_brake", "N", 1e3, 0, kForceMax, "and of the rear one."},
    {"speed", "m/s", 50, 0.01, 1e3, "From which on the engine does not push any more."},
    {"steer_angle", "rad", 0.6, 0, 1.5, "How far the front wheel turns, where it is slow enough for that."},
    {"steer_rate", "rad/s", 1.5, 0.001, 100, "How fast it turns."},
    {"lean", "rad", 0.7, 0, 1.2, "How far it leans at most: the faster it is, the less it steers."},
    {"balance", "rad/s", 8, 0, 100,
     "How fast the rider brings it to the lean of its turn; 0: nobody balances it."},
    {"rolling", "", 0.015, 0, 1, "Rolling resistance, as a part of what a wheel bears."},
});

enum class Input { kThrottle, kBrake, kSteer };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"throttle", "", 0, -1, 1, "Of the engine's force; below 0 it pushes back."},
    {"brake", "", 0, 0, 1, "Of the brakes' forces."},
    {"steer", "", 0, -1, 1, "Of the largest angle; above 0 to the left."},
});

enum class Value { kSpeed, kAngle, kLean, kOnGround };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, 0, 0, "Forwards, over what it stands on."},
    {"angle", "rad", 0, 0, 0, "Of the front wheel; to the left."},
    {"lean", "rad", 0, 0, 0, "To the left."},
    {"wheels_on_ground", "", 0, 0, 0, "How many."},
});

constexpr std::size_t kWheels = 2;  // the front one, and the rear one
constexpr double kFallen = 1.3;     // rad; beyond it nobody balances it any more

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }
double input(const Senses& senses, Input place) { return at(senses.inputs, place); }

Suspension suspension_of(const Senses& senses) {
  return {parameter(senses, Parameter::kRadius), parameter(senses, Parameter::kTravel),
          parameter(senses, Parameter::kStiffness), parameter(senses, Parameter::kDamping)};
}

class Motorcycle final : public Program {
 public:
  absl::string_view kind() const override { return "motorcycle"; }
  absl::string_view summary() const override {
    return "Two wheels with springs and tyres, one behind the other, and a rider who balances them.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    for (std::size_t n = 0; n < kWheels; ++n) {
      const double along = (n == 0 ? 0.5 : -0.5) * parameter(senses, Parameter::kWheelbase);
      wheels::ask(senses, suspension_of(senses), {along, 0, parameter(senses, Parameter::kMount)}, asker);
    }
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    steer(senses, values);
    Chassis chassis(senses);
    std::array<Wheel, kWheels> wheels;
    for (std::size_t n = 0; n < kWheels; ++n) {
      const auto [sin, cos] = portable::sincos(n == 0 ? at(values, Value::kAngle) : 0);
      wheels[n] = wheels::wheel_at(senses, chassis, suspension_of(senses), static_cast<std::uint32_t>(n),
                                   {cos, sin, 0});
      if (wheels[n].ground == nullptr) continue;
      // A wheel that leans rolls along the line in which its plane meets the ground.
      const Vector3d axle = senses.orientation() * Vector3d(-sin, cos, 0);
      wheels[n].forward = axle.cross(wheels[n].normal).normalized();
      wheels[n].left = wheels[n].normal.cross(wheels[n].forward);
      drive(senses, n == 0, wheels[n]);
    }
    at(values, Value::kOnGround) = wheels::on_ground(wheels);
    at(values, Value::kSpeed) = wheels::speed_over_ground(senses, wheels);
    const std::optional<double> leans = leaning(senses, values);
    if (leans) hold_upright(senses, chassis);
    wheels::solve(chassis, wheels, parameter(senses, Parameter::kGrip));
    if (leans) lean(senses, *leans, chassis);
    wheels::act(senses, chassis, wheels, input(senses, Input::kThrottle) != 0, actor);
  }

 private:
  // Leaning, it turns on the radius r = wheelbase cos(lean) / tan(angle), where speed^2 / r = g tan(lean): so
  // sin(lean) = speed^2 tan(angle) / (g wheelbase).
  static void steer(const Senses& senses, std::span<double> values) {
    const double speed = at(values, Value::kSpeed);
    const double g = senses.gravity.norm();
    const double wheelbase = parameter(senses, Parameter::kWheelbase);
    const double sin = portable::sincos(parameter(senses, Parameter::kLean)).sin;
    const double most = portable::atan2(sin * g * wheelbase, speed * speed);
    const double wanted =
        std::clamp(input(senses, Input::kSteer) * parameter(senses, Parameter::kSteer), -most, most);
    const double step = parameter(senses, Parameter::kSteerRate) * senses.dt;
    double& angle = at(values, Value::kAngle);
    angle += std::clamp(wanted - angle, -step, step);
  }

  static void drive(const Senses& senses, bool is_front, Wheel& wheel) {
    const double brake = parameter(senses, is_front ? Parameter::kFrontBrake : Parameter::kRearBrake);
    wheels::drive(senses,
                  {.throttle = input(senses, Input::kThrottle),
                   .engine = is_front ? 0 : parameter(senses, Parameter::kEngine),
                   .speed = parameter(senses, Parameter::kSpeed),
                   .brake = input(senses, Input::kBrake) * brake,
                   .grip = parameter(senses, Parameter::kGrip),
                   .rolling = parameter(senses, Parameter::kRolling)},
                  wheel);
  }

  // By how much the rider changes how fast it leans to the left (rad/s), as a damped spring does between it
  // and the lean at which gravity and what it bears to the side are one force through its wheels; implicit,
  // so that it is stable. Nothing where nobody balances it.
  static std::optional<double> leaning(const Senses& senses, std::span<double> values) {
    const double g = senses.gravity.norm();
    const double rate = parameter(senses, Parameter::kBalance);
    if (!(g > 0)) return std::nullopt;
    const Vector3d up = -senses.gravity / g;
    const Eigen::Quaterniond turn = senses.orientation();
    double& lean = at(values, Value::kLean);
    lean = portable::atan2(-(turn * Vector3d::UnitY()).dot(up), (turn * Vector3d::UnitZ()).dot(up));
    if (rate == 0 || at(values, Value::kOnGround) == 0 || std::abs(lean) > kFallen) return std::nullopt;
    const auto [sin, cos] = portable::sincos(at(values, Value::kAngle));
    const double speed = at(values, Value::kSpeed);
    const double bears = speed * std::abs(speed) * sin / cos / (g * parameter(senses, Parameter::kWheelbase));
    const double wanted = portable::asin(std::clamp(bears, -1.0, 1.0));
    const double now = -senses.angular_velocity().dot(turn * Vector3d::UnitX());
    const double step = rate * senses.dt;
    return step * (rate * (wanted - lean) - (step + 2) * now) / ((1 + step) * (1 + step));
  }

  // The rider takes what the wheels would turn it by about the way that it goes: where it leans as it should,
  // that is nothing.
  static void hold_upright(const Senses& senses, Chassis& chassis) {
    const Vector3d forward = senses.orientation() * Vector3d::UnitX();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - forward * forward.transpose();
    chassis.mobility = across * chassis.mobility * across;
  }

  static void lean(const Senses& senses, double by, Chassis& chassis) {
    const Vector3d forward = senses.orientation() * Vector3d::UnitX();
    const double inertia = 1 / forward.dot(Chassis(senses).mobility * forward);
    chassis.spin -= forward * (chassis.spin.dot(forward) + inertia * by);
  }
};

}  // namespace
}  // namespace motorcycle

const Program& motorcycle_program() {
  static const motorcycle::Motorcycle kMotorcycle;
  return kMotorcycle;
}

}  // namespace tessera
