// Floater: water for a body that is taken as a box: what it displaces lifts it, and water that it moves
// through holds it back. The box is cut into columns, so that it rights itself, rolls and pitches in waves.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "lpss/base/portable_math.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace floater {
namespace {

constexpr int kColumns = 5;          // along x, and along y
constexpr double kBalanced = 0.002;  // of gravity

enum class Parameter {
  kLevel,
  kDensity,
  kLength,
  kWidth,
  kHeight,
  kDrag,
  kDamping,
  kWave,
  kWavelength,
  kPeriod,
  kMiddle,
  kAir = kMiddle + 3
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"level", "m", 0, -1e4, 1e4, "Of the water at rest, above where the centre of mass started."},
    {"density", "kg/m^3", 1000, 0, 1e5, "Of the water."},
    {"length", "m", 1, 1e-3, 1e3, "Of the box, along the body's x axis."},
    {"width", "m", 1, 1e-3, 1e3, "Along its y axis."},
    {"height", "m", 1, 1e-3, 1e3, "Along its z axis."},
    {"drag", "", 1, 0, 100, "Its coefficient, by the area of the box that the way of the water meets."},
    {"damping", "1/s", 0.5, 0, 100,
     "Of slow motion, as a part of the mass of the displaced water that is lost in a second."},
    {"wave", "m", 0, 0, 100, "The height of waves along the world's x axis, from crest to trough."},
    {"wavelength", "m", 20, 0.1, 1e4, "From crest to crest."},
    {"period", "s", 4, 0.1, 1e3,
     "From one crest to the next at a place; one is where the body started at tick 0."},
    {"x", "m", 0, -1e3, 1e3,
     "Where the middle of the box is, from the centre of mass, along the body's x axis,"},
    {"y", "m", 0, -1e3, 1e3, "along its y axis,"},
    {"z", "m", 0, -1e3, 1e3, "and along its z axis."},
    {"air", "kg/m^3", 0, 0, 1e3, "The density of the air above the water."},
});

enum class Value { kDisplaced };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"displaced", "m^3", 0, 0, 0, "The water that it displaces."},
});

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

class Floater final : public Program {
 public:
  absl::string_view kind() const override { return "floater"; }
  absl::string_view summary() const override {
    return "Lets a body that is about a box float, and rock in waves.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    Lift lift;
    for (int i = 0; i < kColumns; ++i) {
      for (int j = 0; j < kColumns; ++j) add_column(senses, share_of(i), share_of(j), lift);
    }
    at(values, Value::kDisplaced) = lift.volume;
    const bool waves = parameter(senses, Parameter::kWave) > 0;
    // It does not fall asleep on its way to where it floats.
    const Eigen::Vector3d left = lift.force / senses.properties.mass + senses.gravity;
    if (waves || left.norm() > kBalanced * senses.gravity.norm()) {
      actor.push_awake(lift.force, lift.torque);
      if (waves) actor.wake_in(1);
    } else {
      actor.push(lift.force, lift.torque);
    }
  }

 private:
  struct Lift {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
    double volume = 0;  // m^3
  };

  // Of an edge of the box, from its middle: -0.4 to 0.4 of it.
  static double share_of(int n) { return (n + 0.5) / kColumns - 0.5; }

  // m, above where the body started, at `x` from there.
  static double level_at(const Senses& senses, double x) {
    const double height = parameter(senses, Parameter::kWave);
    const double level = parameter(senses, Parameter::kLevel);
    if (height == 0) return level;
    const double turns = x / parameter(senses, Parameter::kWavelength) -
                         static_cast<double>(senses.tick) * senses.dt / parameter(senses, Parameter::kPeriod);
    return level + height / 2 * portable::sincos(2 * std::numbers::pi * std::remainder(turns, 1.0)).cos;
  }

  static void add_column(const Senses& senses, double along, double across, Lift& lift) {
    const Eigen::Quaterniond turn = senses.orientation();
    const Eigen::Vector3d axis = turn * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d place(&at(senses.parameters, Parameter::kMiddle));
    const Eigen::Vector3d middle =
        turn * (place + Eigen::Vector3d(along * parameter(senses, Parameter::kLength),
                                        across * parameter(senses, Parameter::kWidth), 0));
    // In the middle of the tick that comes: a force from its beginning would give a swing more and more
    // energy.
    const Eigen::Vector3d way = (senses.velocity() + senses.angular_velocity().cross(middle)) * senses.dt / 2;
    const Eigen::Vector3d from_start = senses.position() + middle + way - senses.start;
    const double height = parameter(senses, Parameter::kHeight);
    // The column stands along the body's z axis; what of it is below the water, it displaces.
    const double upright = std::abs(axis.z());
    const double tall = std::max(height * upright, 1e-3 * height);
    const double depth = level_at(senses, from_start.x()) - from_start.z();  // of its middle
    const double wet = std::clamp(depth / tall + 0.5, 0.0, 1.0);
    const double area =
        parameter(senses, Parameter::kLength) * parameter(senses, Parameter::kWidth) / (kColumns * kColumns);
    const double side = axis.z() < 0 ? -1 : 1;
    const double air = parameter(senses, Parameter::kAir) * (1 - wet) * height * area;  // kg
    if (air > 0) add_lift(-air * senses.gravity, middle + side * axis * (height * wet / 2), lift);
    if (wet == 0) return;
    const double volume = wet * height * area;
    const double mass = volume * parameter(senses, Parameter::kDensity);
    const Eigen::Vector3d lever = middle - side * axis * (height * (1 - wet) / 2);
    const Eigen::Vector3d velocity = senses.velocity() + senses.angular_velocity().cross(lever);
    add_lift(-mass * senses.gravity + drag(senses, velocity, volume, mass), lever, lift);
    lift.volume += volume;
  }

  static void add_lift(const Eigen::Vector3d& force, const Eigen::Vector3d& lever, Lift& lift) {
    lift.force += force;
    lift.torque += lever.cross(force);
  }

  // It slows what moves, and never turns it round within a tick.
  static Eigen::Vector3d drag(const Senses& senses, const Eigen::Vector3d& velocity, double volume,
                              double mass) {
    const double speed = velocity.norm();
    if (speed == 0) return Eigen::Vector3d::Zero();
    // The area of a column that is met, for a cube of its volume.
    const double met = portable::pow(volume, 2.0 / 3);
    const double slow = parameter(senses, Parameter::kDamping) * mass;
    const double fast =
        0.5 * parameter(senses, Parameter::kDrag) * parameter(senses, Parameter::kDensity) * met * speed;
    const double most = senses.properties.mass / (kColumns * kColumns) / (2 * senses.dt);
    return -std::min(slow + fast, most) * velocity;
  }
};

}  // namespace
}  // namespace floater

const Program& floater_program() {
  static const floater::Floater kFloater;
  return kFloater;
}

}  // namespace tessera
