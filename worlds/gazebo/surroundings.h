// What a <world> says of the earth around it, for the sensors of its models.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>
#include <optional>

#include "lpss/model/program.h"
#include "worlds/loader/xml.h"

namespace tessera::gazebo {

class Surroundings {
 public:
  // A <spherical_coordinates> or <magnetic_field> of the world. INVALID_ARGUMENT for what is no number.
  static bool is_one(const xml::Element& element);
  absl::Status take(const xml::Element& element);

  // Tells a program of a sensor what it needs to know. `start`: where the centre of mass of its body is, in m
  // from the origin of the world.
  void tell(const Eigen::Vector3d& start, ProgramRecord& program) const;

 private:
  // Of the origin of the world.
  struct Place {
    double latitude = 0;   // deg
    double longitude = 0;  // deg
    double height = 0;     // m
    double heading = 0;    // deg, of the world's x axis: 0 is east, 90 north
  };
  Place place_;
  std::optional<Eigen::Vector3d> field_;  // T
};

}  // namespace tessera::gazebo
