// Collision geometry that libsdformat does not know or has no class for: it passes through it as a <mesh>
// with a name in the place of a file.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "lpss/model/shape.h"
#include "worlds/loader/convex_parts.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/xml.h"

namespace tessera {

struct PlacedHeightField {
  HeightField field;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // of its middle, at height 0
};

// Outlines in the xy plane, extruded along z from 0.
struct Prism {
  Outline outline;
  double height = 0;  // m
};
using Prisms = std::vector<Prism>;

struct Cone {
  ConvexHull hull;  // its tip, then its base, counter-clockwise seen from there
};

// A mesh file whose objects are divided into convex parts where the body moves.
struct DividedMesh {
  std::string file;
  std::size_t parts_max = 0;  // of an object
};

using GivenGeometry = std::variant<PlacedHeightField, Prisms, Cone, DividedMesh, Ground>;

inline constexpr std::size_t kOutlinePointsMax = 4096;  // of all outlines of a collision

// Whether `kind`, a child of <geometry>, is one of these: <tessera:heightfield>, <tessera:ground>,
// <heightmap>, <polyline>, <cone>.
bool is_given(const xml::Element& kind);

// The geometry of a <geometry> whose first such child is `kind`. Paths are relative to `directory`. Errors
// name file, line and element, and the bound.
absl::StatusOr<GivenGeometry> given_geometry(const xml::Element& kind, const std::filesystem::path& directory,
                                             Notices& notices);

ConvexHull prism_hull(const Outline& outline, double height);

// Closed, its triangles counter-clockwise from outside. The outlines of given geometry are known to be
// simple.
absl::StatusOr<TriangleMesh> prism_surface(const Prism& prism);

// Of cones and prisms, likewise; none for all else.
absl::StatusOr<std::vector<TriangleMesh>> surfaces_of(const GivenGeometry& given);

// For what a file names and is not there (Notices::count_missing_file), so that reading goes on.
GivenGeometry stand_in();

// How many parts a <mesh optimization="convex_decomposition"> allows; 0 for any other mesh. Takes from it
// what libsdformat does not know.
absl::StatusOr<std::size_t> take_optimization(xml::Element& mesh, Notices& notices);

}  // namespace tessera
