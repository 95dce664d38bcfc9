// Thruster: an engine, a propeller or a rotor, which pushes its body at a place.
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "lpss/base/portable_math.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/places.h"

namespace tessera {
namespace thruster {
namespace {

enum class Parameter { kX, kY, kZ, kTurn, kRise, kForce, kLag, kReaction };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m", 0, -1e3, 1e3, "Where it pushes, in the body frame,"},
    {"y", "m", 0, -1e3, 1e3, "along its y axis,"},
    {"z", "m", 0, -1e3, 1e3, "and along its z axis."},
    {"turn", "rad", 0, -7, 7, "Where to: turned from the body's x axis towards its y axis,"},
    {"rise", "rad", 0, -7, 7, "and from there towards its z axis: pi / 2 pushes upwards."},
    {"force", "N", 0, 0, 1e12, "The greatest."},
    {"lag", "s", 0, 0, 1e3, "In which it makes 63 % of a change of its input."},
    {"reaction", "m", 0, -1e3, 1e3,
     "The moment that it gives its body about the way it pushes, by its force."},
});

enum class Input { kThrottle };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"throttle", "", 0, -1, 1, "Of the greatest force; below 0 it pushes the other way."},
});

enum class Value { kThrottle, kForce };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"throttle", "", 0, 0, 0, "What it has come to of its input."},
    {"force", "N", 0, 0, 0, "With which it pushes in the tick that comes."},
});

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

class Thruster final : public Program {
 public:
  absl::string_view kind() const override { return "thruster"; }
  absl::string_view summary() const override {
    return "Pushes its body at a place and in a direction: an engine, a propeller, a rotor.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const double wanted = at(senses.inputs, Input::kThrottle);
    double& throttle = at(values, Value::kThrottle);
    throttle += (wanted - throttle) * share(senses);
    if (std::abs(wanted - throttle) < kReached) throttle = wanted;
    double& force = at(values, Value::kForce);
    force = throttle * parameter(senses, Parameter::kForce);
    if (throttle != 0 || wanted != 0) {
      const Eigen::Quaterniond turn = senses.orientation();
      const Eigen::Vector3d push = force * (turn * direction(senses));
      const Eigen::Vector3d place(senses.parameters.data());
      const Eigen::Vector3d lever = lever_of(senses, turn, place);
      actor.push_awake(push, lever.cross(push) + parameter(senses, Parameter::kReaction) * push);
    }
  }

 private:
  static constexpr double kReached = 1e-6;

  // Of a change, that is made in a tick.
  static double share(const Senses& senses) {
    const double lag = parameter(senses, Parameter::kLag);
    return lag == 0 ? 1 : 1 - portable::pow(std::numbers::e, -senses.dt / lag);
  }

  static Eigen::Vector3d direction(const Senses& senses) {
    const auto turn = portable::sincos(parameter(senses, Parameter::kTurn));
    const auto rise = portable::sincos(parameter(senses, Parameter::kRise));
    return {turn.cos * rise.cos, turn.sin * rise.cos, rise.sin};
  }
};

}  // namespace
}  // namespace thruster

const Program& thruster_program() {
  static const thruster::Thruster kThruster;
  return kThruster;
}

}  // namespace tessera
