// IMU: what accelerometers and gyroscopes at a place of the body would show.
#include <array>
#include <cstdint>

#include "lpss/base/rotation.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/places.h"

namespace tessera {
namespace imu {
namespace {

enum class Parameter { kX, kY, kZ, kNoise, kTurnNoise, kRoll, kPitch, kYaw, kErrors, kTurnErrors = 13 };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m", 0, -1e3, 1e3, "Where it is in the body frame,"},
    {"y", "m", 0, -1e3, 1e3, "along its y axis,"},
    {"z", "m", 0, -1e3, 1e3, "and along its z axis."},
    {"noise", "m/s^2", 0, 0, 1e3, "The standard deviation of each acceleration, in a tick."},
    {"turn_noise", "rad/s", 0, 0, 1e3, "And of each rate of turn."},
    {"roll", "rad", 0, -7, 7, "How it is turned in the body frame: about the x axis first,"},
    {"pitch", "rad", 0, -7, 7, "then about the y axis,"},
    {"yaw", "rad", 0, -7, 7, "then about the z axis of the body."},
    {"offset", "m/s^2", 0, -1e3, 1e3, "The mean error of each acceleration."},
    {"bias", "m/s^2", 0, 0, 1e3, "The standard deviation of an error that stays as it is from the start on,"},
    {"drift", "m/s^2", 0, 0, 1e3, "and of one that wanders,"},
    {"drift_time", "s", 100, 0, 1e6, "and after this time has e^-1 of its correlation."},
    {"precision", "m/s^2", 0, 0, 1e3, "Accelerations are shown as multiples of this; 0: as they are."},
    {"turn_offset", "rad/s", 0, -1e3, 1e3, "Likewise of rates of turn,"},
    {"turn_bias", "rad/s", 0, 0, 1e3, "likewise,"},
    {"turn_drift", "rad/s", 0, 0, 1e3, "likewise,"},
    {"turn_drift_time", "s", 100, 0, 1e6, "likewise,"},
    {"turn_precision", "rad/s", 0, 0, 1e3, "likewise."},
});

enum class Value {
  kAcceleration,
  kTurn = 3,
  kVelocity = 6,
  kMeasures = 9,
  kOrientation = 10,
  kDrift = 14,
  kTurnDrift = 17
};
constexpr auto kValues = std::to_array<NumberSpec>({
    {"acceleration_x", "m/s^2", 0, 0, 0, "As felt: in free fall 0, at rest upwards. Along its x axis,"},
    {"acceleration_y", "m/s^2", 0, 0, 0, "its y axis,"},
    {"acceleration_z", "m/s^2", 0, 0, 0, "and its z axis; the mean over the tick."},
    {"turn_x", "rad/s", 0, 0, 0, "The rate of turn about its x axis,"},
    {"turn_y", "rad/s", 0, 0, 0, "its y axis,"},
    {"turn_z", "rad/s", 0, 0, 0, "and its z axis, at the end of the tick."},
    {"velocity_x", "m/s", 0, 0, 0, "Of the place where it is, without noise, along the world's x axis,"},
    {"velocity_y", "m/s", 0, 0, 0, "its y axis,"},
    {"velocity_z", "m/s", 0, 0, 0, "and its z axis."},
    {"measures", "", 0, 0, 0, "1 once it has run: its first acceleration is that of a constant velocity."},
    {"qx", "", 0, 0, 0, "How it is turned from the world's axes, without noise: a quaternion,"},
    {"qy", "", 0, 0, 0, "its y,"},
    {"qz", "", 0, 0, 0, "its z,"},
    {"qw", "", 1, 0, 0, "and its real part, which is not below 0."},
    {"drift_x", "m/s^2", 0, 0, 0, "The error of the acceleration that wanders, along its x axis,"},
    {"drift_y", "m/s^2", 0, 0, 0, "its y axis,"},
    {"drift_z", "m/s^2", 0, 0, 0, "and its z axis."},
    {"turn_drift_x", "rad/s", 0, 0, 0, "That of the rate of turn, about its x axis,"},
    {"turn_drift_y", "rad/s", 0, 0, 0, "its y axis,"},
    {"turn_drift_z", "rad/s", 0, 0, 0, "and its z axis."},
});

Eigen::Map<Eigen::Vector3d> vector_at(std::span<double> values, Value first) {
  return Eigen::Map<Eigen::Vector3d>(values.data() + static_cast<std::size_t>(first));
}

class Imu final : public Program {
 public:
  absl::string_view kind() const override { return "imu"; }
  absl::string_view summary() const override {
    return "Measures accelerations and rates of turn. While its body sleeps, it shows the last ones.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void run(const Senses& senses, std::span<double> values, Actor&) const override {
    const Eigen::Quaterniond turn = senses.orientation();
    const Eigen::Vector3d place(senses.parameters.data());
    const Eigen::Vector3d lever = lever_of(senses, turn, place);
    const Eigen::Vector3d velocity = senses.velocity() + senses.angular_velocity().cross(lever);
    Eigen::Map<Eigen::Vector3d> before = vector_at(values, Value::kVelocity);
    double& measures = at(values, Value::kMeasures);
    Eigen::Vector3d acceleration = -senses.gravity;
    if (measures == 1) acceleration += (velocity - before) / senses.dt;
    before = velocity;
    measures = 1;
    const Eigen::Quaterniond own = turn * mounting(senses, Parameter::kRoll);
    // The mean over a tick is along the axes of its middle.
    const Eigen::Quaterniond halfway = rotation_by(-0.5 * senses.dt * senses.angular_velocity()) * own;
    vector_at(values, Value::kAcceleration) =
        with_lasting_errors(senses, lasting_errors(senses, Parameter::kErrors),
                            halfway.conjugate() * acceleration + noise(senses, Parameter::kNoise, 0), 6,
                            vector_at(values, Value::kDrift));
    vector_at(values, Value::kTurn) = with_lasting_errors(
        senses, lasting_errors(senses, Parameter::kTurnErrors),
        own.conjugate() * senses.angular_velocity() + noise(senses, Parameter::kTurnNoise, 3), 12,
        vector_at(values, Value::kTurnDrift));
    Eigen::Map<Eigen::Vector4d> orientation(&at(values, Value::kOrientation));
    orientation = own.coeffs();
    if (own.w() < 0) orientation = -orientation;
  }

 private:
  static Eigen::Vector3d noise(const Senses& senses, Parameter deviation, std::uint32_t first) {
    return noise_vector(senses, at(senses.parameters, deviation), first);
  }
};

}  // namespace
}  // namespace imu

const Program& imu_program() {
  static const imu::Imu kImu;
  return kImu;
}

}  // namespace tessera
