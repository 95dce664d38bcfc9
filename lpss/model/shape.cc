#include "lpss/model/shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "lpss/model/limits.h"

namespace tessera {
namespace {

double farthest(const std::vector<Eigen::Vector3d>& points) {
  double squared = 0;
  for (const Eigen::Vector3d& p : points) squared = std::max(squared, p.squaredNorm());
  return std::sqrt(squared);
}

struct BoundingRadius {
  double operator()(const Box& box) const { return box.size.norm() / 2; }
  double operator()(const Sphere& sphere) const { return sphere.radius; }
  double operator()(const Capsule& capsule) const { return capsule.length / 2 + capsule.radius; }
  double operator()(const Cylinder& cylinder) const {
    return Eigen::Vector2d(cylinder.length / 2, cylinder.radius).norm();
  }
  double operator()(const Ellipsoid& ellipsoid) const { return ellipsoid.radii.maxCoeff(); }
  double operator()(const Plane&) const { return std::numeric_limits<double>::infinity(); }
  double operator()(const ConvexHull& hull) const { return farthest(hull.points); }
  double operator()(const TriangleMesh& mesh) const { return farthest(mesh.vertices); }
  double operator()(const HeightField& field) const {
    double height = 0;
    for (double h : field.heights) height = std::max(height, std::abs(h));
    return Eigen::Vector3d((field.columns - 1) * field.spacing.x() / 2,
                           (field.rows - 1) * field.spacing.y() / 2, height)
        .norm();
  }
  double operator()(const Ground& ground) const {
    return ground.source == Ground::Source::kPlanet ? ground.radius + ground.height : 2 * kGroundReach;
  }
};

struct SmallestExtent {
  double operator()(const Box& box) const { return box.size.minCoeff(); }
  double operator()(const Sphere& sphere) const { return 2 * sphere.radius; }
  double operator()(const Capsule& capsule) const { return 2 * capsule.radius; }
  double operator()(const Cylinder& cylinder) const { return std::min(cylinder.length, 2 * cylinder.radius); }
  double operator()(const Ellipsoid& ellipsoid) const { return 2 * ellipsoid.radii.minCoeff(); }
  double operator()(const Plane&) const { return std::numeric_limits<double>::infinity(); }
  double operator()(const ConvexHull& hull) const {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : hull.points) box.extend(p);
    return box.isEmpty() ? 0 : box.sizes().minCoeff();
  }
  double operator()(const TriangleMesh&) const { return 0; }
  double operator()(const HeightField&) const { return 0; }
  double operator()(const Ground&) const { return 0; }
};

}  // namespace

const Shape* find_shape(std::span<const ShapeEntry> shapes, ShapeId id) {
  const auto place =
      std::lower_bound(shapes.begin(), shapes.end(), id,
                       [](const ShapeEntry& entry, ShapeId wanted) { return entry.id < wanted; });
  return place != shapes.end() && place->id == id ? place->shape.get() : nullptr;
}

bool is_bounded(const Shape& shape) {
  return std::none_of(shape.parts.begin(), shape.parts.end(),
                      [](const ShapePart& part) { return std::holds_alternative<Plane>(part.geometry); });
}

bool has_triggers(const Shape& shape) {
  return std::any_of(shape.parts.begin(), shape.parts.end(),
                     [](const ShapePart& part) { return part.material && part.material->trigger; });
}

double bounding_radius(const Geometry& geometry) { return std::visit(BoundingRadius{}, geometry); }

double bounding_radius(const Shape& shape, const Eigen::Vector3d& centre) {
  double radius = 0;
  for (const ShapePart& part : shape.parts) {
    radius = std::max(radius, (part.pose.position - centre).norm() + bounding_radius(part.geometry));
  }
  return radius;
}

double smallest_extent(const Shape& shape) {
  double extent = std::numeric_limits<double>::infinity();
  for (const ShapePart& part : shape.parts)
    extent = std::min(extent, std::visit(SmallestExtent{}, part.geometry));
  return extent;
}

Slab slab_around(const std::vector<Eigen::Vector3d>& points) {
  if (points.empty()) return {};
  const auto farthest_by = [&points](const auto& distance) {
    return *std::ranges::max_element(points, {}, distance);
  };
  const Eigen::Vector3d a = points.front();
  const Eigen::Vector3d b = farthest_by([&](const Eigen::Vector3d& p) { return (p - a).squaredNorm(); });
  const Eigen::Vector3d c =
      farthest_by([&](const Eigen::Vector3d& p) { return (p - a).cross(b - a).squaredNorm(); });
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  if (normal.squaredNorm() == 0) return {};
  const Eigen::Vector3d up = normal.normalized();
  const Eigen::Vector3d d = farthest_by([&](const Eigen::Vector3d& p) { return std::abs((p - a).dot(up)); });
  return {up, normal.norm() / (b - a).norm(), std::abs((d - a).dot(up))};
}

}  // namespace tessera
