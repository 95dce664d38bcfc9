// Load: what a force and torque sensor in a joint would show.
#include <array>

#include "lpss/programs/builtin.h"
#include "lpss/programs/driven_joint.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/places.h"

namespace tessera {
namespace load {
namespace {

enum class Parameter { kJoint, kNoise, kTorqueNoise, kFrame, kRoll, kPitch, kYaw, kDirection };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"joint", kJointUnit, 0, 0, kJointNumberMax, "In which it is; 0: none."},
    {"noise", "N", 0, 0, 1e9, "The standard deviation of each force, in a tick."},
    {"torque_noise", "N m", 0, 0, 1e9, "And of each torque."},
    {"frame", "", 0, 0, 1,
     "Whose axes count: 0: the joint's; 1: its body's, where that is the child of the joint."},
    {"roll", "rad", 0, -7, 7, "How the sensor is turned from these axes: about the x axis first,"},
    {"pitch", "rad", 0, -7, 7, "then about the y axis,"},
    {"yaw", "rad", 0, -7, 7, "then about the z axis."},
    {"direction", "", 1, -1, 1, "1: what acts on the child; -1: what acts on the parent."},
});

enum class Value { kForce, kTorque = 3 };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"force_x", "N", 0, 0, 0,
     "With which the joint acts on its child: the mean over the last tick. Along the x axis,"},
    {"force_y", "N", 0, 0, 0, "its y axis,"},
    {"force_z", "N", 0, 0, 0, "and its z axis."},
    {"torque_x", "N m", 0, 0, 0, "Likewise, about the origin of the joint: about the x axis,"},
    {"torque_y", "N m", 0, 0, 0, "its y axis,"},
    {"torque_z", "N m", 0, 0, 0, "and its z axis."},
});

Eigen::Map<Eigen::Vector3d> vector_at(std::span<double> values, Value first) {
  return Eigen::Map<Eigen::Vector3d>(values.data() + static_cast<std::size_t>(first));
}

class Load final : public Program {
 public:
  absl::string_view kind() const override { return "load"; }
  absl::string_view summary() const override {
    return "Measures the force and torque of a joint. While its body sleeps, it shows the last ones.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    asker.joint(joint_id(at(senses.parameters, Parameter::kJoint)));
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    JointLoads loads;
    Eigen::Quaterniond axes = mounting(senses, Parameter::kRoll);
    if (const SensedJoint* const joint = driven_joint(senses, 0)) {
      watch(senses, *joint, actor);
      loads = joint->record.loads;
      axes = in_joint(senses, joint->record.properties) * axes;
    }
    const double sign = at(senses.parameters, Parameter::kDirection) < 0 ? -1 : 1;
    const auto seen = [&](const auto& vector) -> Eigen::Vector3d {
      return axes.conjugate() * Eigen::Vector3d(sign * Eigen::Vector3d(vector.data()));
    };
    vector_at(values, Value::kForce) =
        seen(loads.force) + noise_vector(senses, at(senses.parameters, Parameter::kNoise), 0);
    vector_at(values, Value::kTorque) =
        seen(loads.torque) + noise_vector(senses, at(senses.parameters, Parameter::kTorqueNoise), 3);
  }

 private:
  // The axes that count, in the frame of the joint.
  static Eigen::Quaterniond in_joint(const Senses& senses, const JointProperties& joint) {
    if (at(senses.parameters, Parameter::kFrame) < 0.5 || joint.child != senses.body)
      return Eigen::Quaterniond::Identity();
    return (centre_frame(senses.properties).orientation * joint.in_child.orientation).conjugate();
  }
};

}  // namespace
}  // namespace load

const Program& load_program() {
  static const load::Load kLoad;
  return kLoad;
}

}  // namespace tessera
