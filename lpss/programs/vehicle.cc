// Vehicle: a dynamic body on four wheels that are rays, with springs, tyres, an engine and brakes.
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
namespace vehicle {
namespace {

using wheels::Chassis;
using wheels::Suspension;
using wheels::Wheel;

enum class Parameter {
  kWheelbase,
  kTrack,
  kMount,
  kRadius,
  kTravel,
  kStiffness,
  kDamping,
  kGrip,
  kEngine,
  kBrake,
  kSpeed,
  kSteer,
  kSteerRate,
  kFrontDrive,
  kRearDrive,
  kRolling
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"wheelbase", "m", 2.6, 0.01, 100, "From the rear axle to the front axle, along the body's x axis."},
    {"track", "m", 1.5, 0.01, 100, "From the left wheels to the right ones, along its y axis."},
    {"mount", "m", 0, -100, 100, "How high the upper ends of the springs are above the centre of mass."},
    {"radius", "m", 0.3, 0.001, 10, "Of a wheel."},
    {"travel", "m", 0.4, 0.001, 10,
     "Of a spring, from its upper end to where the hub is while the wheel hangs."},
    {"stiffness", "N/m", 3e4, 0, kGainMax, "Of a spring."},
    {"damping", "N s/m", 3e3, 0, kGainMax, "Of a damper."},
    {"grip", "", 1, 0, 10, "Of a tyre: the coefficient of friction, in all directions."},
    {"engine_force", "N", 6e3, 0, kForceMax,
     "The greatest force of the engine on all driven wheels together."},
    {"brake_force", "N", 1e4, 0, kForceMax, "Of the brakes on each wheel."},
    {"speed", "m/s", 50, 0.01, 1e3, "From which on the engine does not push any more."},
    {"steer_angle", "rad", 0.6, 0, 1.5,
     "How far the front wheels turn, as seen in the middle of their axle."},
    {"steer_rate", "rad/s", 1.5, 0.001, 100, "How fast they turn."},
    {"front_drive", "", 0, 0, 1, "1: the front wheels are driven,"},
    {"rear_drive", "", 1, 0, 1, "and the rear ones."},
    {"rolling", "", 0.012, 0, 1, "Rolling resistance, as a part of what a wheel bears."},
});

enum class Input { kThrottle, kBrake, kSteer };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"throttle", "", 0, -1, 1, "Of the engine's force; below 0 it pushes back."},
    {"brake", "", 0, 0, 1, "Of the brakes' force."},
    {"steer", "", 0, -1, 1, "Of the largest angle; above 0 to the left."},
});

enum class Value { kSpeed, kSteer, kOnGround, kSpring };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, 0, 0, "Forwards, over what it stands on."},
    {"angle", "rad", 0, 0, 0, "Of the front wheels, in the middle of their axle; to the left."},
    {"wheels_on_ground", "", 0, 0, 0, "How many."},
    {"spring_0", "m", 0, 0, 0, "How far the spring of the left front wheel is compressed,"},
    {"spring_1", "m", 0, 0, 0, "of the right front wheel,"},
    {"spring_2", "m", 0, 0, 0, "of the left rear wheel,"},
    {"spring_3", "m", 0, 0, 0, "and of the right rear wheel."},
});

constexpr std::size_t kWheels = 4;

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }
double input(const Senses& senses, Input place) { return at(senses.inputs, place); }

Suspension suspension_of(const Senses& senses) {
  return {parameter(senses, Parameter::kRadius), parameter(senses, Parameter::kTravel),
          parameter(senses, Parameter::kStiffness), parameter(senses, Parameter::kDamping)};
}

class Vehicle final : public Program {
 public:
  absl::string_view kind() const override { return "vehicle"; }
  absl::string_view summary() const override {
    return "Four wheels with springs and tyres for a body whose x axis points forwards and whose z axis "
           "points up.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    for (std::size_t n = 0; n < kWheels; ++n)
      wheels::ask(senses, suspension_of(senses), mount_of(senses, n), asker);
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    steer(senses, values);
    Chassis chassis(senses);
    std::array<Wheel, kWheels> wheels;
    for (std::size_t n = 0; n < kWheels; ++n) {
      const auto [sin, cos] = portable::sincos(angle_of(senses, values, n));
      wheels[n] = wheels::wheel_at(senses, chassis, suspension_of(senses), static_cast<std::uint32_t>(n),
                                   {cos, sin, 0});
      values[static_cast<std::size_t>(Value::kSpring) + n] = wheels[n].compressed;
      if (wheels[n].ground != nullptr) drive(senses, wheels[n]);
    }
    at(values, Value::kOnGround) = wheels::on_ground(wheels);
    at(values, Value::kSpeed) = wheels::speed_over_ground(senses, wheels);
    wheels::solve(chassis, wheels, parameter(senses, Parameter::kGrip));
    wheels::act(senses, chassis, wheels, input(senses, Input::kThrottle) != 0, actor);
  }

 private:
  // In the body frame, from the centre of mass: left and right in front, then behind.
  static Eigen::Vector3d mount_of(const Senses& senses, std::size_t n) {
    return {(n < 2 ? 0.5 : -0.5) * parameter(senses, Parameter::kWheelbase),
            (n % 2 == 0 ? 0.5 : -0.5) * parameter(senses, Parameter::kTrack),
            parameter(senses, Parameter::kMount)};
  }

  static void steer(const Senses& senses, std::span<double> values) {
    double& angle = at(values, Value::kSteer);
    const double wanted = input(senses, Input::kSteer) * parameter(senses, Parameter::kSteer);
    const double most = parameter(senses, Parameter::kSteerRate) * senses.dt;
    angle += std::clamp(wanted - angle, -most, most);
  }

  // Ackermann: all wheels turn about one point beside the rear axle.
  static double angle_of(const Senses& senses, std::span<const double> values, std::size_t n) {
    const double middle = at(values, Value::kSteer);
    if (n >= 2 || middle == 0) return 0;
    const auto [sin, cos] = portable::sincos(middle);
    const double wheelbase = parameter(senses, Parameter::kWheelbase);
    const double to_centre = wheelbase * cos / sin - mount_of(senses, n).y();
    const double angle = portable::atan2(wheelbase, std::abs(to_centre));
    return to_centre < 0 ? -angle : angle;
  }

  static void drive(const Senses& senses, Wheel& wheel) {
    const bool front = wheel.lever.dot(senses.orientation() * Eigen::Vector3d::UnitX()) > 0;
    const double fronts = parameter(senses, Parameter::kFrontDrive) >= 0.5 ? 2 : 0;
    const double rears = parameter(senses, Parameter::kRearDrive) >= 0.5 ? 2 : 0;
    const double driven = front ? fronts : rears;
    wheels::drive(senses,
                  {.throttle = input(senses, Input::kThrottle),
                   .engine = driven > 0 ? parameter(senses, Parameter::kEngine) / (fronts + rears) : 0,
                   .speed = parameter(senses, Parameter::kSpeed),
                   .brake = input(senses, Input::kBrake) * parameter(senses, Parameter::kBrake),
                   .grip = parameter(senses, Parameter::kGrip),
                   .rolling = parameter(senses, Parameter::kRolling)},
                  wheel);
  }
};

}  // namespace
}  // namespace vehicle

const Program& vehicle_program() {
  static const vehicle::Vehicle kVehicle;
  return kVehicle;
}

}  // namespace tessera
