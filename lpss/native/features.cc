#include "lpss/native/features.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera::native {
namespace {

using collision::Face;

// The cap of a cylinder is a polygon of so many corners.
constexpr int kCapCorners = 8;
// A direction closer to the axis than to the side looks at a cap.
constexpr Scalar kCapFrom = Scalar(0.7071);

Face<Scalar> cap_of(Scalar radius, Scalar z) {
  constexpr Scalar kDiagonal = Scalar(std::numbers::sqrt2 / 2);
  constexpr Scalar kCosine[kCapCorners] = {1, kDiagonal, 0, -kDiagonal, -1, -kDiagonal, 0, kDiagonal};
  constexpr Scalar kSine[kCapCorners] = {0, kDiagonal, 1, kDiagonal, 0, -kDiagonal, -1, -kDiagonal};
  Face<Scalar> cap;
  cap.normal = Vector(0, 0, z > 0 ? 1 : -1);
  cap.id = z > 0 ? 1 : 0;
  cap.count = kCapCorners;
  for (int n = 0; n < kCapCorners; ++n) {
    const int corner = z > 0 ? n : kCapCorners - 1 - n;
    cap.vertex[n] = Vector(radius * kCosine[corner], radius * kSine[corner], z);
    cap.vertex_id[n] = static_cast<std::uint16_t>(corner);
  }
  return cap;
}

}  // namespace

Feature feature_of(const Part& part, const Vector& direction) {
  Feature feature;
  Scalar radius = 0;
  Scalar half_length = 0;
  if (part.kind == Part::Kind::kBox) {
    feature.face = collision::supporting_face(part.cuboid, direction);
  } else if (part.polyhedron) {
    feature.face = collision::supporting_face(*part.polyhedron, direction);
  } else if (part.kind == Part::Kind::kCapsule) {
    radius = part.capsule.radius;
    half_length = part.capsule.half_length;
  } else if (is_cylinder(part)) {
    radius = part.core.half.x();
    half_length = part.core.half.z();
    if (std::abs(direction.z()) > kCapFrom * direction.norm()) {
      feature.face = cap_of(radius, std::copysign(half_length, direction.z()));
      return feature;
    }
  }
  if (half_length > 0 && std::abs(direction.z()) <= kCapFrom * direction.norm()) {
    const Vector out = Vector(direction.x(), direction.y(), 0).normalized() * radius;
    feature.line = Line{out - Vector(0, 0, half_length), out + Vector(0, 0, half_length)};
  }
  return feature;
}

Feature placed(Feature feature, const Matrix& rotation, const Vector& offset) {
  if (feature.face) feature.face = collision::placed(*feature.face, rotation, offset);
  if (feature.line)
    feature.line = Line{rotation * feature.line->from + offset, rotation * feature.line->to + offset};
  return feature;
}

std::optional<Line> clipped(const Line& line, const Face<Scalar>& face) {
  Scalar from = 0;
  Scalar to = 1;
  const Vector way = line.to - line.from;
  for (int n = 0; n < face.count; ++n) {
    const Vector& tail = face.vertex[n];
    const Vector out = (face.vertex[(n + 1) % face.count] - tail).cross(face.normal);
    const Scalar at_from = out.dot(line.from - tail);
    const Scalar growth = out.dot(way);
    if (growth == 0) {
      if (at_from > 0) return std::nullopt;
    } else if (growth > 0) {
      to = std::min(to, -at_from / growth);
    } else {
      from = std::max(from, -at_from / growth);
    }
  }
  if (!(from < to)) return std::nullopt;
  return Line{line.from + way * from, line.from + way * to};
}

std::optional<Line> clipped(const Line& line, const Vector& centre, const Vector& normal, Scalar radius) {
  const auto flat = [&](const Vector& v) { return Vector(v - normal * normal.dot(v)); };
  const Vector from = flat(line.from - centre);
  const Vector way = flat(line.to - line.from);
  const Scalar square = way.squaredNorm();
  const Scalar along = -from.dot(way);
  const Scalar root = along * along - square * (from.squaredNorm() - radius * radius);
  if (!(root > 0 && square > 0)) return std::nullopt;
  const Scalar half = std::sqrt(root);
  const Scalar first = std::max(Scalar(0), (along - half) / square);
  const Scalar last = std::min(Scalar(1), (along + half) / square);
  if (!(first < last)) return std::nullopt;
  return Line{line.from + (line.to - line.from) * first, line.from + (line.to - line.from) * last};
}

}  // namespace tessera::native
