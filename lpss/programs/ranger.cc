// Ranger: distances along rays that fan out from a place of the body, as a laser scanner measures them.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/noise.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/places.h"

namespace tessera {
namespace ranger {
namespace {

constexpr std::size_t kRaysMax = 16;

enum class Parameter { kX, kY, kZ, kRays, kAngle, kHeading, kElevation, kLeast, kMost, kMask, kNoise };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m", 0, -1e3, 1e3, "Where it is in the body frame,"},
    {"y", "m", 0, -1e3, 1e3, "along its y axis,"},
    {"z", "m", 0, -1e3, 1e3, "and along its z axis."},
    {"rays", "", 1, 1, static_cast<double>(kRaysMax), "How many rays; a part of one does not count."},
    {"angle", "rad", 0, 0, 6.2832, "From the first to the last ray, about the body's z axis."},
    {"heading", "rad", 0, -6.2832, 6.2832,
     "Of the middle of the fan, from the body's x axis; above 0 to the left."},
    {"elevation", "rad", 0, -1.5708, 1.5708, "Of all rays, above the body's x-y plane."},
    {"least", "m", 0, 0, kProgramCastMax, "Nearer than that, a ray meets nothing."},
    {"most", "m", 30, 0.001, kProgramCastMax, "What is farther away is not seen."},
    {"mask", "", 4294967295, 0, 4294967295, "The collision categories that it sees, as bits."},
    {"noise", "m", 0, 0, 1e3, "The standard deviation of each distance, in a tick."},
});

enum class Value { kHits, kNearest, kRange };
constexpr auto kValues = std::to_array<NumberSpec>({
    {"hits", "", 0, 0, 0, "How many rays meet something."},
    {"nearest", "m", 0, 0, 0, "The smallest distance; `most` if no ray meets anything."},
    {"range_0", "m", 0, 0, 0, "The distance along the first ray, to the right; `most` if it meets nothing."},
    {"range_1", "m", 0, 0, 0, "Along the next one, and so on."},
    {"range_2", "m", 0, 0, 0, "Likewise."},
    {"range_3", "m", 0, 0, 0, "Likewise."},
    {"range_4", "m", 0, 0, 0, "Likewise."},
    {"range_5", "m", 0, 0, 0, "Likewise."},
    {"range_6", "m", 0, 0, 0, "Likewise."},
    {"range_7", "m", 0, 0, 0, "Likewise."},
    {"range_8", "m", 0, 0, 0, "Likewise."},
    {"range_9", "m", 0, 0, 0, "Likewise."},
    {"range_10", "m", 0, 0, 0, "Likewise."},
    {"range_11", "m", 0, 0, 0, "Likewise."},
    {"range_12", "m", 0, 0, 0, "Likewise."},
    {"range_13", "m", 0, 0, 0, "Likewise."},
    {"range_14", "m", 0, 0, 0, "Likewise."},
    {"range_15", "m", 0, 0, 0, "Likewise."},
});
static_assert(kValues.size() == static_cast<std::size_t>(Value::kRange) + kRaysMax);

class Ranger final : public Program {
 public:
  absl::string_view kind() const override { return "ranger"; }
  absl::string_view summary() const override {
    return "Measures distances along up to 16 rays that fan out. Beyond, a body has several.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return kValues; }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    const auto of = [&](Parameter place) { return at(senses.parameters, place); };
    const Eigen::Quaterniond turn = senses.orientation();
    const Eigen::Vector3d from =
        senses.position() + lever_of(senses, turn, Eigen::Vector3d(senses.parameters.data()));
    const auto [rise, flat] = portable::sincos(of(Parameter::kElevation));
    const auto mask = static_cast<std::uint32_t>(of(Parameter::kMask));
    const std::size_t rays = rays_of(senses);
    const double step = rays > 1 ? of(Parameter::kAngle) / static_cast<double>(rays - 1) : 0;
    const double first = of(Parameter::kHeading) - step * static_cast<double>(rays - 1) / 2;
    const double least = least_of(senses);
    for (std::size_t n = 0; n < rays; ++n) {
      const auto [sin, cos] = portable::sincos(first + step * static_cast<double>(n));
      const Eigen::Vector3d direction = turn * Eigen::Vector3d(flat * cos, flat * sin, rise).normalized();
      asker.cast(from + least * direction, direction, of(Parameter::kMost) - least, 0, mask);
    }
  }

  void run(const Senses& senses, std::span<double> values, Actor&) const override {
    const double most = at(senses.parameters, Parameter::kMost);
    const double noise = at(senses.parameters, Parameter::kNoise);
    double& hits = at(values, Value::kHits);
    double& nearest = at(values, Value::kNearest);
    hits = 0;
    nearest = most;
    const std::span<double> ranges = values.subspan(static_cast<std::size_t>(Value::kRange));
    std::ranges::fill(ranges, 0);
    for (std::uint32_t n = 0; n < rays_of(senses); ++n) {
      double& range = ranges[n];
      range = most;
      const std::span<const ProgramFinding> found = senses.of(n);
      if (found.empty()) continue;
      hits += 1;
      range = least_of(senses) + found.front().distance;
      if (noise > 0) range = std::clamp(range + noise * normal(senses, n), 0.0, most);
      nearest = std::min(nearest, range);
    }
  }

 private:
  static std::size_t rays_of(const Senses& senses) {
    return static_cast<std::size_t>(at(senses.parameters, Parameter::kRays));
  }
  static double least_of(const Senses& senses) {
    return std::min(at(senses.parameters, Parameter::kLeast), at(senses.parameters, Parameter::kMost));
  }
};

}  // namespace
}  // namespace ranger

const Program& ranger_program() {
  static const ranger::Ranger kRanger;
  return kRanger;
}

}  // namespace tessera
