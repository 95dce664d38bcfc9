// Load: what a force and torque sensor in a joint would show.
#include <array>

#include "lpss/programs/builtin.h"
#include "lpss/programs/driven_joint.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace load {
namespace {

enum class Parameter { kJoint, kNoise, kTorqueNoise };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"joint", kJointUnit, 0, 0, kJointNumberMax, "In which it is; 0: none."},
    {"noise", "N", 0, 0, 1e9, "The standard deviation of each force, in a tick."},
    {"torque_noise", "N m", 0, 0, 1e9, "And of each torque."},
});

enum class Value { kForce, kTorque = 3 };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"force_x", "N", 0, 0, 0,
     "With which the joint acts on its child: the mean over the last tick. Along the x axis of the joint,"},
    {"force_y", "N", 0, 0, 0, "its y axis,"},
    {"force_z", "N", 0, 0, 0, "and its z axis."},
    {"torque_x", "N m", 0, 0, 0, "Likewise, about the origin of the joint: about its x axis,"},
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
    if (const SensedJoint* const joint = driven_joint(senses, 0)) {
      watch(senses, *joint, actor);
      loads = joint->record.loads;
    }
    vector_at(values, Value::kForce) = Eigen::Vector3d(loads.force.data()) +
                                       noise_vector(senses, at(senses.parameters, Parameter::kNoise), 0);
    vector_at(values, Value::kTorque) =
        Eigen::Vector3d(loads.torque.data()) +
        noise_vector(senses, at(senses.parameters, Parameter::kTorqueNoise), 3);
  }
};

}  // namespace
}  // namespace load

const Program& load_program() {
  static const load::Load kLoad;
  return kLoad;
}

}  // namespace tessera
