// Barometer: the pressure of the air at the height of a body.
//
// U.S. Standard Atmosphere, 1976 (NOAA, NASA and USAF), equations 18, 33a and 33b: up to 11 km of
// geopotential height the temperature falls evenly, and above it is constant.
#include <algorithm>
#include <array>
#include <numbers>

#include "lpss/base/portable_math.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"

namespace tessera {
namespace barometer {
namespace {

constexpr double kEarth = 6356766;       // m, the radius by which heights become geopotential
constexpr double kAtSeaLevel = 101325;   // Pa
constexpr double kTemperature = 288.15;  // K, at sea level
constexpr double kLapse = 0.0065;        // K/m
constexpr double kTropopause = 11000;    // m
constexpr double kExponent = 9.80665 * 28.9644 / (8314.32 * kLapse);

enum class Parameter { kHeight, kNoise, kErrors };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"height", "m", 0, -5000, 1e6, "Of where the body started, above the sea."},
    {"noise", "Pa", 0, 0, 1e5, "The standard deviation of the pressure, in a tick."},
    {"offset", "Pa", 0, -1e5, 1e5, "The mean error of the pressure."},
    {"bias", "Pa", 0, 0, 1e5, "The standard deviation of an error that stays as it is from the start on,"},
    {"drift", "Pa", 0, 0, 1e5, "and of one that wanders,"},
    {"drift_time", "s", 100, 0, 1e6, "and after this time has e^-1 of its correlation."},
    {"precision", "Pa", 0, 0, 1e5, "It is shown as multiples of this; 0: as it is."},
});

enum class Value { kPressure, kDrift };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"pressure", "Pa", 0, 0, 0, "At the centre of mass."},
    {"drift", "Pa", 0, 0, 0, "The error that wanders."},
});

double pressure_at(double height) {
  const double geopotential = kEarth * height / (kEarth + height);
  const double below = std::min(geopotential, kTropopause);
  const double temperature = kTemperature - kLapse * below;
  const double pressure = kAtSeaLevel * portable::pow(temperature / kTemperature, kExponent);
  if (geopotential <= kTropopause) return pressure;
  return pressure *
         portable::pow(std::numbers::e, -kExponent * kLapse * (geopotential - below) / temperature);
}

class Barometer final : public Program {
 public:
  absl::string_view kind() const override { return "barometer"; }
  absl::string_view summary() const override {
    return "Measures the pressure of the air. Without gravity, up is the world's z axis.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void run(const Senses& senses, std::span<double> values, Actor&) const override {
    const double noise = at(senses.parameters, Parameter::kNoise);
    const double height =
        at(senses.parameters, Parameter::kHeight) + senses.up().dot(senses.position() - senses.start);
    const double pressure = pressure_at(height) + (noise == 0 ? 0 : noise * normal(senses, 0));
    at(values, Value::kPressure) = with_lasting_errors(senses, lasting_errors(senses, Parameter::kErrors),
                                                       pressure, 1, 2, at(values, Value::kDrift));
  }
};

}  // namespace
}  // namespace barometer

const Program& barometer_program() {
  static const barometer::Barometer kBarometer;
  return kBarometer;
}

}  // namespace tessera
