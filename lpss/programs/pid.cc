// PID: the effort of a joint by the error of its position or rate.
#include <algorithm>
#include <array>
#include <cmath>

#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/driven_joint.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace pid {
namespace {

enum class Parameter {
  kJoint,
  kAxis,
  kOfRate,
  kP,
  kI,
  kD,
  kFeedForward,
  kIntegralMax,
  kEffortMax,
  kTolerance,
  kImplicit,
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"joint", kJointUnit, 0, 0, kJointNumberMax, "The joint that it drives; 0: none."},
    {"axis", "", 1, 1, 2, "Of a universal joint: 1 or 2."},
    {"of_rate", "", 0, 0, 1, "0: the set point is a position, in rad or m; 1: a rate, in rad/s or m/s."},
    {"p", "", 0, 0, kGainMax, "The effort (N m or N) by the error,"},
    {"i", "", 0, 0, kGainMax, "by the sum of the error over time,"},
    {"d", "", 0, 0, kGainMax, "and by how fast the error of a position falls. Not used of a rate."},
    {"feed_forward", "", 0, -kGainMax, kGainMax, "The effort by the set point itself."},
    {"integral_max", "N m or N", kTorqueMax, 0, kTorqueMax, "The largest effort of the sum."},
    {"effort_max", "N m or N", kTorqueMax, 0, kTorqueMax,
     "The largest effort in all. While it is reached, the sum does not grow."},
    {"tolerance", "", 0, 0, 1e6,
     "While error and rate (of a rate: the error) are below this, the effort stays as it is, and the joint "
     "may sleep."},
    {"implicit", "", 0, 0, 1,
     "1: error and rate are those of the end of each step, as a servo's are, and no gain is too large."},
});

enum class Input { kSetPoint, kEffort };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"set_point", "", 0, -1e6, 1e6, "Where the joint should be, or how fast it should move."},
    {"effort", "N m or N", 0, -kTorqueMax, kTorqueMax, "That is added."},
});

enum class Value { kError, kIntegral, kEffort };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"error", "", 0, 0, 0, "The set point less what is measured."},
    {"integral", "N m or N", 0, 0, 0, "The effort of the sum."},
    {"effort", "N m or N", 0, 0, 0, "Of the joint in the tick that comes."},
});

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

class Pid final : public Program {
 public:
  absl::string_view kind() const override { return "pid"; }
  absl::string_view summary() const override {
    return "Drives a joint by the error of its position or rate, the sum of the error, and its change.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    asker.joint(joint_id(parameter(senses, Parameter::kJoint)));
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const SensedJoint* const joint = driven_joint(senses, 0);
    if (joint == nullptr) return;
    watch(senses, *joint, actor);
    const std::size_t axis = parameter(senses, Parameter::kAxis) < 2 ? 0 : 1;
    const bool of_rate = parameter(senses, Parameter::kOfRate) >= 0.5;
    const double set_point = at(senses.inputs, Input::kSetPoint);
    const double rate = joint->state.velocity[axis];
    const double error = of_rate ? set_point - rate : way_to(*joint, axis, set_point);
    at(values, Value::kError) = error;
    const double off = of_rate ? std::abs(error) : std::max(std::abs(error), std::abs(rate));
    if (off < parameter(senses, Parameter::kTolerance)) return;

    const double others =
        parameter(senses, Parameter::kP) * error - (of_rate ? 0 : parameter(senses, Parameter::kD) * rate) +
        parameter(senses, Parameter::kFeedForward) * set_point + at(senses.inputs, Input::kEffort);
    const double most = parameter(senses, Parameter::kEffortMax);
    const double integral_max = parameter(senses, Parameter::kIntegralMax);
    double& integral = at(values, Value::kIntegral);
    const double next = std::clamp(integral + parameter(senses, Parameter::kI) * error * senses.dt,
                                   -integral_max, integral_max);
    if (std::abs(others + next) <= most || std::abs(next) < std::abs(integral)) integral = next;
    double& effort = at(values, Value::kEffort);
    effort = std::clamp(others + integral, -most, most);
    const bool is_implicit = parameter(senses, Parameter::kImplicit) >= 0.5 && std::abs(effort) < most;
    actor.drive(*joint, axis, is_implicit ? servo(senses, integral) : JointDrive{DriveMode::kEffort, effort});
  }

 private:
  // The same effort, of where the axis will be.
  static JointDrive servo(const Senses& senses, double integral) {
    const double set_point = at(senses.inputs, Input::kSetPoint);
    const double p = parameter(senses, Parameter::kP);
    JointDrive drive{DriveMode::kServo};
    drive.effort =
        integral + parameter(senses, Parameter::kFeedForward) * set_point + at(senses.inputs, Input::kEffort);
    if (parameter(senses, Parameter::kOfRate) >= 0.5) {
      drive.damping = p;
      drive.velocity = set_point;
    } else {
      drive.target = set_point;
      drive.stiffness = p;
      drive.damping = parameter(senses, Parameter::kD);
    }
    return drive;
  }
};

}  // namespace
}  // namespace pid

const Program& pid_program() {
  static const pid::Pid kPid;
  return kPid;
}

}  // namespace tessera
