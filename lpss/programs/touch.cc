// Touch: what presses on a body.
#include <array>

#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/measuring.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace touch {
namespace {

enum class Parameter { kThreshold, kNoise, kBody };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"threshold", "N", 0, 0, 1e9, "What presses less does not count as a touch."},
    {"noise", "N", 0, 0, 1e6, "The standard deviation of each force, in a tick."},
    {"body", kBodyUnit, 0, 0, static_cast<double>(kBodyIdMax),
     "The body that is touched; 0: the own one. Axes are those of the own one."},
});

enum class Value { kTouches, kBody, kForce, kForceX, kForceY, kForceZ };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"touches", "", 0, 0, 0, "1 while anything presses with more than the threshold."},
    {"body", "body", 0, 0, 0, "The body that presses most; 0: none."},
    {"force", "N", 0, 0, 0, "Of all contacts along their normals together: the mean over the tick."},
    {"force_x", "N", 0, 0, 0, "The sum of these forces on the body, along its x axis,"},
    {"force_y", "N", 0, 0, 0, "its y axis,"},
    {"force_z", "N", 0, 0, 0, "and its z axis."},
});

class Touch final : public Program {
 public:
  absl::string_view kind() const override { return "touch"; }
  absl::string_view summary() const override {
    return "Measures what presses on its body. Friction is not in it. While its body sleeps, it shows the "
           "last.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    asker.contacts(body_or_own(senses, Parameter::kBody));
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    keep_measuring(senses, actor);
    const double noise = at(senses.parameters, Parameter::kNoise);
    double force = noise > 0 ? noise * normal(senses, 0) : 0;
    double most = 0;
    BodyId strongest;
    const Eigen::Quaterniond into_body = senses.orientation().conjugate();
    Eigen::Vector3d sum = noise_vector(senses, noise, 1);
    for (const ProgramFinding& finding : senses.of(0)) {
      const double presses = finding.impulse / senses.dt;
      force += presses;
      sum += into_body * (presses * Eigen::Vector3d(finding.normal.data()));
      if (presses <= most) continue;
      most = presses;
      strongest = finding.body;
    }
    at(values, Value::kTouches) = most > at(senses.parameters, Parameter::kThreshold) ? 1 : 0;
    at(values, Value::kBody) = static_cast<double>(strongest.value);
    at(values, Value::kForce) = force;
    at(values, Value::kForceX) = sum.x();
    at(values, Value::kForceY) = sum.y();
    at(values, Value::kForceZ) = sum.z();
  }
};

}  // namespace
}  // namespace touch

const Program& touch_program() {
  static const touch::Touch kTouch;
  return kTouch;
}

}  // namespace tessera
