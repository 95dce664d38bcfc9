#include "worlds/gazebo/surroundings.h"

#include <absl/strings/string_view.h>

#include <algorithm>
#include <cmath>

#include "lpss/base/invariant.h"
#include "lpss/programs/registry.h"
#include "worlds/gazebo/numbers.h"

namespace tessera::gazebo {
namespace {

constexpr double kFromMax = 1e7;   // m
constexpr double kFieldMax = 1e3;  // T

void set(ProgramRecord& program, absl::string_view name, double value) {
  invariant(set_number(program, name, value).ok(), "a sensor has the numbers of its surroundings");
}

}  // namespace

bool Surroundings::is_one(const xml::Element& element) {
  return xml::is(element, "spherical_coordinates") || xml::is(element, "magnetic_field");
}

absl::Status Surroundings::take(const xml::Element& element) {
  if (xml::is(element, "magnetic_field")) {
    const absl::StatusOr<Eigen::Vector3d> field = xml::vector_in(element, xml::text_of(element));
    if (!field.ok()) return field.status();
    if (field->cwiseAbs().maxCoeff() > kFieldMax)
      return xml::invalid(element, "each part must be at most ", kFieldMax, " T");
    field_ = *field;
    return absl::OkStatus();
  }
  Numbers numbers;
  place_.latitude = numbers.read(element, "latitude_deg", 0);
  place_.longitude = std::remainder(numbers.read(element, "longitude_deg", 0), 360);
  place_.height = numbers.read(element, "elevation", 0);
  // SDF's is the way from the world's axes to those of the earth.
  place_.heading = std::remainder(0 - numbers.read(element, "heading_deg", 0), 360);
  if (!numbers.status().ok()) return numbers.status();
  if (std::abs(place_.latitude) > 90)
    return xml::invalid(element, "latitude_deg = ", place_.latitude, " must be -90 to 90");
  if (place_.height < -1e4 || place_.height > 1e6)
    return xml::invalid(element, "elevation = ", place_.height, " m must be -10,000 m to 1,000,000 m");
  return absl::OkStatus();
}

void Surroundings::tell(const Eigen::Vector3d& start, ProgramRecord& program) const {
  if (program.kind == "satellite") {
    set(program, "latitude", place_.latitude);
    set(program, "longitude", place_.longitude);
    set(program, "height", place_.height);
    set(program, "heading", place_.heading);
    // Farther away, the plane that touches the earth says nothing any more.
    if (start.cwiseAbs().maxCoeff() > kFromMax) return;
    set(program, "from_x", start.x());
    set(program, "from_y", start.y());
    set(program, "from_z", start.z());
  } else if (program.kind == "barometer") {
    set(program, "height", std::clamp(program.parameters.front() + start.z(), -5000.0, 1e6));
  } else if (program.kind == "magnetometer" && field_) {
    set(program, "field_x", field_->x());
    set(program, "field_y", field_->y());
    set(program, "field_z", field_->z());
  } else if (program.kind == "waypoints") {
    if (start.cwiseAbs().maxCoeff() > kFromMax) return;
    set(program, "from_x", start.x());
    set(program, "from_y", start.y());
  }
}

}  // namespace tessera::gazebo
