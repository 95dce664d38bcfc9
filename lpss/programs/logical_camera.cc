// Logical camera: which bodies are in the field of view of a camera, and where, instead of an image.
#include <absl/strings/str_cat.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "lpss/base/portable_math.h"
#include "lpss/model/limits.h"
#include "lpss/programs/builtin.h"
#include "lpss/programs/measuring.h"
#include "lpss/programs/numbers.h"
#include "lpss/programs/places.h"

namespace tessera {
namespace logical_camera {
namespace {

constexpr std::size_t kBodiesMax = 32;

enum class Parameter { kX, kY, kZ, kRoll, kPitch, kYaw, kNear, kFar, kAngle, kAspect, kBody };
constexpr auto kParameters = std::to_array<NumberSpec>({
    {"x", "m", 0, -1e3, 1e3, "Where it is in the body frame,"},
    {"y", "m", 0, -1e3, 1e3, "along its y axis,"},
    {"z", "m", 0, -1e3, 1e3, "and along its z axis."},
    {"roll", "rad", 0, -7, 7, "How it is turned in the body frame: about the x axis first,"},
    {"pitch", "rad", 0, -7, 7, "then about the y axis,"},
    {"yaw", "rad", 0, -7, 7, "then about the z axis of the body. It looks along its x axis."},
    {"near", "m", 0.1, 0, 1e3, "It sees what is no nearer than this along its line of sight,"},
    {"far", "m", 5, 1e-3, 1e3, "and no farther away than this."},
    {"angle", "rad", 1.047, 0.01, 3.1, "Its field of view from the left to the right."},
    {"aspect", "", 1.333, 1e-3, 1e3, "By how much the field of view is wider than high."},
    {"body", kBodyUnit, 0, 0, static_cast<double>(kBodyIdMax),
     "The body in whose triggers it looks; 0: the own one."},
});

enum class Value { kCount, kBody, kX = 1 + kBodiesMax, kY = kX + kBodiesMax, kZ = kY + kBodiesMax };

std::span<const NumberSpec> value_table() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const char* what : {"body_", "x_", "y_", "z_"}) {
      for (std::size_t n = 0; n < kBodiesMax; ++n) names.push_back(absl::StrCat(what, n));
    }
    return names;
  }();
  static const std::vector<NumberSpec> kTable = [] {
    constexpr std::array<absl::string_view, 4> kMeanings = {
        "The bodies that it sees, the nearest to the own one first; 0: no more.",
        "Their centres of mass from the camera: along its line of sight,", "to its left,", "and upwards."};
    std::vector<NumberSpec> table = {
        {"count", "", 0, 0, 0, "How many dynamic bodies it sees, of those in the triggers of that body."}};
    for (std::size_t n = 0; n < kNames.size(); ++n) {
      const std::size_t what = n / kBodiesMax;
      table.push_back({kNames[n], what == 0 ? kBodyUnit : "m", 0, 0, 0, kMeanings.at(what)});
    }
    return table;
  }();
  return kTable;
}

double parameter(const Senses& senses, Parameter place) { return at(senses.parameters, place); }

class LogicalCamera final : public Program {
 public:
  absl::string_view kind() const override { return "logical_camera"; }
  absl::string_view summary() const override {
    return "Tells which dynamic bodies are in its field of view, and where. What is in between does not "
           "count.";
  }
  std::span<const NumberSpec> parameters() const override { return kParameters; }
  std::span<const NumberSpec> inputs() const override { return {}; }
  std::span<const NumberSpec> values() const override { return value_table(); }

  void ask(const Senses& senses, std::span<const double>, Asker& asker) const override {
    asker.visitors(body_or_own(senses, Parameter::kBody));
  }

  void run(const Senses& senses, std::span<double> values, Actor& actor) const override {
    keep_measuring(senses, actor);
    const Eigen::Quaterniond body = senses.orientation();
    const Eigen::Vector3d eye =
        senses.position() + lever_of(senses, body, Eigen::Vector3d(senses.parameters.data()));
    const Eigen::Quaterniond into_view = (body * mounting(senses, Parameter::kRoll)).conjugate();
    const auto [sin, cos] = portable::sincos(parameter(senses, Parameter::kAngle) / 2);
    const double half_width = sin / cos;  // at a distance of 1 m
    const double half_height = half_width / parameter(senses, Parameter::kAspect);
    std::size_t count = 0;
    for (const ProgramFinding& found : senses.of(0)) {
      const Eigen::Vector3d seen = into_view * (Eigen::Vector3d(found.position.data()) - eye);
      const bool is_in_view =
          seen.x() >= parameter(senses, Parameter::kNear) && seen.x() <= parameter(senses, Parameter::kFar) &&
          std::abs(seen.y()) <= half_width * seen.x() && std::abs(seen.z()) <= half_height * seen.x();
      if (!is_in_view) continue;
      if (count < kBodiesMax) {
        (&at(values, Value::kBody))[count] = static_cast<double>(found.body.value);
        (&at(values, Value::kX))[count] = seen.x();
        (&at(values, Value::kY))[count] = seen.y();
        (&at(values, Value::kZ))[count] = seen.z();
      }
      ++count;
    }
    at(values, Value::kCount) = static_cast<double>(count);
    for (std::size_t n = count; n < kBodiesMax; ++n) {
      for (const Value what : {Value::kBody, Value::kX, Value::kY, Value::kZ}) (&at(values, what))[n] = 0;
    }
  }
};

}  // namespace
}  // namespace logical_camera

const Program& logical_camera_program() {
  static const logical_camera::LogicalCamera kLogicalCamera;
  return kLogicalCamera;
}

}  // namespace tessera
