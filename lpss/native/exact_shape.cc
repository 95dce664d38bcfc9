#include "lpss/native/exact_shape.h"

#include <utility>
#include <variant>

namespace tessera::native {

using ExactCore = collision::Core<double>;
using ExactPoints = std::vector<Eigen::Vector3d>;

ExactShape::ExactShape(const Geometry& geometry) {
  if (const auto* box = std::get_if<tessera::Box>(&geometry)) {
    core_ = {.kind = ExactCore::Kind::kBox, .half = box->size / 2};
  } else if (const auto* sphere = std::get_if<Sphere>(&geometry)) {
    core_ = {.kind = ExactCore::Kind::kPoint, .margin = sphere->radius};
  } else if (const auto* capsule = std::get_if<Capsule>(&geometry)) {
    core_ = {
        .kind = ExactCore::Kind::kSegment, .half = {0, 0, capsule->length / 2}, .margin = capsule->radius};
  } else if (const auto* cylinder = std::get_if<Cylinder>(&geometry)) {
    core_ = {.kind = ExactCore::Kind::kCylinder,
             .half = {cylinder->radius, cylinder->radius, cylinder->length / 2}};
  } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&geometry)) {
    core_ = {.kind = ExactCore::Kind::kEllipsoid, .half = ellipsoid->radii};
  } else if (const auto* hull = std::get_if<ConvexHull>(&geometry)) {
    set_points(hull->points, 0);
  } else {
    is_convex_ = false;
  }
}

ExactShape::ExactShape(const Part& part) : core_{.half = part.half} {
  using Kind = collision::Core<Scalar>::Kind;
  switch (part.core.kind) {
    case Kind::kPoint:
      core_ = {.kind = ExactCore::Kind::kPoint, .margin = part.radius};
      return;
    case Kind::kSegment:
      core_ = {.kind = ExactCore::Kind::kSegment, .half = {0, 0, part.half.z()}, .margin = part.half.x()};
      return;
    case Kind::kBox:
      core_.kind = ExactCore::Kind::kBox;
      return;
    case Kind::kCylinder:
      core_.kind = ExactCore::Kind::kCylinder;
      return;
    case Kind::kEllipsoid:
      core_.kind = ExactCore::Kind::kEllipsoid;
      return;
    case Kind::kPoints:
      break;
  }
  const bool has_corners = !part.core.shape_points.empty();
  const auto corners = has_corners ? part.core.shape_points : part.core.points;
  ExactPoints points;
  for (const Vector& corner : corners) points.push_back(corner.cast<double>());
  set_points(std::move(points), has_corners ? 0 : double(part.core.margin));
}

ExactShape::ExactShape(const MeshTriangle<Scalar>& triangle) {
  ExactPoints corners;
  for (const Vector& corner : triangle.vertex) corners.push_back(corner.cast<double>());
  set_points(std::move(corners), 0);
}

Eigen::Vector3d ExactShape::farthest(const Eigen::Matrix3d& rotation,
                                     const Eigen::Vector3d& direction) const {
  const collision::PlacedCore<double> placed(core_, rotation, Eigen::Vector3d::Zero());
  return placed.support(direction) + direction.normalized() * core_.margin;
}

void ExactShape::set_points(ExactPoints points, double margin) {
  points_ = std::move(points);
  core_ = {.kind = ExactCore::Kind::kPoints, .margin = margin, .points = points_};
  core_.middle.setZero();
  for (const Eigen::Vector3d& point : points_) core_.middle += point / double(points_.size());
}

}  // namespace tessera::native
