// Altimeter: how high a body is above where it started, and how fast it climbs.
#include <array>

#include "lpss/programs/builtin.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace altimeter {
namespace {

enum class Parameter { kNoise, kClimbNoise };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"noise", "m", 0, 0, 1e3, "The standard deviation of the height, in a tick."},
    {"climb_noise", "m/s", 0, 0, 1e3, "And of the rate of climb."},
});

enum class Value { kHeight, kClimb };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"height", "m", 0, 0, 0,
     "Of the centre of mass above where it started, against gravity where it is now."},
    {"climb", "m/s", 0, 0, 0, "The rate at which it rises."},
});

class Altimeter final : public Program {
 public:
  absl::string_view kind() const override { return "altimeter"; }
  absl::string_view summary() const override {
    return "Measures height and rate of climb. Without gravity, up is the world's z axis.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void run(const Senses& senses, std::span<double> values, Actor&) const override {
    const Eigen::Vector3d up = senses.up();
    const double noise = at(senses.parameters, Parameter::kNoise);
    const double climb_noise = at(senses.parameters, Parameter::kClimbNoise);
    at(values, Value::kHeight) =
        up.dot(senses.position() - senses.start) + (noise == 0 ? 0 : noise * normal(senses, 0));
    at(values, Value::kClimb) =
        up.dot(senses.velocity()) + (climb_noise == 0 ? 0 : climb_noise * normal(senses, 1));
  }
};

}  // namespace
}  // namespace altimeter

const Program& altimeter_program() {
  static const altimeter::Altimeter kAltimeter;
  return kAltimeter;
}

}  // namespace tessera
