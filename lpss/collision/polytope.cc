#include "lpss/collision/polytope.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::collision {
namespace {

// Of the extent of what there is: less is nothing.
template <typename Scalar>
constexpr Scalar kFlat = Scalar(64) * std::numeric_limits<Scalar>::epsilon();
// Of the depth, by which a face may be closer than the surface.
constexpr double kCloseEnough = 1e-4;

template <typename Scalar>
Vector3<Scalar> any_across(const Vector3<Scalar>& along) {
  int least = 0;
  along.cwiseAbs().minCoeff(&least);
  return along.cross(Vector3<Scalar>::Unit(least));
}

}  // namespace

// Adds points that are off the hull of those that there are, until they are four. False if the difference is
// flat.
template <typename Scalar>
bool Polytope<Scalar>::widen_to_tetrahedron() {
  const auto is_off = [&](const Vector& p) {
    const Vector& origin = points_[0].at;
    const Vector way = p - origin;
    const Scalar extent = std::max(p.cwiseAbs().maxCoeff(), origin.cwiseAbs().maxCoeff());
    const Scalar least = kFlat<Scalar> * extent;
    if (point_count_ == 1) return way.norm() > least;
    const Vector first = points_[1].at - origin;
    if (point_count_ == 2) return first.cross(way).norm() > least * first.norm();
    const Vector normal = first.cross(points_[2].at - origin);
    return std::abs(normal.dot(way)) > least * normal.norm();
  };
  while (point_count_ < 4) {
    Vector axes[3] = {Vector::UnitX(), Vector::UnitY(), Vector::UnitZ()};
    int count = 3;
    if (point_count_ == 2) {
      const Vector along = points_[1].at - points_[0].at;
      axes[0] = any_across(along);
      axes[1] = along.cross(axes[0]);
      count = 2;
    } else if (point_count_ == 3) {
      axes[0] = (points_[1].at - points_[0].at).cross(points_[2].at - points_[0].at);
      count = 1;
    }
    bool is_found = false;
    for (int n = 0; n < 2 * count && !is_found; ++n) {
      const DifferencePoint<Scalar> point = difference_.support(n % 2 ? Vector(-axes[n / 2]) : axes[n / 2]);
      is_found = is_off(point.at);
      if (is_found) points_[point_count_++] = point;
    }
    if (!is_found) return false;
  }
  return true;
}

template <typename Scalar>
bool Polytope<Scalar>::add_face(int i, int j, int k) {
  if (face_count_ == kFacesMax) return false;
  const Vector& p = points_[i].at;
  Vector normal = (points_[j].at - p).cross(points_[k].at - p);
  const Scalar length = normal.norm();
  // A face without an area closes the polytope; no point sees it, and it is not close.
  Scalar distance = std::numeric_limits<Scalar>::max();
  if (length > 0) {
    normal /= length;
    distance = normal.dot(p);
  }
  faces_[face_count_++] = {
      {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j), static_cast<std::uint8_t>(k)},
      normal,
      distance};
  return true;
}

// Takes away the faces that the point sees, and connects it with their rim. False if that closes no polytope.
template <typename Scalar>
bool Polytope<Scalar>::grow(int point) {
  struct Edge {
    std::uint8_t tail;
    std::uint8_t head;
  };
  // A face in whose plane the point is stays: what rounding says of many such would tear the polytope.
  const Scalar noise = kFlat<Scalar> / 4 * points_[point].at.cwiseAbs().maxCoeff();
  Edge rim[kFacesMax];
  int rim_count = 0;
  int kept = 0;
  for (int f = 0; f < face_count_; ++f) {
    const Face& face = faces_[f];
    if (!(face.normal.dot(points_[point].at) > face.distance + noise)) {
      if (kept != f) faces_[kept] = face;
      ++kept;
      continue;
    }
    for (int n = 0; n < 3; ++n) {
      const Edge edge{face.corner[n], face.corner[n == 2 ? 0 : n + 1]};
      int twin = 0;
      while (twin < rim_count && !(rim[twin].tail == edge.head && rim[twin].head == edge.tail)) ++twin;
      if (twin < rim_count) {
        rim[twin] = rim[--rim_count];
      } else if (rim_count < kFacesMax) {
        rim[rim_count++] = edge;
      } else {
        return false;
      }
    }
  }
  face_count_ = kept;
  for (int n = 0; n < rim_count; ++n) {
    if (!add_face(rim[n].tail, rim[n].head, point)) return false;
  }
  return rim_count >= 3;
}

template <typename Scalar>
int Polytope<Scalar>::closest_face() const {
  int best = 0;
  for (int f = 1; f < face_count_; ++f) {
    if (faces_[f].distance < faces_[best].distance) best = f;
  }
  return best;
}

template <typename Scalar>
Penetration<Scalar> Polytope<Scalar>::on_face(const Face& face, Scalar depth) const {
  const DifferencePoint<Scalar>& p = points_[face.corner[0]];
  const DifferencePoint<Scalar>& q = points_[face.corner[1]];
  const DifferencePoint<Scalar>& r = points_[face.corner[2]];
  const Vector foot = face.normal * face.distance;
  const auto area = [&](const Vector& a, const Vector& b) {
    return std::max(Scalar(0), face.normal.dot((a - foot).cross(b - foot)));
  };
  const Scalar of_p = area(q.at, r.at);
  const Scalar of_q = area(r.at, p.at);
  const Scalar of_r = area(p.at, q.at);
  const Scalar sum = of_p + of_q + of_r;
  const Vector on_a = sum > 0 ? Vector((of_p * p.on_a + of_q * q.on_a + of_r * r.on_a) / sum) : p.on_a;
  const Vector on_b = sum > 0 ? Vector((of_p * p.on_b + of_q * q.on_b + of_r * r.on_b) / sum) : p.on_b;
  return {face.normal, std::max(Scalar(0), depth), on_a, on_b};
}

// Of a difference without a volume: across it, the shapes overlap by nothing.
template <typename Scalar>
Penetration<Scalar> Polytope<Scalar>::flat() const {
  Vector out = Vector::UnitZ();
  if (point_count_ == 2) out = any_across(Vector(points_[1].at - points_[0].at)).normalized();
  if (point_count_ == 3) {
    out = (points_[1].at - points_[0].at).cross(points_[2].at - points_[0].at).normalized();
  }
  return {out, 0, points_[0].on_a, points_[0].on_b};
}

template <typename Scalar>
Penetration<Scalar> Polytope<Scalar>::find(const Simplex<Scalar>& start) {
  point_count_ = start.count;
  std::copy_n(start.point, start.count, points_);
  if (!widen_to_tetrahedron()) return flat();
  const Vector& p = points_[0].at;
  const bool is_inside_out = (points_[1].at - p).cross(points_[2].at - p).dot(points_[3].at - p) > 0;
  const int second = is_inside_out ? 2 : 1;
  const int third = is_inside_out ? 1 : 2;
  if (!add_face(0, second, third) || !add_face(0, third, 3) || !add_face(third, second, 3) ||
      !add_face(second, 0, 3))
    return flat();
  // What is beyond a face bounds the depth from above.
  Penetration<Scalar> best;
  best.depth = std::numeric_limits<Scalar>::max();
  for (;;) {
    const Face& face = faces_[closest_face()];
    const DifferencePoint<Scalar> point = difference_.support(face.normal);
    const Scalar depth = face.normal.dot(point.at);
    const bool is_close = depth - face.distance <=
                          Scalar(kCloseEnough) * depth + kFlat<Scalar> * point.at.cwiseAbs().maxCoeff();
    if (depth < best.depth || is_close) best = on_face(face, depth);
    if (is_close || point_count_ == kPointsMax) return best;
    points_[point_count_] = point;
    if (!grow(point_count_++)) return best;
  }
}

template class Polytope<float>;
template class Polytope<double>;

}  // namespace tessera::collision
