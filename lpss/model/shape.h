// Collision shapes, as a world describes them. Lengths in metres, in the frame of the part.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/ground.h"
#include "lpss/model/surface.h"

namespace tessera {

struct Box {
  Eigen::Vector3d size{1, 1, 1};  // full edge lengths
};
struct Sphere {
  double radius = 0.5;
};
// A cylinder along z closed by two hemispheres; `length` is that of the cylinder without them.
struct Capsule {
  double radius = 0.5;
  double length = 1;
};
// A cylinder along z, centred.
struct Cylinder {
  double radius = 0.5;
  double length = 1;
};
struct Ellipsoid {
  Eigen::Vector3d radii{0.5, 0.5, 0.5};
};
// The half space below the plane through the part's origin, infinite. Static bodies only.
struct Plane {
  Eigen::Vector3d normal{0, 0, 1};  // unit length, pointing out
};
struct ConvexHull {
  std::vector<Eigen::Vector3d> points;  // at least 4, not all in a plane
};
// A surface without interior; static bodies only.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::uint32_t> indices;  // three per triangle
  // Of a part of ground alone, which is solid below its triangles: their names, which do not depend on the
  // part.
  std::vector<std::uint32_t> names = {};
};
// A terrain of columns x rows samples, centred on the part's origin in x and y; static bodies only. Sample
// (column, row) lies at x = (column - (columns - 1) / 2) * spacing.x, y likewise, z = heights[row * columns +
// column].
struct HeightField {
  std::uint32_t columns = 0;
  std::uint32_t rows = 0;
  Eigen::Vector2d spacing{1, 1};
  std::vector<double> heights;
};

using Geometry = std::variant<Box, Sphere, Capsule, Cylinder, Ellipsoid, Plane, ConvexHull, TriangleMesh,
                              HeightField, Ground>;

// What a part has in the place of its body's properties of these names. A contact has those of the parts that
// touch.
struct PartMaterial {
  double friction = 0.5;
  double restitution = 0;
  std::uint32_t category = 1;
  std::uint32_t mask = 0xffffffff;
  // Its direction is in the frame of the part. It does not move: velocity and running, which must be 0, are
  // the body's.
  Surface surface;
  // It notices what overlaps it, and touches nothing: lpss/tick/triggers.h.
  bool trigger = false;

  friend bool operator==(const PartMaterial&, const PartMaterial&) = default;
};

// One geometry of a body; `pose` maps the part's frame to the body's.
struct ShapePart {
  Geometry geometry;
  Pose pose;
  std::optional<PartMaterial> material = {};  // none: like the body
};

// The shape of a body: one part, or a compound of several. Equal bodies share one.
struct Shape {
  std::vector<ShapePart> parts;
};

using ShapeRef = std::shared_ptr<const Shape>;

// Whether a part of the shape is a trigger.
bool has_triggers(const Shape& shape);

// A key of a shape in its world. A world that is described numbers its shapes from 0; later ones get higher
// ids, and none is given twice.
using ShapeId = std::uint64_t;

struct ShapeEntry {
  ShapeId id = 0;
  ShapeRef shape;  // never null
};

// Of a list that ascends by ids; null if it lacks the shape.
const Shape* find_shape(std::span<const ShapeEntry> shapes, ShapeId id);

// Whether the shape has a finite extent (no planes).
bool is_bounded(const Shape& shape);

// The radius of a sphere around `centre` (in the body's frame) that contains the whole shape; infinite if the
// shape is not bounded.
double bounding_radius(const Shape& shape, const Eigen::Vector3d& centre);

// The same radius for one geometry around the origin of its own frame.
double bounding_radius(const Geometry& geometry);

// The approximate smallest thickness of the shape: a fast body must not move farther than this in one step.
double smallest_extent(const Shape& shape);

// The plane that a cloud of points lies along, through three that are far apart.
struct Slab {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // 0 for points that are all on a line
  double width = 0;      // m: distance of the third of these points from the line of the others
  double thickness = 0;  // m: distance of the farthest point from the plane
};
Slab slab_around(const std::vector<Eigen::Vector3d>& points);

}  // namespace tessera
