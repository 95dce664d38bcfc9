#include "client_sdk/live/sensor_programs.h"

#include <algorithm>
#include <array>

#include "lpss/programs/places.h"

namespace tessera::live {

double parameter_of(const FoundProgram& program, absl::string_view name) {
  const auto found = std::ranges::find(program.parameters, name, &NamedNumber::name);
  return found == program.parameters.end() ? 0 : found->value;
}

std::optional<Pose> mounting_of(const FoundProgram& program) {
  const auto number = [&](absl::string_view name) { return parameter_of(program, name); };
  constexpr std::array<absl::string_view, 5> kMounted = {"camera", "imu", "logical_camera", "magnetometer",
                                                         "ranger"};
  if (std::ranges::find(kMounted, absl::string_view(program.kind)) == kMounted.end()) return std::nullopt;
  return Pose{{number("x"), number("y"), number("z")},
              turned_by(number("roll"), number("pitch"), number("yaw"))};
}

bool is_camera(const FoundProgram& program) {
  return program.kind == "ranger" && parameter_of(program, "plane") >= 0.5;
}

RayFan fan_of(const FoundProgram& program) {
  const auto number = [&](absl::string_view name) { return parameter_of(program, name); };
  return {.rays = static_cast<std::size_t>(number("rays")),
          .rows = static_cast<std::size_t>(number("rows")),
          .heading = number("heading"),
          .angle = number("angle"),
          .elevation = number("elevation"),
          .row_angle = number("row_angle"),
          .on_plane = is_camera(program)};
}

}  // namespace tessera::live
