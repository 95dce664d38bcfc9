// Magnetometer: the field of the earth, as a sensor on a body sees it.
#include <array>

#include "lpss/programs/builtin.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/places.h"

namespace tessera {
namespace magnetometer {
namespace {

enum class Parameter { kFieldX, kFieldY, kFieldZ, kNoise, kRoll, kPitch, kYaw, kErrors };
constexpr auto kParameters = std::to_array<NumberSpec>({
    // As SDF has it where a world does not say: in Zurich, with the x axis to the east.
    {"field_x", "T", 5.5645e-6, -1e3, 1e3, "Of the world, along its x axis,"},
    {"field_y", "T", 22.8758e-6, -1e3, 1e3, "its y axis,"},
    {"field_z", "T", -42.3884e-6, -1e3, 1e3, "and its z axis."},
    {"noise", "T", 0, 0, 1, "The standard deviation of each part, in a tick."},
    {"roll", "rad", 0, -7, 7, "How it is turned in the body frame: about the x axis first,"},
    {"pitch", "rad", 0, -7, 7, "then about the y axis,"},
    {"yaw", "rad", 0, -7, 7, "then about the z axis of the body."},
    {"offset", "T", 0, -1, 1, "The mean error of each part."},
    {"bias", "T", 0, 0, 1, "The standard deviation of an error that stays as it is from the start on,"},
    {"drift", "T", 0, 0, 1, "and of one that wanders,"},
    {"drift_time", "s", 100, 0, 1e6, "and after this time has e^-1 of its correlation."},
    {"precision", "T", 0, 0, 1, "Parts are shown as multiples of this; 0: as they are."},
});

enum class Value { kField, kDrift = 3 };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"field_x", "T", 0, 0, 0, "Along its x axis,"},
    {"field_y", "T", 0, 0, 0, "its y axis,"},
    {"field_z", "T", 0, 0, 0, "and its z axis."},
    {"drift_x", "T", 0, 0, 0, "The error that wanders, along its x axis,"},
    {"drift_y", "T", 0, 0, 0, "its y axis,"},
    {"drift_z", "T", 0, 0, 0, "and its z axis."},
});

class Magnetometer final : public Program {
 public:
  absl::string_view kind() const override { return "magnetometer"; }
  absl::string_view summary() const override {
    return "Measures the magnetic field, which is the same everywhere in the world.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void run(const Senses& senses, std::span<double> values, Actor&) const override {
    const Eigen::Vector3d field(senses.parameters.data());
    const Eigen::Quaterniond turn = senses.orientation() * mounting(senses, Parameter::kRoll);
    Eigen::Map<Eigen::Vector3d> shown(&at(values, Value::kField));
    const Eigen::Vector3d measured =
        turn.conjugate() * field + noise_vector(senses, at(senses.parameters, Parameter::kNoise), 0);
    shown = with_lasting_errors(senses, lasting_errors(senses, Parameter::kErrors), measured, 3,
                                Eigen::Map<Eigen::Vector3d>(&at(values, Value::kDrift)));
  }
};

}  // namespace
}  // namespace magnetometer

const Program& magnetometer_program() {
  static const magnetometer::Magnetometer kMagnetometer;
  return kMagnetometer;
}

}  // namespace tessera
