// Tracks: two drives, of any number of wheels a side that run alike, as those of a tank or of a robot whose
// wheels do not steer.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/wheels.h"

namespace tessera {
namespace tracks {
namespace {

using wheels::Chassis;
using wheels::Suspension;
using wheels::Wheel;

enum class Parameter {
  kWheels,
  kLength,
  kWidth,
  kMount,
  kRadius,
  kTravel,
  kStiffness,
  kDamping,
  kGrip,
  kForce,
  kSpeed
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"wheels", "", 4, 2, 16, "On each side."},
    {"length", "m", 3, 0.01, 100, "From the last wheel to the first one, along the body's x axis."},
    {"width", "m", 2, 0.01, 100, "From the left wheels to the right ones, along its y axis."},
    {"mount", "m", 0, -100, 100, "How high the upper ends of the springs are above the centre of mass."},
    {"radius", "m", 0.3, 0.001, 10, "Of a wheel."},
    {"travel", "m", 0.3, 0.001, 10,
     "Of a spring, from its upper end to where the hub is while the wheel hangs."},
    {"stiffness", "N/m", 3e4, 0, kGainMax, "Of a spring."},
    {"damping", "N s/m", 3e3, 0, kGainMax, "Of a damper."},
    {"grip", "", 0.8, 0, 10, "The coefficient of friction, in all directions."},
    {"force", "N", 1e4, 0, kForceMax, "The greatest force of a side, by which it drives and brakes."},
    {"speed", "m/s", 8, 0.01, 1e3, "Of a side at full throttle."},
});

enum class Input { kThrottle, kTurn };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"throttle", "", 0, -1, 1, "Of the speed, of both sides; below 0 backwards."},
    {"turn", "", 0, -1, 1,
     "Of the speed, by which the right side is faster and the left one slower: above 0 to the left."},
});

enum class Value { kSpeed, kTurn, kOnGround };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, 0, 0, "Forwards, over what it stands on."},
    {"turn", "rad/s", 0, 0, 0, "About the body's z axis; to the left."},
    {"wheels_on_ground", "", 0, 0, 0, "How many."},
});

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }
double input(const Senses& senses, Input place) { return at(senses.inputs, place); }

Suspension suspension_of(const Senses& senses) {
  return {parameter(senses, Parameter::kRadius), parameter(senses, Parameter::kTravel),
          parameter(senses, Parameter::kStiffness), parameter(senses, Parameter::kDamping)};
}

std::size_t wheels_of(const Senses& senses) {
  return 2 * static_cast<std::size_t>(parameter(senses, Parameter::kWheels));
}

class Tracks final : public Program {
 public:
  absl::string_view kind() const override { return "tracks"; }
  absl::string_view summary() const override {
    return "Two rows of wheels with springs, which turn the body by their difference: a tank, a robot.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    for (std::size_t n = 0; n < wheels_of(senses); ++n)
      wheels::ask(senses, suspension_of(senses), mount_of(senses, n), asker);
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    Chassis chassis(senses);
    std::vector<Wheel> wheels(wheels_of(senses));
    for (std::size_t n = 0; n < wheels.size(); ++n) {
      wheels[n] = wheels::wheel_at(senses, chassis, suspension_of(senses), static_cast<std::uint32_t>(n),
                                   Eigen::Vector3d::UnitX());
    }
    drive(senses, wheels);
    at(values, Value::kOnGround) = wheels::on_ground(wheels);
    at(values, Value::kSpeed) = wheels::speed_over_ground(senses, wheels);
    at(values, Value::kTurn) = senses.angular_velocity().dot(senses.orientation() * Eigen::Vector3d::UnitZ());
    wheels::solve(chassis, wheels, parameter(senses, Parameter::kGrip));
    const bool is_driven = input(senses, Input::kThrottle) != 0 || input(senses, Input::kTurn) != 0;
    wheels::act(senses, chassis, wheels, is_driven, actor);
  }

 private:
  // In the body frame, from the centre of mass: left and right, from the front to the rear.
  static Eigen::Vector3d mount_of(const Senses& senses, std::size_t n) {
    const std::size_t row = n / 2;
    const std::size_t last = wheels_of(senses) / 2 - 1;
    const double behind = static_cast<double>(row) / static_cast<double>(last);
    return {(0.5 - behind) * parameter(senses, Parameter::kLength),
            (n % 2 == 0 ? 0.5 : -0.5) * parameter(senses, Parameter::kWidth),
            parameter(senses, Parameter::kMount)};
  }

  // The force of a side goes to its wheels by what they bear.
  static void drive(const Senses& senses, std::span<Wheel> wheels) {
    std::array<double, 2> loads{};
    for (std::size_t n = 0; n < wheels.size(); ++n) loads[n % 2] += wheels[n].load;
    for (std::size_t n = 0; n < wheels.size(); ++n) {
      const double turn = (n % 2 == 0 ? -1 : 1) * input(senses, Input::kTurn);
      wheels[n].running = std::clamp(input(senses, Input::kThrottle) + turn, -1.0, 1.0) *
                          parameter(senses, Parameter::kSpeed);
      if (wheels[n].load > 0)
        wheels[n].brake = parameter(senses, Parameter::kForce) * senses.dt * wheels[n].load / loads[n % 2];
      wheels[n].slides = true;
    }
  }
};

}  // namespace
}  // namespace tracks

const Program& tracks_program() {
  static const tracks::Tracks kTracks;
  return kTracks;
}

}  // namespace tessera
