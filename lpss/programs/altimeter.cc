// Altimeter: how high a body is above where it started, and how fast it climbs.
#include <array>

#include "lpss/programs/builtin.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace altimeter {
namespace {

enum class Parameter { kNoise, kClimbNoise, kErrors, kClimbErrors = 7 };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"noise", "m", 0, 0, 1e3, "The standard deviation of the height, in a tick."},
    {"climb_noise", "m/s", 0, 0, 1e3, "And of the rate of climb."},
    {"offset", "m", 0, -1e3, 1e3, "The mean error of the height."},
    {"bias", "m", 0, 0, 1e3, "The standard deviation of an error that stays as it is from the start on,"},
    {"drift", "m", 0, 0, 1e3, "and of one that wanders,"},
    {"drift_time", "s", 100, 0, 1e6, "and after this time has e^-1 of its correlation."},
    {"precision", "m", 0, 0, 1e3, "It is shown as multiples of this; 0: as it is."},
    {"climb_offset", "m/s", 0, -1e3, 1e3, "Likewise of the rate of climb,"},
    {"climb_bias", "m/s", 0, 0, 1e3, "likewise,"},
    {"climb_drift", "m/s", 0, 0, 1e3, "likewise,"},
    {"climb_drift_time", "s", 100, 0, 1e6, "likewise,"},
    {"climb_precision", "m/s", 0, 0, 1e3, "likewise."},
});

enum class Value { kHeight, kClimb, kDrift, kClimbDrift };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"height", "m", 0, 0, 0,
     "Of the centre of mass above where it started, against gravity where it is now."},
    {"climb", "m/s", 0, 0, 0, "The rate at which it rises."},
    {"drift", "m", 0, 0, 0, "The error of the height that wanders,"},
    {"climb_drift", "m/s", 0, 0, 0, "and that of the rate of climb."},
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
    const double height =
        up.dot(senses.position() - senses.start) + (noise == 0 ? 0 : noise * normal(senses, 0));
    const double climb = up.dot(senses.velocity()) + (climb_noise == 0 ? 0 : climb_noise * normal(senses, 1));
    at(values, Value::kHeight) = with_lasting_errors(senses, lasting_errors(senses, Parameter::kErrors),
                                                     height, 2, 3, at(values, Value::kDrift));
    at(values, Value::kClimb) = with_lasting_errors(senses, lasting_errors(senses, Parameter::kClimbErrors),
                                                    climb, 4, 5, at(values, Value::kClimbDrift));
  }
};

}  // namespace
}  // namespace altimeter

const Program& altimeter_program() {
  static const altimeter::Altimeter kAltimeter;
  return kAltimeter;
}

}  // namespace tessera
