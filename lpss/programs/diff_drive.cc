// Differential drive: a robot with a wheel on each side.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "lpss/programs/builtin.h"
#include "lpss/programs/driven_joint.h"
#include "lpss/programs/motion_profile.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/wheel_odometry.h"

namespace tessera {
namespace diff_drive {
namespace {

constexpr std::size_t kWheelsMax = 3;  // on a side

enum class Parameter {
  kLeft,
  kRight,
  kRadius,
  kTrack,
  kAcceleration,
  kTurnAcceleration,
  kLeft2,
  kRight2,
  kLeft3,
  kRight3,
  kSpeedMax,
  kTurnMax,
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"left", kJointUnit, 0, 0, kJointNumberMax,
     "The joint of the left wheel, whose axis points to the left,"},
    {"right", kJointUnit, 0, 0, kJointNumberMax, "and that of the right wheel, likewise."},
    {"radius", "m", 0.1, 1e-3, 10, "Of a wheel."},
    {"track", "m", 0.5, 1e-3, 100, "From wheel to wheel."},
    {"acceleration", "m/s^2", 1, 1e-6, 1e4, "By which it changes its speed."},
    {"turn_acceleration", "rad/s^2", 2, 1e-6, 1e4, "By which it changes its rate of turn."},
    {"left_2", kJointUnit, 0, 0, kJointNumberMax,
     "Of a second wheel on the left that turns alike; 0: there is none,"},
    {"right_2", kJointUnit, 0, 0, kJointNumberMax, "and on the right,"},
    {"left_3", kJointUnit, 0, 0, kJointNumberMax, "of a third one on the left"},
    {"right_3", kJointUnit, 0, 0, kJointNumberMax, "and on the right."},
    {"speed_max", "m/s", 100, 0, 100, "The greatest speed, both ways,"},
    {"turn_max", "rad/s", 100, 0, 100, "and the greatest rate of turn."},
});

enum class Input { kSpeed, kTurn };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, -100, 100, "Forwards."},
    {"turn", "rad/s", 0, -100, 100, "The rate of turn; above 0 to the left."},
});

enum class Value { kSpeed, kTurn, kX, kY, kHeading, kLeft, kRight, kRuns };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, 0, 0, "What it has come to of its input."},
    {"turn", "rad/s", 0, 0, 0, "Likewise."},
    {"x", "m", 0, 0, 0, "By its wheels, the middle between them is so far ahead of where it started,"},
    {"y", "m", 0, 0, 0, "and to the left."},
    {"heading", "rad", 0, 0, 0, "By how much it has turned to the left."},
    {"left", "rad", 0, 0, 0, "Where the left wheel is,"},
    {"right", "rad", 0, 0, 0, "and the right wheel."},
    {"runs", "", 0, 0, 0, "1 once it has found its wheels."},
});

// A left one, a right one, and so on: in this order they are asked for.
constexpr std::array<Parameter, 2 * kWheelsMax> kWheels = {Parameter::kLeft,  Parameter::kRight,
                                                           Parameter::kLeft2, Parameter::kRight2,
                                                           Parameter::kLeft3, Parameter::kRight3};

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

class DiffDrive final : public Program {
 public:
  absl::string_view kind() const override { return "diff_drive"; }
  absl::string_view summary() const override {
    return "Drives the joints of up to three wheels on each side, and tells how far it has come by the first "
           "two.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    for (const Parameter wheel : kWheels) asker.joint(joint_id(parameter(senses, wheel)));
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const SensedJoint* const left = driven_joint(senses, 0);
    const SensedJoint* const right = driven_joint(senses, 1);
    double& runs = at(values, Value::kRuns);
    if (left == nullptr || right == nullptr) {
      runs = 0;
      return;
    }
    watch(senses, *left, actor);
    const double radius = parameter(senses, Parameter::kRadius);
    const double track = parameter(senses, Parameter::kTrack);
    roll(*left, *right, radius, track,
         {at(values, Value::kX), at(values, Value::kY), at(values, Value::kHeading), at(values, Value::kLeft),
          at(values, Value::kRight), runs});
    double& speed = at(values, Value::kSpeed);
    double& turn = at(values, Value::kTurn);
    const double wanted_speed = wanted(senses, Input::kSpeed, Parameter::kSpeedMax);
    const double wanted_turn = wanted(senses, Input::kTurn, Parameter::kTurnMax);
    speed = nearer(speed, wanted_speed, parameter(senses, Parameter::kAcceleration) * senses.dt);
    turn = nearer(turn, wanted_turn, parameter(senses, Parameter::kTurnAcceleration) * senses.dt);
    const double apart = turn * track / 2;
    for (std::uint32_t n = 0; n < kWheels.size(); ++n) {
      const SensedJoint* const wheel = driven_joint(senses, n);
      const double rolls = n % 2 == 0 ? speed - apart : speed + apart;
      if (wheel != nullptr) actor.drive(*wheel, 0, {DriveMode::kVelocity, rolls / radius});
    }
    if (speed != wanted_speed || turn != wanted_turn) actor.wake_in(1);
  }

 private:
  static double wanted(const Senses& senses, Input input, Parameter most) {
    const double bound = parameter(senses, most);
    return std::clamp(at(senses.inputs, input), -bound, bound);
  }
};

}  // namespace
}  // namespace diff_drive

const Program& diff_drive_program() {
  static const diff_drive::DiffDrive kDiffDrive;
  return kDiffDrive;
}

}  // namespace tessera
