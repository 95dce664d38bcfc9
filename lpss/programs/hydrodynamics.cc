// Hydrodynamics: the drag and the added mass of a body that moves under water, by the derivatives that
// vehicles under water are described with (T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion
// Control, 2011, equations 6.43, 6.57 and 6.58), for a body with three planes of symmetry.
#include <Eigen/Dense>
#include <array>
#include <optional>

#include "lpss/programs/body_inertia.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace hydrodynamics {
namespace {

constexpr double kMassMost = 1e12;

enum class Parameter {
  kMass,
  kInertia = 3,
  kLinear = 6,
  kAngular = 9,
  kQuadratic = 12,
  kAngularQuadratic = 15
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"mass_x", "kg", 0, 0, kMassMost, "The water that moves with the body along its x axis: its added mass;"},
    {"mass_y", "kg", 0, 0, kMassMost, "along its y axis;"},
    {"mass_z", "kg", 0, 0, kMassMost, "and along its z axis."},
    {"inertia_x", "kg m^2", 0, 0, kMassMost, "Likewise about the x axis: its added inertia;"},
    {"inertia_y", "kg m^2", 0, 0, kMassMost, "about the y axis;"},
    {"inertia_z", "kg m^2", 0, 0, kMassMost, "and about the z axis."},
    {"drag_x", "N s/m", 0, 0, kMassMost, "Linear drag along the body's x axis,"},
    {"drag_y", "N s/m", 0, 0, kMassMost, "its y axis,"},
    {"drag_z", "N s/m", 0, 0, kMassMost, "and its z axis."},
    {"turn_drag_x", "N m s", 0, 0, kMassMost, "Linear drag of a turn about the x axis,"},
    {"turn_drag_y", "N m s", 0, 0, kMassMost, "the y axis,"},
    {"turn_drag_z", "N m s", 0, 0, kMassMost, "and the z axis."},
    {"square_drag_x", "N s^2/m^2", 0, 0, kMassMost, "Drag by the square of the speed, along the x axis,"},
    {"square_drag_y", "N s^2/m^2", 0, 0, kMassMost, "the y axis,"},
    {"square_drag_z", "N s^2/m^2", 0, 0, kMassMost, "and the z axis."},
    {"square_turn_drag_x", "N m s^2", 0, 0, kMassMost,
     "Drag by the square of the rate of turn, about the x axis,"},
    {"square_turn_drag_y", "N m s^2", 0, 0, kMassMost, "the y axis,"},
    {"square_turn_drag_z", "N m s^2", 0, 0, kMassMost, "and the z axis."},
});

enum class Input { kCurrent };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"current_x", "m/s", 0, -100, 100, "The velocity of the water, along the world's x axis,"},
    {"current_y", "m/s", 0, -100, 100, "its y axis,"},
    {"current_z", "m/s", 0, -100, 100, "and its z axis."},
});

enum class Value { kVelocity, kTurn = 3, kForce = 6, kTorque = 9, kRuns = 12 };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"velocity_x", "m/s", 0, 0, 0, "Of the centre of mass in the last tick, along the world's x axis,"},
    {"velocity_y", "m/s", 0, 0, 0, "its y axis,"},
    {"velocity_z", "m/s", 0, 0, 0, "and its z axis."},
    {"turn_x", "rad/s", 0, 0, 0, "How fast it turned then, about the world's x axis,"},
    {"turn_y", "rad/s", 0, 0, 0, "its y axis,"},
    {"turn_z", "rad/s", 0, 0, 0, "and its z axis."},
    {"force_x", "N", 0, 0, 0, "Of the water on the body in the tick that comes, along the world's x axis,"},
    {"force_y", "N", 0, 0, 0, "its y axis,"},
    {"force_z", "N", 0, 0, 0, "and its z axis."},
    {"torque_x", "N m", 0, 0, 0, "Likewise, about the centre of mass: about the world's x axis,"},
    {"torque_y", "N m", 0, 0, 0, "its y axis,"},
    {"torque_z", "N m", 0, 0, 0, "and its z axis."},
    {"runs", "", 0, 0, 0, "1 once it has run."},
});

using Vector = Eigen::Vector3d;

Vector parameter(const Senses& senses, Parameter first) { return Vector(&at(senses.parameters, first)); }
Eigen::Map<Vector> value(std::span<double> values, Value first) {
  return Eigen::Map<Vector>(&at(values, first));
}

class Hydrodynamics final : public Program {
 public:
  absl::string_view kind() const override { return "hydrodynamics"; }
  absl::string_view summary() const override {
    return "Gives a body under water its drag and its added mass.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  // The water takes its part of what else acts on the body, to speed up with it. That is taken to be what
  // acted in the last tick: what the body did, less what this program did.
  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const Eigen::Matrix3d to_world = senses.orientation().toRotationMatrix();
    const Eigen::Matrix3d to_body = to_world.transpose();
    const double mass = senses.properties.mass;
    const Eigen::Matrix3d inertia = body_inertia(senses.properties);
    const Vector current(&at(senses.inputs, Input::kCurrent));
    const Vector velocity = to_body * (senses.velocity() - current);
    const Vector turn = to_body * senses.angular_velocity();
    Vector others = mass * (to_body * senses.gravity);
    Vector others_turn = Vector::Zero();
    if (at(values, Value::kRuns) == 1) {
      const Vector change = senses.velocity() - value(values, Value::kVelocity);
      const Vector turn_change = senses.angular_velocity() - value(values, Value::kTurn);
      others = to_body * (mass * change / senses.dt - value(values, Value::kForce));
      others_turn = inertia * (to_body * turn_change) / senses.dt - to_body * value(values, Value::kTorque);
    }
    const Vector added = parameter(senses, Parameter::kMass);
    const Vector added_inertia = parameter(senses, Parameter::kInertia);
    const Vector momentum = added.cwiseProduct(velocity);
    const Vector spin = added_inertia.cwiseProduct(turn);
    const Vector drag = parameter(senses, Parameter::kLinear) +
                        parameter(senses, Parameter::kQuadratic).cwiseProduct(velocity.cwiseAbs());
    const Vector turn_drag = parameter(senses, Parameter::kAngular) +
                             parameter(senses, Parameter::kAngularQuadratic).cwiseProduct(turn.cwiseAbs());
    // At the end of the tick, so that no drag is too large for it.
    const Vector all = others - turn.cross(momentum) - drag.cwiseProduct(velocity);
    const Vector acceleration = all.cwiseQuotient(Vector::Constant(mass) + added + senses.dt * drag);
    const Vector all_turn =
        others_turn - turn.cross(spin) - velocity.cross(momentum) - turn_drag.cwiseProduct(turn);
    const Eigen::Matrix3d whole =
        inertia + Eigen::Matrix3d((added_inertia + senses.dt * turn_drag).asDiagonal());
    const Vector turn_acceleration = whole.inverse() * all_turn;
    value(values, Value::kForce) = to_world * (mass * acceleration - others);
    value(values, Value::kTorque) = to_world * (inertia * turn_acceleration - others_turn);
    value(values, Value::kVelocity) = senses.velocity();
    value(values, Value::kTurn) = senses.angular_velocity();
    at(values, Value::kRuns) = 1;
    if (current.isZero(0)) {
      actor.push(value(values, Value::kForce), value(values, Value::kTorque));
    } else {
      actor.push_awake(value(values, Value::kForce), value(values, Value::kTorque));
    }
  }
};

}  // namespace
}  // namespace hydrodynamics

const Program& hydrodynamics_program() {
  static const hydrodynamics::Hydrodynamics kHydrodynamics;
  return kHydrodynamics;
}

}  // namespace tessera
