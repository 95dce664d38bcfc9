// Mass properties: converts the tensor of a file to the principal moments that engines need.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <ignition/math/Inertial.hh>
#include <sdf/Link.hh>

#include "lpss/model/body.h"

namespace tessera {

// The principal moments of a symmetric tensor (kg m^2), and the rotation from its principal axes to the axes
// it was given in. A tensor that is diagonal already keeps its axes, so that equal boxes stay equal.
// Deterministic: the same tensor gives the same bits.
struct PrincipalInertia {
  Eigen::Vector3d moments;
  Eigen::Quaterniond axes;
};
PrincipalInertia principal_inertia(const Eigen::Matrix3d& tensor);

// INVALID_ARGUMENT unless the moments and products of inertia (kg m^2: xx yy zz, and xy xz yz) are those of a
// body: principal moments above 0, and none larger than the other two together.
absl::Status check_inertia(const Eigen::Vector3d& moments, const Eigen::Vector3d& products);

// Sets mass, moments, centre of mass and principal axes in `properties`. `inertial` is in the link's frame.
void set_inertia(const ignition::math::Inertiald& inertial, BodyProperties& properties);

// Mass properties from the link's collision shapes and their densities (SDF 1.11's <inertial auto="true">).
// INVALID_ARGUMENT for shapes that have no volume or whose volume is not known here, such as meshes.
absl::StatusOr<ignition::math::Inertiald> inertia_of_collisions(const sdf::Link& link);

}  // namespace tessera
