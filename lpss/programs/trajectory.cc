// Trajectory: a joint that goes to a goal with bounds of speed and acceleration.
#include <array>
#include <cmath>

#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/driven_joint.h"
#include "lpss/programs/motion_profile.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace trajectory {
namespace {

enum class Parameter { kJoint, kAxis, kSpeed, kAcceleration };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"joint", kJointUnit, 0, 0, kJointNumberMax, "The joint that it drives; 0: none."},
    {"axis", "", 1, 1, 2, "Of a universal joint: 1 or 2."},
    {"speed", "rad/s or m/s", 1, 1e-6, 1e3, "The greatest."},
    {"acceleration", "rad/s^2 or m/s^2", 1, 1e-6, 1e6, "Of starting and of braking."},
});

enum class Input { kGoal };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"goal", "rad or m", 0, -kDriveWayMax, kDriveWayMax,
     "Where the joint should be. Whole turns count where it turns freely."},
});

enum class Value { kPlace, kRate, kError, kRuns };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"place", "rad or m", 0, 0, 0,
     "Where the joint should be at the end of the tick that comes; at first, where it is."},
    {"rate", "rad/s or m/s", 0, 0, 0, "How fast it should get there."},
    {"error", "rad or m", 0, 0, 0, "By how much the joint has missed the place before."},
    {"runs", "", 0, 0, 0, "1 once it has found the joint."},
});

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

class Trajectory final : public Program {
 public:
  absl::string_view kind() const override { return "trajectory"; }
  absl::string_view summary() const override {
    return "Takes a joint to a goal: it speeds up evenly, keeps its speed, and brakes evenly.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    asker.joint(joint_id(parameter(senses, Parameter::kJoint)));
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    const SensedJoint* const joint = driven_joint(senses, 0);
    double& runs = at(values, Value::kRuns);
    if (joint == nullptr) {
      runs = 0;
      return;
    }
    watch(senses, *joint, actor);
    const std::size_t axis = parameter(senses, Parameter::kAxis) < 2 ? 0 : 1;
    const double goal = within_limits(*joint, axis, at(senses.inputs, Input::kGoal));
    const double speed = parameter(senses, Parameter::kSpeed);
    double& place = at(values, Value::kPlace);
    double& rate = at(values, Value::kRate);
    if (runs == 0) place = joint->state.position[axis];
    runs = 1;
    double& error = at(values, Value::kError);
    error = way_to(*joint, axis, place);
    if (place == goal && rate == 0 && std::abs(error) <= speed * senses.dt) {
      actor.drive(*joint, axis, hold_at(*joint, axis, goal));
      return;
    }
    const WayPoint next =
        next_on_way({place, rate}, goal, speed, parameter(senses, Parameter::kAcceleration), senses.dt);
    place = next.place;
    rate = next.rate;
    actor.drive(*joint, axis, drive_to(*joint, axis, place, speed, senses.dt));
    actor.wake_in(1);
  }
};

}  // namespace
}  // namespace trajectory

const Program& trajectory_program() {
  static const trajectory::Trajectory kTrajectory;
  return kTrajectory;
}

}  // namespace tessera
