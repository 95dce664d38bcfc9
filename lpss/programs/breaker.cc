// Breaker: joints of its body that break when they bear too much.
#include <algorithm>
#include <array>

#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/driven_joint.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace breaker {
namespace {

enum class Parameter { kForce, kTorque, kChildren, kJoint };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"force", "N", kForceMax, 0, kForceMax, "The greatest force that a joint bears as the mean of a tick."},
    {"torque", "N m", kTorqueMax, 0, kTorqueMax, "The greatest torque about the origin of its frame."},
    {"children", "", 0, 0, 1,
     "0: of the joints that hold the body to its parents; 1: also of those that hold its children to it."},
    {"joint", kJointUnit, 0, 0, kJointNumberMax, "The only one that it breaks; 0: all of these."},
});

enum class Input { kRelease };
constexpr auto kInputs = std::to_array<NumberSpec>({
    {"release", "", 0, 0, 1, "1: it breaks them, whatever they bear."},
});

enum class Value { kForce, kTorque, kBroken };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"force", "N", 0, 0, 0, "The greatest force on one of these joints in the last tick."},
    {"torque", "N m", 0, 0, 0, "The greatest torque."},
    {"broken", "", 0, 0, 0, "How many have broken."},
});

class Breaker final : public Program {
 public:
  absl::string_view kind() const override { return "breaker"; }
  absl::string_view summary() const override {
    return "Breaks joints of its body that bear more than they can, or when it is told to.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return kInputs; }
  std::span<const NumberSpec> values() const override { return kValues; }

  bool removes_joints() const override { return true; }

  void ask(const Senses&, std::span<const double>, Asker& asker) const override { asker.joints(); }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    // A kinematic body sleeps while it stands, whatever hangs on it.
    if (senses.properties.motion == Motion::kKinematic) actor.wake_in(1);
    double& most_force = at(values, Value::kForce) = 0;
    double& most_torque = at(values, Value::kTorque) = 0;
    for (const SensedJoint& found : senses.joints_of(0)) {
      const JointRecord& joint = found.record;
      if (!is_watched(senses, joint)) continue;
      const double force = Eigen::Vector3d(joint.loads.force.data()).norm();
      const double torque = Eigen::Vector3d(joint.loads.torque.data()).norm();
      most_force = std::max(most_force, force);
      most_torque = std::max(most_torque, torque);
      if (at(senses.inputs, Input::kRelease) < 0.5 && force <= at(senses.parameters, Parameter::kForce) &&
          torque <= at(senses.parameters, Parameter::kTorque))
        continue;
      actor.remove_joint(joint.id);
      at(values, Value::kBroken) += 1;
    }
  }

 private:
  static bool is_watched(const Senses& senses, const JointRecord& joint) {
    const double only = at(senses.parameters, Parameter::kJoint);
    if (only != 0) return static_cast<double>(joint.id.value) == only;
    return joint.properties.child == senses.body || at(senses.parameters, Parameter::kChildren) >= 0.5;
  }
};

}  // namespace
}  // namespace breaker

const Program& breaker_program() {
  static const breaker::Breaker kBreaker;
  return kBreaker;
}

}  // namespace tessera
