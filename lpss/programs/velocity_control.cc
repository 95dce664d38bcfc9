// Velocity control: a body that moves and turns as it is told, whatever drives it.
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "lpss/base/rotation.h"
#include "lpss/programs/body_inertia.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/motion_profile.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace velocity_control {
namespace {

constexpr std::size_t kAxes = 6;  // three to move along, three to turn about
// Of an error, that its sum takes over in a tick: friction that stays is made up for, without swinging.
constexpr double kTakenOver = 0.2;

enum class Parameter { kPlanar, kAcceleration, kTurnAcceleration };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"planar", "", 0, 0, 1,
     "1: it moves along the body's x and y axes and turns about its z axis alone; otherwise it is free."},
    {"acceleration", "m/s^2", 1e4, 1e-6, 1e4, "By which it changes its velocity."},
    {"turn_acceleration", "rad/s^2", 1e4, 1e-6, 1e4, "By which it changes its rate of turn."},
});

enum class Input { kVelocity, kTurn = 3 };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"x", "m/s", 0, -1e3, 1e3, "The velocity of the centre of mass, along the body's x axis,"},
    {"y", "m/s", 0, -1e3, 1e3, "its y axis,"},
    {"z", "m/s", 0, -1e3, 1e3, "and its z axis."},
    {"turn_x", "rad/s", 0, -100, 100, "The rate of turn about the body's x axis,"},
    {"turn_y", "rad/s", 0, -100, 100, "its y axis,"},
    {"turn_z", "rad/s", 0, -100, 100, "and its z axis."},
});

enum class Value { kReached, kSums = 6 };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"x", "m/s", 0, 0, 0, "What it has come to of its input,"},
    {"y", "m/s", 0, 0, 0, "likewise,"},
    {"z", "m/s", 0, 0, 0, "likewise,"},
    {"turn_x", "rad/s", 0, 0, 0, "likewise,"},
    {"turn_y", "rad/s", 0, 0, 0, "likewise,"},
    {"turn_z", "rad/s", 0, 0, 0, "likewise."},
    {"learnt_x", "m/s", 0, 0, 0, "What friction and the like take from it in a tick, along the x axis,"},
    {"learnt_y", "m/s", 0, 0, 0, "its y axis,"},
    {"learnt_z", "m/s", 0, 0, 0, "and its z axis;"},
    {"learnt_turn_x", "rad/s", 0, 0, 0, "about the x axis,"},
    {"learnt_turn_y", "rad/s", 0, 0, 0, "the y axis,"},
    {"learnt_turn_z", "rad/s", 0, 0, 0, "and the z axis."},
});

using Vector = Eigen::Vector3d;

class VelocityControl final : public Program {
 public:
  absl::string_view kind() const override { return "velocity_control"; }
  absl::string_view summary() const override {
    return "Moves and turns its body as it is told, with the forces that this takes.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const bool planar = at(senses.parameters, Parameter::kPlanar) >= 0.5;
    std::array<double, kAxes> kept{1, 1, 1, 1, 1, 1};
    if (planar) kept = {1, 1, 0, 0, 0, 1};
    bool at_rest = true;
    for (std::size_t n = 0; n < kAxes; ++n) {
      const Parameter bound = n < 3 ? Parameter::kAcceleration : Parameter::kTurnAcceleration;
      values[n] = nearer(values[n], senses.inputs[n] * kept[n], at(senses.parameters, bound) * senses.dt);
      at_rest = at_rest && values[n] == 0 && senses.inputs[n] * kept[n] == 0;
    }
    const Eigen::Quaterniond turn = senses.orientation();
    const Vector goal(values.data());
    const Vector turn_goal(&values[3]);
    // What it should have at the end of the tick that comes is along the axes of then.
    const Eigen::Quaterniond then = rotation_by(senses.dt * (turn * turn_goal));
    std::array<double, kAxes> errors{};
    Eigen::Map<Vector> error(errors.data());
    Eigen::Map<Vector> turn_error(&errors[3]);
    error = turn.conjugate() * (then * (turn * goal) - senses.velocity());
    turn_error = turn_goal - turn.conjugate() * senses.angular_velocity();
    std::array<double, kAxes> changes{};
    for (std::size_t n = 0; n < kAxes; ++n) {
      double& learnt = values[kAxes + n];
      changes[n] = kept[n] * (errors[n] + learnt);
      learnt += kept[n] * kTakenOver * errors[n];
    }
    const Vector change(changes.data());
    const Vector turn_change(&changes[3]);
    const Vector borne = planar ? Vector(Vector::Zero()) : Vector(-senses.properties.mass * senses.gravity);
    const Vector force = senses.properties.mass / senses.dt * (turn * change) + borne;
    const Vector torque = turn * (body_inertia(senses.properties) * turn_change) / senses.dt;
    if (at_rest) {
      actor.push(force, torque);
    } else {
      actor.push_awake(force, torque);
    }
  }
};

}  // namespace
}  // namespace velocity_control

const Program& velocity_control_program() {
  static const velocity_control::VelocityControl kVelocityControl;
  return kVelocityControl;
}

}  // namespace tessera
