#include "lpss/native/solid_hull.h"

#include <algorithm>

namespace tessera::native {
namespace {

using Polyhedron = collision::Polyhedron<Scalar>;

constexpr double kToleranceShare = 1e-3;  // of the smallest extent
constexpr double kToleranceGrowth = 1.5;  // until there are few enough corners
constexpr double kToleranceMost = 0.2;    // of the smallest extent

std::vector<Eigen::Vector3d> at_pose(const std::vector<Eigen::Vector3d>& points, const Pose& pose) {
  std::vector<Eigen::Vector3d> result = points;
  if (!pose.is_identity()) {
    for (Eigen::Vector3d& point : result) point = pose * point;
  }
  return result;
}

// With faces that are nearly in a plane as one, as far as the hull has any thickness then.
std::optional<Polyhedron> polyhedron_of(const collision::HullTriangles& hull, const Pose& pose) {
  std::vector<Vector> vertices;
  for (const Eigen::Vector3d& vertex : at_pose(hull.vertices, pose))
    vertices.push_back(vertex.cast<Scalar>());
  for (const double coplanar : {1e-4, 1e-5, 1e-6}) {
    std::optional<Polyhedron> found = collision::make_polyhedron<Scalar>(vertices, hull.triangles, coplanar);
    if (found) return found;
  }
  return std::nullopt;
}

}  // namespace

SolidHull::SolidHull(const ConvexHull& hull) : whole_(collision::convex_hull(hull.points)) {
  const auto is_usual = [](const std::optional<Polyhedron>& polyhedron, std::size_t most) {
    return polyhedron && polyhedron->vertices.size() <= most;
  };
  if (is_usual(polyhedron_of(whole_, Pose{}), kHullVerticesUsual)) return;
  const double extent = smallest_extent(Shape{{{hull, {}}}});
  for (double share = kToleranceShare; share < kToleranceMost; share *= kToleranceGrowth) {
    collision::HullTriangles fewer =
        collision::convex_hull(whole_.vertices, {share * extent, collision::kHullVerticesMax});
    if (!is_usual(polyhedron_of(fewer, Pose{}), collision::kHullVerticesMax)) continue;
    simplified_ = std::move(fewer);
    return;
  }
}

std::optional<ConvexHull> SolidHull::simplified() const {
  if (!simplified_) return std::nullopt;
  return ConvexHull{simplified_->vertices};
}

std::optional<Polyhedron> SolidHull::polyhedron(const Pose& pose) const {
  return polyhedron_of(simplified_ ? *simplified_ : whole_, pose);
}

std::vector<collision::HalfSpace<double>> SolidHull::planes(const Pose& pose) const {
  std::vector<collision::HalfSpace<double>> planes = collision::planes_of(whole_);
  if (pose.is_identity()) return planes;
  const Eigen::Matrix3d turn = pose.orientation.normalized().toRotationMatrix();
  for (collision::HalfSpace<double>& plane : planes) {
    plane.normal = (turn * plane.normal).normalized();
    plane.offset += plane.normal.dot(pose.position);
  }
  return planes;
}

}  // namespace tessera::native
