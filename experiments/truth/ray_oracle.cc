#include "experiments/truth/ray_oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <variant>

#include "lpss/base/invariant.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kHullPointsMax = 128;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The part of a line that is inside of something.
struct Chord {
  double enters = -kInfinity;
  double leaves = kInfinity;

  bool is_empty() const { return !(enters <= leaves); }
  void cut(const Chord& other) {
    enters = std::max(enters, other.enters);
    leaves = std::min(leaves, other.leaves);
  }
  // Of two convex parts of one convex solid.
  void join(const Chord& other) {
    if (other.is_empty()) return;
    if (is_empty()) *this = other;
    enters = std::min(enters, other.enters);
    leaves = std::max(leaves, other.leaves);
  }
};

constexpr Chord kEmpty{kInfinity, -kInfinity};

// Where |origin + t direction| <= radius, in as many dimensions as the vectors have.
template <typename Vector>
Chord chord_of_ball(const Vector& origin, const Vector& direction, double radius) {
  const double squared = direction.squaredNorm();
  if (squared == 0) return origin.norm() <= radius ? Chord() : kEmpty;
  const double middle = -origin.dot(direction) / squared;
  const double nearest = (origin + middle * direction).norm();
  if (nearest > radius) return kEmpty;
  const double half = std::sqrt((radius - nearest) * (radius + nearest) / squared);
  return {middle - half, middle + half};
}

Chord chord_of_half_space(double height, double slope) {
  if (slope == 0) return height <= 0 ? Chord() : kEmpty;
  const double at = -height / slope;
  return slope < 0 ? Chord{at, kInfinity} : Chord{-kInfinity, at};
}

}  // namespace

RayOracle::RayOracle(const Geometry& geometry, double grown) {
  if (const auto* box = std::get_if<Box>(&geometry)) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0})
        half_spaces_.push_back({sign * Vector3d::Unit(axis), box->size[axis] / 2 + grown});
    }
  } else if (const auto* plane = std::get_if<Plane>(&geometry)) {
    half_spaces_.push_back({plane->normal, grown});
  } else if (const auto* hull = std::get_if<ConvexHull>(&geometry)) {
    add_hull(hull->points, grown);
  } else if (const auto* ball = std::get_if<Sphere>(&geometry)) {
    round_ = Round{Vector3d::Constant(ball->radius + grown)};
  } else if (const auto* ellipsoid = std::get_if<Ellipsoid>(&geometry)) {
    round_ = Round{ellipsoid->radii + Vector3d::Constant(grown)};
  } else if (const auto* capsule = std::get_if<Capsule>(&geometry)) {
    round_ = Round{Vector3d::Constant(capsule->radius + grown), capsule->length / 2};
  } else if (const auto* cylinder = std::get_if<Cylinder>(&geometry)) {
    round_ = Round{Vector3d::Constant(cylinder->radius + grown), 0, true};
    for (const double sign : {-1.0, 1.0})
      half_spaces_.push_back({sign * Vector3d::UnitZ(), cylinder->length / 2 + grown});
  } else {
    invariant(false, "rays are compared at convex solids");
  }
}

void RayOracle::add_hull(const std::vector<Vector3d>& points, double grown) {
  invariant(points.size() <= kHullPointsMax, "hulls that rays are compared at have few points");
  for (std::size_t a = 0; a < points.size(); ++a) {
    for (std::size_t b = a + 1; b < points.size(); ++b) {
      for (std::size_t c = b + 1; c < points.size(); ++c) {
        Vector3d normal = (points[b] - points[a]).cross(points[c] - points[a]);
        if (normal.norm() < 1e-12) continue;
        normal.normalize();
        double above = 0, below = 0;
        for (const Vector3d& point : points) {
          const double height = normal.dot(point - points[a]);
          above = std::max(above, height);
          below = std::min(below, height);
        }
        if (above > 1e-9 && below < -1e-9) continue;
        if (above > 1e-9) normal = -normal;
        const double offset = normal.dot(points[a]) + grown;
        const bool known = std::ranges::any_of(
            half_spaces_, [&](const HalfSpace& face) { return (face.normal - normal).norm() < 1e-9; });
        if (!known) half_spaces_.push_back({normal, offset});
      }
    }
  }
}

std::optional<double> RayOracle::distance(const Vector3d& origin, const Vector3d& direction) const {
  Chord inside;
  for (const HalfSpace& face : half_spaces_)
    inside.cut(chord_of_half_space(face.normal.dot(origin) - face.offset, face.normal.dot(direction)));
  if (round_) {
    const Vector3d o = origin.cwiseQuotient(round_->radii);
    const Vector3d d = direction.cwiseQuotient(round_->radii);
    Chord around = kEmpty;
    if (round_->is_tube || round_->half_length > 0) {
      around = chord_of_ball<Eigen::Vector2d>(o.head<2>(), d.head<2>(), 1);
      if (!round_->is_tube) {
        around.cut(chord_of_half_space(origin.z() - round_->half_length, direction.z()));
        around.cut(chord_of_half_space(-origin.z() - round_->half_length, -direction.z()));
      }
    }
    if (!round_->is_tube) {
      for (const double end : {-round_->half_length, round_->half_length})
        around.join(chord_of_ball<Vector3d>(o - Vector3d(0, 0, end / round_->radii.z()), d, 1));
    }
    inside.cut(around);
  }
  if (inside.is_empty() || inside.enters < 0) return std::nullopt;
  return inside.enters;
}

RayOracle::Normals RayOracle::normals_at(const Vector3d& point, double tolerance) const {
  Normals normals;
  for (const HalfSpace& face : half_spaces_) {
    if (std::abs(face.normal.dot(point) - face.offset) <= tolerance) normals.push_back(face.normal);
  }
  if (!round_) return normals;
  Vector3d from = point;
  from.z() -= round_->is_tube ? point.z() : std::clamp(point.z(), -round_->half_length, round_->half_length);
  const Vector3d scaled = from.cwiseQuotient(round_->radii);
  const Vector3d out = scaled.cwiseQuotient(round_->radii).normalized();
  const double height = (scaled.norm() - 1) * from.dot(out) / std::max(scaled.norm(), 1e-12);
  if (std::abs(height) <= tolerance) normals.push_back(out);
  return normals;
}

double RayOracle::normal_error(const Vector3d& point, const Vector3d& normal, double tolerance) const {
  double least = std::numbers::pi;
  for (const Vector3d& right : normals_at(point, tolerance))
    least = std::min(least, std::atan2(right.cross(normal).norm(), right.dot(normal)));
  return least;
}

}  // namespace tessera::truth
