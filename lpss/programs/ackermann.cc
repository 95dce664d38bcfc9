// Ackermann: a car whose front wheels steer about one middle, and whose rear wheels are driven.
#include <algorithm>
#include <array>
#include <cmath>

#include "lpss/base/portable_math.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/driven_joint.h"
#include "lpss/programs/motion_profile.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/wheel_odometry.h"

namespace tessera {
namespace ackermann {
namespace {

enum class Parameter {
  kLeftSteer,
  kRightSteer,
  kLeft,
  kRight,
  kWheelbase,
  kTrack,
  kSteerTrack,
  kRadius,
  kAcceleration,
  kSteerAngle,
  kSteerRate
};
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"left_steer", kJointUnit, 0, 0, kJointNumberMax,
     "The joint by which the left front wheel steers, whose axis points upwards,"},
    {"right_steer", kJointUnit, 0, 0, kJointNumberMax, "and that of the right front wheel, likewise."},
    {"left", kJointUnit, 0, 0, kJointNumberMax,
     "The joint of the left rear wheel, whose axis points to the left,"},
    {"right", kJointUnit, 0, 0, kJointNumberMax, "and that of the right rear wheel, likewise."},
    {"wheelbase", "m", 1, 1e-3, 100, "From the rear axle to the front axle."},
    {"track", "m", 0.6, 1e-3, 100, "From the left rear wheel to the right one."},
    {"steer_track", "m", 0.6, 1e-3, 100, "From the left steering joint to the right one."},
    {"radius", "m", 0.15, 1e-3, 10, "Of a rear wheel."},
    {"acceleration", "m/s^2", 2, 1e-6, 1e4, "By which it changes its speed."},
    {"steer_angle", "rad", 0.6, 0, 1.5, "The largest, as seen in the middle of the front axle."},
    {"steer_rate", "rad/s", 1.5, 1e-3, 100, "How fast it changes."},
});

enum class Input { kSpeed, kSteer };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, -100, 100, "Of the middle of the rear axle, forwards."},
    {"steer", "rad", 0, -1.5, 1.5, "The angle in the middle of the front axle; above 0 to the left."},
});

enum class Value { kSpeed, kSteer, kLeftAngle, kRightAngle, kX, kY, kHeading, kLeft, kRight, kRuns };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"speed", "m/s", 0, 0, 0, "What it has come to of its input."},
    {"steer", "rad", 0, 0, 0, "Likewise."},
    {"left_angle", "rad", 0, 0, 0, "Where the left front wheel should be,"},
    {"right_angle", "rad", 0, 0, 0, "and the right front wheel."},
    {"x", "m", 0, 0, 0, "By its rear wheels, the middle between them is so far ahead of where it started,"},
    {"y", "m", 0, 0, 0, "and to the left."},
    {"heading", "rad", 0, 0, 0, "By how much it has turned to the left."},
    {"left", "rad", 0, 0, 0, "Where the left rear wheel is,"},
    {"right", "rad", 0, 0, 0, "and the right rear wheel."},
    {"runs", "", 0, 0, 0, "1 once it has found its joints."},
});

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

class Ackermann final : public Program {
 public:
  absl::string_view kind() const override { return "ackermann"; }
  absl::string_view summary() const override {
    return "Steers the joints of two front wheels about one middle, and drives those of two rear wheels.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    for (const Parameter joint :
         {Parameter::kLeftSteer, Parameter::kRightSteer, Parameter::kLeft, Parameter::kRight})
      asker.joint(joint_id(parameter(senses, joint)));
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    std::array<const SensedJoint*, 4> joints{};
    double& runs = at(values, Value::kRuns);
    for (std::uint32_t n = 0; n < joints.size(); ++n) {
      joints[n] = driven_joint(senses, n);
      if (joints[n] != nullptr) continue;
      runs = 0;
      return;
    }
    const auto [left_steer, right_steer, left, right] = joints;
    watch(senses, *left, actor);
    const double radius = parameter(senses, Parameter::kRadius);
    const double track = parameter(senses, Parameter::kTrack);
    roll(*left, *right, radius, track,
         {at(values, Value::kX), at(values, Value::kY), at(values, Value::kHeading), at(values, Value::kLeft),
          at(values, Value::kRight), runs});

    double& speed = at(values, Value::kSpeed);
    double& steer = at(values, Value::kSteer);
    const double most = parameter(senses, Parameter::kSteerAngle);
    const double wanted_speed = at(senses.inputs, Input::kSpeed);
    const double wanted_steer = std::clamp(at(senses.inputs, Input::kSteer), -most, most);
    speed = nearer(speed, wanted_speed, parameter(senses, Parameter::kAcceleration) * senses.dt);
    steer = nearer(steer, wanted_steer, parameter(senses, Parameter::kSteerRate) * senses.dt);
    if (speed != wanted_speed || steer != wanted_steer) actor.wake_in(1);

    // The axles of all wheels meet beside the rear axle, at wheelbase / tan(steer).
    const auto [sin, cos] = portable::sincos(steer);
    const double wheelbase = parameter(senses, Parameter::kWheelbase);
    const double inwards = parameter(senses, Parameter::kSteerTrack) / 2 * sin;
    double& left_angle = at(values, Value::kLeftAngle);
    double& right_angle = at(values, Value::kRightAngle);
    left_angle = portable::atan2(wheelbase * sin, wheelbase * cos - inwards);
    right_angle = portable::atan2(wheelbase * sin, wheelbase * cos + inwards);
    steer_to(senses, *left_steer, left_angle, steer == wanted_steer, actor);
    steer_to(senses, *right_steer, right_angle, steer == wanted_steer, actor);
    const double apart = speed * sin / (wheelbase * cos) * track / 2;
    actor.drive(*left, 0, {DriveMode::kVelocity, (speed - apart) / radius});
    actor.drive(*right, 0, {DriveMode::kVelocity, (speed + apart) / radius});
  }

 private:
  // What has arrived is held there.
  static void steer_to(const Senses& senses, const SensedJoint& joint, double angle, bool is_last,
                       Actor& actor) {
    const double reached = within_limits(joint, 0, angle);
    const double rate = parameter(senses, Parameter::kSteerRate);
    const bool is_there = is_last && std::abs(way_to(joint, 0, reached)) <= rate * senses.dt;
    // The inner wheel turns faster than the middle.
    actor.drive(joint, 0,
                is_there ? hold_at(joint, 0, reached) : drive_to(joint, 0, reached, 2 * rate, senses.dt));
  }
};

}  // namespace
}  // namespace ackermann

const Program& ackermann_program() {
  static const ackermann::Ackermann kAckermann;
  return kAckermann;
}

}  // namespace tessera
