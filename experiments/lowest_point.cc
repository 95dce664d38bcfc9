#include "experiments/lowest_point.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>

namespace tessera {
namespace {

using Eigen::Vector3d;

// m: how far a geometry reaches along `direction`, in its own frame.
struct Reach {
  Vector3d direction;

  double operator()(const Box& box) const { return direction.cwiseAbs().dot(box.size) / 2; }
  double operator()(const Sphere& ball) const { return ball.radius; }
  double operator()(const Capsule& capsule) const {
    return capsule.radius + std::abs(direction.z()) * capsule.length / 2;
  }
  double operator()(const Cylinder& cylinder) const {
    return cylinder.radius * direction.head<2>().norm() + std::abs(direction.z()) * cylinder.length / 2;
  }
  double operator()(const Ellipsoid& ellipsoid) const {
    return direction.cwiseProduct(ellipsoid.radii).norm();
  }
  double operator()(const ConvexHull& hull) const {
    double farthest = -std::numeric_limits<double>::infinity();
    for (const Vector3d& point : hull.points) farthest = std::max(farthest, direction.dot(point));
    return farthest;
  }
  // Only static bodies have others.
  template <typename Other>
  double operator()(const Other&) const {
    return -std::numeric_limits<double>::infinity();
  }
};

}  // namespace

double lowest_point(const Shape& shape, const Pose& body) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const ShapePart& part : shape.parts) {
    const Pose pose = body * part.pose;
    lowest = std::min(
        lowest, pose.position.z() -
                    std::visit(Reach{pose.orientation.conjugate() * -Vector3d::UnitZ()}, part.geometry));
  }
  return lowest;
}

}  // namespace tessera
