// Convex shapes as a distance algorithm sees them: a core, and all that is within a margin of it.
//
// A core keeps directions steady where shapes touch: cores are then apart by two margins, and the line
// between them has a direction. It rounds edges and corners off, though. What is lost so is known in each
// direction, and added in the one that is found.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <span>

#include "lpss/collision/shapes.h"

namespace tessera::collision {

template <typename Scalar>
struct Core {
  enum class Kind : std::uint8_t { kPoint, kSegment, kBox, kCylinder, kEllipsoid, kPoints };

  Kind kind = Kind::kPoint;
  // m: of a segment along z (0, 0, half its length), of boxes half the edges, of cylinders along z the
  // radius, twice, and half the length, of ellipsoids the radii. Of the shape, not of its core.
  Vector3<Scalar> half = Vector3<Scalar>::Zero();
  Scalar margin = 0;                          // m, of the ball around the core
  std::span<const Vector3<Scalar>> points{};  // of a core of kPoints
  std::span<const Vector3<Scalar>>
      shape_points{};           // the corners of its shape; none: the shape has round ones
  Scalar rounded_off_most = 0;  // m, of kPoints: of rounded_off() in any direction
  // m, of the shape: that of kPoints may be far from the origin.
  Vector3<Scalar> middle = Vector3<Scalar>::Zero();
};

// A core somewhere. All vectors are in the axes in which it is placed.
template <typename Scalar>
class PlacedCore {
 public:
  using Vector = Vector3<Scalar>;
  using Matrix = Matrix3<Scalar>;
  using Kind = typename Core<Scalar>::Kind;

  PlacedCore(const Core<Scalar>& core, const Matrix& rotation, const Vector& centre)
      : core_(core), rotation_(rotation), centre_(centre) {}

  Scalar margin() const { return core_.margin; }

  // The point of the core that is farthest along `direction`, of any length but 0.
  Vector support(const Vector& direction) const { return support(direction, core_.margin, core_.points); }

  // Likewise of the shape.
  Vector shape_support(const Vector& direction) const {
    const bool has_corners = !core_.shape_points.empty();
    const Vector point = support(direction, 0, has_corners ? core_.shape_points : core_.points);
    const bool is_round = core_.kind == Kind::kPoint || core_.kind == Kind::kSegment ||
                          (core_.kind == Kind::kPoints && !has_corners);
    return is_round ? Vector(point + direction * (core_.margin / direction.norm())) : point;
  }

  // m, how much farther the shape reaches along `direction`, of length 1, than its core and the margin.
  Scalar rounded_off(const Vector& direction) const {
    switch (core_.kind) {
      case Kind::kBox:
        return ((rotation_.transpose() * direction).cwiseAbs().sum() - 1) * core_.margin;
      case Kind::kCylinder: {
        const Scalar x = rotation_.col(0).dot(direction);
        const Scalar y = rotation_.col(1).dot(direction);
        return (std::sqrt(x * x + y * y) + std::abs(axis().dot(direction)) - 1) * core_.margin;
      }
      case Kind::kPoints: {
        if (core_.shape_points.empty()) return 0;
        const Vector local = rotation_.transpose() * direction;
        const Vector more = farthest(core_.shape_points, local) - farthest(core_.points, local);
        return local.dot(more) - core_.margin;
      }
      default:
        return 0;
    }
  }

  // At least as much, at less cost.
  Scalar rounded_off_at_most(const Vector& direction) const {
    return core_.kind == Kind::kPoints ? core_.rounded_off_most : rounded_off(direction);
  }

 private:
  // Of the shape less `margin`.
  Vector support(const Vector& direction, Scalar margin, std::span<const Vector> points) const {
    switch (core_.kind) {
      case Kind::kPoint:
        return centre_;
      case Kind::kSegment:
        return centre_ + std::copysign(core_.half.z(), axis().dot(direction)) * axis();
      case Kind::kBox: {
        Vector point = centre_;
        for (int k = 0; k < 3; ++k) {
          const Vector side = rotation_.col(k);
          point += std::copysign(core_.half[k] - margin, side.dot(direction)) * side;
        }
        return point;
      }
      case Kind::kCylinder: {
        // By its part along each axis: what is left of a direction without its part along the third one is,
        // where that is nearly all, not across it.
        const Scalar x = rotation_.col(0).dot(direction);
        const Scalar y = rotation_.col(1).dot(direction);
        const Scalar length = std::sqrt(x * x + y * y);
        const Scalar scale = length > 0 ? (core_.half.x() - margin) / length : Scalar(0);
        const Scalar height = std::copysign(core_.half.z() - margin, axis().dot(direction));
        return centre_ + (x * scale * rotation_.col(0) + y * scale * rotation_.col(1) + height * axis());
      }
      case Kind::kEllipsoid: {
        const Vector local = rotation_.transpose() * direction;
        const Vector stretched = local.cwiseProduct(core_.half);
        const Vector on_shape = stretched.cwiseProduct(core_.half) / stretched.norm();
        return centre_ + rotation_ * Vector(on_shape - local * (margin / local.norm()));
      }
      case Kind::kPoints:
        break;
    }
    return centre_ + rotation_ * farthest(points, Vector(rotation_.transpose() * direction));
  }

  static const Vector& farthest(std::span<const Vector> points, const Vector& direction) {
    const Vector* best = points.data();
    Scalar most = best->dot(direction);
    for (const Vector& point : points.subspan(1)) {
      const Scalar height = point.dot(direction);
      if (height <= most) continue;
      most = height;
      best = &point;
    }
    return *best;
  }

  Vector axis() const { return rotation_.col(2); }

  const Core<Scalar>& core_;
  const Matrix& rotation_;
  Vector centre_;
};

}  // namespace tessera::collision
