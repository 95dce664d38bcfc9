// Mass properties: converts the tensor of a file to the principal moments that engines need.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <ignition/math/Inertial.hh>
#include <optional>
#include <sdf/Link.hh>
#include <string>
#include <vector>

#include "lpss/model/body.h"
#include "worlds/loader/collision_shape.h"

namespace tessera {

// The principal moments of a symmetric tensor (kg m^2), and the rotation from its principal axes to the axes
// it was given in. A tensor that is diagonal already keeps its axes, so that equal boxes stay equal.
// Deterministic: the same tensor gives the same bits.
struct PrincipalInertia {
  Eigen::Vector3d moments;
  Eigen::Quaterniond axes;
};
PrincipalInertia principal_inertia(const Eigen::Matrix3d& tensor);

// The mass of a body, and its tensor about the centre of mass.
struct MassProperties {
  double mass = 1;                                     // kg
  Eigen::Vector3d moments{1, 1, 1};                    // xx yy zz, kg m^2
  Eigen::Vector3d products = Eigen::Vector3d::Zero();  // xy xz yz, kg m^2
};

// Changes mass properties that no body has, or whose numbers no engine can divide by, to the nearest that
// one can have, and says what was wrong, a fault an entry; empty: nothing was changed.
//
// A mass below kMassMin becomes kMassMin, with the tensor in proportion. A tensor is that of some
// distribution of mass if its second moments (half the trace, less each principal moment) are not negative:
// negative ones become kSpreadMin of the largest. Without any above 0 the tensor becomes that of a ball of
// water of the mass. A mass of 0 remains, with its tensor: others decide what has it (give_least_masses()).
std::vector<std::string> repair(MassProperties& properties);

// Sets mass, moments, centre of mass and principal axes in `properties`. `inertial` is in the link's frame.
void set_inertia(const ignition::math::Inertiald& inertial, BodyProperties& properties);

// Mass properties from the link's collision shapes and their densities (SDF 1.11's <inertial auto="true">):
// of a mesh file, from the volume within its surface. INVALID_ARGUMENT for shapes that have no volume, such
// as planes and surfaces with holes. Errors of meshes as read_mesh_file().
absl::StatusOr<ignition::math::Inertiald> inertia_of_collisions(const sdf::Link& link, MeshLibrary& meshes);

// What the collision shapes of a link displace.
struct Displacement {
  Eigen::Vector3d centre{0, 0, 0};  // m, of the volume, in the link's frame
  Eigen::Vector3d size{0, 0, 0};  // m, of the box along its axes with this volume, shaped as the moments are
};
// None where they have no volume, such as planes and surfaces with holes.
std::optional<Displacement> displacement_of_collisions(const sdf::Link& link, MeshLibrary& meshes);

}  // namespace tessera
