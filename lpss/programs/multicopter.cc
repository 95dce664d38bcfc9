// Multicopter: flies its body by the thrust of rotors along its z axis. It leans to where it has to
// accelerate, as T. Lee, M. Leok and N. H. McClamroch do (Geometric tracking control of a quadrotor UAV on
// SE(3), 2010), with velocities in place of positions.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "lpss/programs/body_inertia.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/motion_profile.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace multicopter {
namespace {

enum class Parameter {
  kThrust,
  kTorque,
  kTurnTorque,
  kLoad,
  kLean,
  kAcceleration,
  kGain,
  kTurnGain,
  kRateGain
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"thrust", "N", 100, 0, kForceMax, "The greatest of all rotors, along the body's z axis."},
    {"torque", "N m", 10, 0, kTorqueMax, "The greatest by which they lean the body,"},
    {"turn_torque", "N m", 1, 0, kTorqueMax, "and by which they turn it about its z axis."},
    {"load", "kg", 0, 0, 1e9, "What it bears beside its own mass: rotors, a load."},
    {"lean", "rad", 0.5, 0, 1.5, "The greatest."},
    {"acceleration", "m/s^2", 3, 1e-6, 1e4, "By which it changes its velocity."},
    {"gain", "1/s", 2, 0, 100, "The acceleration by the error of the velocity."},
    {"turn_gain", "1/s", 6, 0, 100, "The rate of turn by the error of the lean."},
    {"rate_gain", "1/s", 20, 0, 1e3, "The acceleration of the turn by the error of that rate."},
});

enum class Input { kVelocity, kTurn = 3, kOn };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"x", "m/s", 0, -100, 100, "The velocity, level and forwards: to where the body's x axis points;"},
    {"y", "m/s", 0, -100, 100, "level and to the left;"},
    {"z", "m/s", 0, -100, 100, "and upwards."},
    {"turn", "rad/s", 0, -100, 100, "The rate of turn about the vertical; above 0 to the left."},
    {"on", "", 1, 0, 1, "1: its rotors run; 0: they stand."},
});

enum class Value { kReached, kSums = 3, kThrust = 6, kLean };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"x", "m/s", 0, 0, 0, "What it has come to of its input,"},
    {"y", "m/s", 0, 0, 0, "likewise,"},
    {"z", "m/s", 0, 0, 0, "likewise."},
    {"learnt_x", "m/s^2", 0, 0, 0, "What wind and loads take from it, along the world's x axis,"},
    {"learnt_y", "m/s^2", 0, 0, 0, "its y axis,"},
    {"learnt_z", "m/s^2", 0, 0, 0, "and its z axis."},
    {"thrust", "N", 0, 0, 0, "Of all rotors in the tick that comes."},
    {"lean", "rad", 0, 0, 0, "Of the body's z axis from the vertical."},
});

using Vector = Eigen::Vector3d;

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

class Multicopter final : public Program {
 public:
  absl::string_view kind() const override { return "multicopter"; }
  absl::string_view summary() const override {
    return "Flies its body, with the velocity that it is told, by the thrust of rotors along its z axis.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const Eigen::Quaterniond turn = senses.orientation();
    const Vector up = senses.up();
    const Vector own_up = turn * Vector::UnitZ();
    const Vector forwards = turn * Vector::UnitX();
    at(values, Value::kLean) = portable::atan2(up.cross(own_up).norm(), up.dot(own_up));
    at(values, Value::kThrust) = 0;
    if (at(senses.inputs, Input::kOn) < 0.5) return;
    // Of the axes that it is told velocities along; a body whose x axis is upright has none.
    const Vector left = up.cross(forwards).stableNormalized();
    const Goal goal = next_goal(senses, values, up, left);
    const Vector thrust = wanted_thrust(senses, values, up, goal);
    const double most = parameter(senses, Parameter::kThrust);
    const double force = std::clamp(thrust.dot(own_up), 0.0, most);
    at(values, Value::kThrust) = force;
    const Vector axis = thrust.norm() > 0 ? Vector(thrust / thrust.norm()) : up;
    actor.push_awake(force * own_up, torque(senses, turn, own_up.cross(axis), up));
  }

 private:
  static constexpr double kLeast = 0.1;  // of its weight, that its rotors bear while they run

  // Along the world's axes.
  struct Goal {
    Vector velocity;      // m/s
    Vector acceleration;  // m/s^2, of this velocity
  };

  // It turns with the body.
  static Goal next_goal(const Senses& senses, std::span<double> values, const Vector& up,
                        const Vector& left) {
    const double most = parameter(senses, Parameter::kAcceleration) * senses.dt;
    const Vector before(values.data());
    const Vector change = Vector(senses.inputs.data()) - before;
    const double far = change.norm();
    const Vector reached = far > most ? Vector(before + change * (most / far)) : Vector(senses.inputs.data());
    Eigen::Map<Vector>(values.data()) = reached;
    Eigen::Matrix3d axes;
    axes << left.cross(up), left, up;
    const Vector velocity = axes * reached;
    const double turn = senses.angular_velocity().dot(up);
    return {velocity, axes * (reached - before) / senses.dt + turn * up.cross(velocity)};
  }

  // N: within its bounds, and no farther from the vertical than it may lean.
  static Vector wanted_thrust(const Senses& senses, std::span<double> values, const Vector& up,
                              const Goal& goal) {
    const Vector error = goal.velocity - senses.velocity();
    const double mass = senses.properties.mass + parameter(senses, Parameter::kLoad);
    Eigen::Map<Vector> learnt(&at(values, Value::kSums));
    const Vector all =
        mass * (goal.acceleration + parameter(senses, Parameter::kGain) * error + learnt - senses.gravity);
    const double most = parameter(senses, Parameter::kThrust);
    // It does not fall freely, so that it can lean.
    const double least = std::min(kLeast * mass * senses.gravity.norm(), most);
    const double upwards = std::clamp(all.dot(up), least, most);
    Vector level = all - all.dot(up) * up;
    const auto [sin, cos] = portable::sincos(parameter(senses, Parameter::kLean));
    const double most_level = upwards * sin / cos;
    const bool is_bounded = level.norm() > most_level || upwards != all.dot(up);
    if (level.norm() > most_level) level *= most_level / level.norm();
    // So fast that it does not swing about what there is to learn.
    const double gain = parameter(senses, Parameter::kGain);
    // What its bounds leave of an error is nothing to learn from.
    if (!is_bounded) learnt += gain * gain / 4 * senses.dt * error;
    return level + upwards * up;
  }

  // N m. `lean`: the axis about which its own has to turn, with the sine of the angle.
  static Vector torque(const Senses& senses, const Eigen::Quaterniond& turn, const Vector& lean,
                       const Vector& up) {
    const Vector wanted =
        parameter(senses, Parameter::kTurnGain) * lean + at(senses.inputs, Input::kTurn) * up;
    const Vector error = turn.conjugate() * (wanted - senses.angular_velocity());
    // At the end of the tick, so that no gain is too large for it.
    const double gain = parameter(senses, Parameter::kRateGain);
    Vector result = body_inertia(senses.properties) * error * (gain / (1 + gain * senses.dt));
    const double most = parameter(senses, Parameter::kTorque);
    const double most_turn = parameter(senses, Parameter::kTurnTorque);
    const double leaning = result.head<2>().norm();
    if (leaning > most) result.head<2>() *= most / leaning;
    result.z() = std::clamp(result.z(), -most_turn, most_turn);
    return turn * result;
  }
};

}  // namespace
}  // namespace multicopter

const Program& multicopter_program() {
  static const multicopter::Multicopter kMulticopter;
  return kMulticopter;
}

}  // namespace tessera
