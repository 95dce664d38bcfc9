#include "lpss/observe/shape_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <variant>
#include <vector>

#include "lpss/collision/closest.h"
#include "lpss/model/checks.h"

namespace tessera {
namespace {

using Eigen::Vector3d;
using Core = collision::Core<double>;
using Kind = Core::Kind;

bool is_surface(const Geometry& geometry) {
  return std::holds_alternative<TriangleMesh>(geometry) || std::holds_alternative<HeightField>(geometry);
}

bool is_convex(const Geometry& geometry) {
  return !is_surface(geometry) && !std::holds_alternative<Plane>(geometry) &&
         !std::holds_alternative<Ground>(geometry);
}

std::size_t triangles_of(const Geometry& geometry) {
  if (const auto* const mesh = std::get_if<TriangleMesh>(&geometry)) return mesh->indices.size() / 3;
  const auto* const field = std::get_if<HeightField>(&geometry);
  if (field == nullptr || field->columns == 0 || field->rows == 0) return 0;
  return 2 * std::size_t{field->columns - 1} * (field->rows - 1);
}

// Nothing of it is rounded off. Refers to the points of a hull.
Core core_of(const Geometry& geometry) {
  if (const auto* const box = std::get_if<Box>(&geometry)) return {.kind = Kind::kBox, .half = box->size / 2};
  if (const auto* const sphere = std::get_if<Sphere>(&geometry))
    return {.kind = Kind::kPoint, .margin = sphere->radius};
  if (const auto* const capsule = std::get_if<Capsule>(&geometry))
    return {.kind = Kind::kSegment, .half = {0, 0, capsule->length / 2}, .margin = capsule->radius};
  if (const auto* const cylinder = std::get_if<Cylinder>(&geometry))
    return {.kind = Kind::kCylinder, .half = {cylinder->radius, cylinder->radius, cylinder->length / 2}};
  if (const auto* const ellipsoid = std::get_if<Ellipsoid>(&geometry))
    return {.kind = Kind::kEllipsoid, .half = ellipsoid->radii};
  const std::vector<Vector3d>& points = std::get<ConvexHull>(geometry).points;
  Core core{.kind = Kind::kPoints, .points = points};
  for (const Vector3d& point : points) core.middle += point / static_cast<double>(points.size());
  return core;
}

// Calls visit(corners) with each triangle of a surface, in its order.
template <typename Visit>
void for_each_triangle(const TriangleMesh& mesh, const Visit& visit) {
  for (std::size_t n = 0; n + 2 < mesh.indices.size(); n += 3) {
    visit(std::array{mesh.vertices[mesh.indices[n]], mesh.vertices[mesh.indices[n + 1]],
                     mesh.vertices[mesh.indices[n + 2]]});
  }
}

// Each cell has two triangles, parted by the diagonal from its high-x to its high-y corner, as in contacts.
template <typename Visit>
void for_each_triangle(const HeightField& field, const Visit& visit) {
  const auto at = [&](std::uint32_t column, std::uint32_t row) {
    return Vector3d((column - (field.columns - 1) / 2.0) * field.spacing.x(),
                    (row - (field.rows - 1) / 2.0) * field.spacing.y(),
                    field.heights[std::size_t{row} * field.columns + column]);
  };
  for (std::uint32_t row = 0; row + 1 < field.rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < field.columns; ++column) {
      visit(std::array{at(column, row), at(column + 1, row), at(column, row + 1)});
      visit(std::array{at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)});
    }
  }
}

// A part with its place.
struct Placed {
  const Geometry& geometry;
  Pose pose;
  Eigen::Matrix3d rotation;

  Placed(const PosedShape& of, const ShapePart& part)
      : geometry(part.geometry),
        pose(of.pose * part.pose),
        rotation(pose.orientation.normalized().toRotationMatrix()) {}
};

// The nearest so far.
class Nearest {
 public:
  explicit Nearest(double reach) : reach_(reach) {}

  double reach() const { return found_ ? found_->gap : reach_; }  // m, of what would be nearer
  const std::optional<ShapeDistance>& found() const { return found_; }

  void take(const ShapeDistance& distance) {
    if (found_ ? distance.gap < found_->gap : distance.gap <= reach_) found_ = distance;
  }

 private:
  double reach_;
  std::optional<ShapeDistance> found_;
};

ShapeDistance swapped(const ShapeDistance& distance) {
  return {distance.gap, distance.on_b, distance.on_a, -distance.normal};
}

std::optional<ShapeDistance> closest(const Placed& a, const Core& core_a, const Placed& b, const Core& core_b,
                                     double reach) {
  const collision::Placement<double> placement{a.rotation, b.rotation, b.pose.position - a.pose.position};
  const auto found =
      collision::search_closest<double>(core_a, core_b, placement, std::max(reach, 0.0), Vector3d::Zero());
  if (!found) return std::nullopt;
  return ShapeDistance{found->gap, a.pose.position + found->on_a, a.pose.position + found->on_b,
                       found->normal};
}

// `b` is a plane.
ShapeDistance above_plane(const Placed& a, const Core& core, const Placed& b) {
  const Vector3d normal = (b.rotation * std::get<Plane>(b.geometry).normal).normalized();
  const collision::PlacedCore<double> placed(core, a.rotation, a.pose.position);
  const Vector3d lowest = placed.support(-normal) - normal * core.margin;
  const double gap = normal.dot(lowest - b.pose.position);
  return {gap, lowest, lowest - normal * gap, normal};
}

// `b` is a surface.
void approach_surface(const Placed& a, const Core& core, const Placed& b, Nearest& nearest) {
  const Vector3d middle = b.rotation.transpose() * (a.pose.position - b.pose.position);
  const double radius = bounding_radius(a.geometry);
  const auto approach = [&](const std::array<Vector3d, 3>& corners) {
    Eigen::AlignedBox3d box(corners[0]);
    box.extend(corners[1]);
    box.extend(corners[2]);
    if (box.exteriorDistance(middle) - radius > nearest.reach()) return;
    const Core triangle{
        .kind = Kind::kPoints, .points = corners, .middle = (corners[0] + corners[1] + corners[2]) / 3};
    if (const auto found = closest(a, core, b, triangle, nearest.reach())) nearest.take(*found);
  };
  if (const auto* const mesh = std::get_if<TriangleMesh>(&b.geometry)) {
    for_each_triangle(*mesh, approach);
  } else {
    for_each_triangle(std::get<HeightField>(b.geometry), approach);
  }
}

// `a` is convex.
void approach(const Placed& a, const Placed& b, Nearest& nearest) {
  const Core core = core_of(a.geometry);
  if (is_surface(b.geometry)) return approach_surface(a, core, b, nearest);
  if (std::holds_alternative<Plane>(b.geometry)) return nearest.take(above_plane(a, core, b));
  if (const auto found = closest(a, core, b, core_of(b.geometry), nearest.reach())) nearest.take(*found);
}

}  // namespace

absl::Status check_distance(const Shape& a, const Shape& b) {
  for (const Shape* const shape : {&a, &b}) {
    for (const ShapePart& part : shape->parts) {
      if (std::holds_alternative<Ground>(part.geometry))
        return refused("a ground has no distance from a body: ask what is near the body");
      if (const std::size_t triangles = triangles_of(part.geometry); triangles > kDistanceTrianglesMax) {
        return refused("a mesh or height field of ", triangles, " triangles: at most ", kDistanceTrianglesMax,
                       " have a distance from a body");
      }
    }
  }
  for (const ShapePart& part : a.parts) {
    for (const ShapePart& other : b.parts) {
      if (!is_convex(part.geometry) && !is_convex(other.geometry))
        return refused("planes, meshes and height fields have distances from convex shapes alone");
    }
  }
  return absl::OkStatus();
}

std::optional<ShapeDistance> distance_of(const PosedShape& a, const PosedShape& b, double reach) {
  Nearest nearest(reach);
  for (const ShapePart& part : a.shape.parts) {
    const Placed of_a(a, part);
    for (const ShapePart& other : b.shape.parts) {
      const Placed of_b(b, other);
      if (is_convex(part.geometry)) {
        approach(of_a, of_b, nearest);
        continue;
      }
      Nearest reverse(nearest.reach());
      approach(of_b, of_a, reverse);
      if (reverse.found()) nearest.take(swapped(*reverse.found()));
    }
  }
  return nearest.found();
}

}  // namespace tessera
