// The water that a link of SDF 1.10 takes along: <fluid_added_mass> in its <inertial>.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <optional>

#include "worlds/gazebo/model_parts.h"
#include "worlds/loader/notices.h"

namespace tessera::gazebo {

// The diagonal of the matrix.
struct AddedMass {
  Eigen::Vector3d mass = Eigen::Vector3d::Zero();     // kg
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();  // kg m^2
  bool has_others = false;                            // beside the diagonal
};

// That of a link, which has none any more; nothing where it has none. INVALID_ARGUMENT for what is no number.
absl::StatusOr<std::optional<AddedMass>> take_added_mass(xml::Element& link);

// Gives links that still have some the program hydrodynamics.
void take_added_masses(const ModelParts& parts, Notices& notices);

}  // namespace tessera::gazebo
