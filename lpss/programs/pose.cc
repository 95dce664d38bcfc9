// Pose: where a body is from where it started, and how it moves, as a tracking system shows it.
#include <array>

#include "lpss/base/rotation.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace pose {
namespace {

enum class Parameter { kNoise, kTurnNoise };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"noise", "m", 0, 0, 1e3, "The standard deviation of each coordinate, in a tick."},
    {"turn_noise", "rad", 0, 0, 1, "And of the angle about each of the world's axes."},
});

enum class Value { kX, kTurn = 3, kVelocity = 7, kRate = 10 };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"x", "m", 0, 0, 0, "Of the centre of mass, from where it started, along the world's x axis,"},
    {"y", "m", 0, 0, 0, "its y axis,"},
    {"z", "m", 0, 0, 0, "and its z axis."},
    {"qx", "", 0, 0, 0, "How the body frame is turned from the world's axes: a quaternion,"},
    {"qy", "", 0, 0, 0, "its y,"},
    {"qz", "", 0, 0, 0, "its z,"},
    {"qw", "", 0, 0, 0, "and its real part, which is not below 0."},
    {"velocity_x", "m/s", 0, 0, 0, "Of the centre of mass, without noise, along the body's x axis,"},
    {"velocity_y", "m/s", 0, 0, 0, "its y axis,"},
    {"velocity_z", "m/s", 0, 0, 0, "and its z axis."},
    {"rate_x", "rad/s", 0, 0, 0, "Its rate of turn, likewise, about the body's x axis,"},
    {"rate_y", "rad/s", 0, 0, 0, "its y axis,"},
    {"rate_z", "rad/s", 0, 0, 0, "and its z axis."},
});

void set(std::span<double> values, Value first, const Eigen::Vector3d& vector) {
  Eigen::Map<Eigen::Vector3d>(values.data() + static_cast<std::size_t>(first)) = vector;
}

class Pose final : public Program {
 public:
  absl::string_view kind() const override { return "pose"; }
  absl::string_view summary() const override { return "Measures where its body is, and how it moves."; }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void run(const Senses& senses, std::span<double> values, Actor&) const override {
    const Eigen::Quaterniond orientation = senses.orientation();
    const auto noise = [&](Parameter of, std::uint32_t first) {
      return noise_vector(senses, at(senses.parameters, of), first);
    };
    set(values, Value::kX, senses.position() - senses.start + noise(Parameter::kNoise, 0));
    Eigen::Quaterniond turn = rotation_by(noise(Parameter::kTurnNoise, 3)) * orientation;
    if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
    Eigen::Map<Eigen::Vector4d>(values.data() + static_cast<std::size_t>(Value::kTurn)) = turn.coeffs();
    set(values, Value::kVelocity, orientation.conjugate() * senses.velocity());
    set(values, Value::kRate, orientation.conjugate() * senses.angular_velocity());
  }
};

}  // namespace
}  // namespace pose

const Program& pose_program() {
  static const pose::Pose kPose;
  return kPose;
}

}  // namespace tessera
