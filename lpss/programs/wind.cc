// Wind: air that moves past its body.
#include <algorithm>
#include <array>
#include <optional>

#include "lpss/programs/builtin.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace wind {
namespace {

enum class Parameter { kDamping, kDrag };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"damping", "1/s", 0, 0, 1e4, "Linear drag: the acceleration by the velocity of the air past the body."},
    {"drag", "1/m", 0, 0, 1e4,
     "Quadratic drag: that by the square of that velocity, density x coefficient x area / (2 x mass)."},
});

enum class Input { kVelocity };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"x", "m/s", 0, -1e3, 1e3, "The velocity of the air, along the world's x axis,"},
    {"y", "m/s", 0, -1e3, 1e3, "its y axis,"},
    {"z", "m/s", 0, -1e3, 1e3, "and its z axis."},
});

enum class Value { kForce };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"force", "N", 0, 0, 0, "Of the air on the body in the tick that comes."},
});

class Wind final : public Program {
 public:
  absl::string_view kind() const override { return "wind"; }
  absl::string_view summary() const override { return "Air that moves past its body, wherever it is."; }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  std::optional<Motion> motion() const override { return Motion::kDynamic; }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const Eigen::Vector3d air(senses.inputs.data());
    const Eigen::Vector3d past = air - senses.velocity();
    const double rate =
        at(senses.parameters, Parameter::kDamping) + at(senses.parameters, Parameter::kDrag) * past.norm();
    // At the end of the tick, so that no drag turns the body round.
    const Eigen::Vector3d force = senses.properties.mass * rate / (1 + rate * senses.dt) * past;
    at(values, Value::kForce) = force.norm();
    if (air.isZero(0)) {
      actor.push(force, Eigen::Vector3d::Zero());
    } else {
      actor.push_awake(force, Eigen::Vector3d::Zero());
    }
  }
};

}  // namespace
}  // namespace wind

const Program& wind_program() {
  static const wind::Wind kWind;
  return kWind;
}

}  // namespace tessera
