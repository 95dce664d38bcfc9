#include "lpss/collision/manifold.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <utility>

#include "lpss/collision/clip.h"
#include "lpss/collision/hull.h"

namespace tessera::collision {
namespace {

constexpr int kClipMax = 2 * kFaceVerticesMax;

// Scores that differ by less than this share of the greatest are equal: the smaller feature decides.
constexpr double kTie = 1e-3;
// Likewise of gaps, by the extent of all points.
constexpr double kGapTie = 1e-4;
// Points that are closer to the line of two others than this share of their distance lie on it: rounding put
// them beside it.
constexpr double kOnLine = 1e-4;

// The point with the greatest positive score, or -1.
template <typename Scalar, typename Score>
int pick(std::span<const ContactPoint<Scalar>> points, const Score& score) {
  Scalar values[kClipMax];
  Scalar greatest = 0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    values[n] = score(points[n]);
    greatest = std::max(greatest, values[n]);
  }
  if (!(greatest > 0)) return -1;
  int best = -1;
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (values[n] < greatest * Scalar(1 - kTie)) continue;
    if (best < 0 || points[n].feature < points[best].feature) best = static_cast<int>(n);
  }
  return best;
}

template <typename Scalar>
int pick_deepest(std::span<const ContactPoint<Scalar>> points) {
  std::size_t deepest = 0;
  for (std::size_t n = 1; n < points.size(); ++n) {
    if (std::pair(points[n].gap, points[n].feature) < std::pair(points[deepest].gap, points[deepest].feature))
      deepest = n;
  }
  Scalar extent = 0;
  for (const ContactPoint<Scalar>& p : points)
    extent = std::max(extent, (p.on_b - points[deepest].on_b).squaredNorm());
  const Scalar limit = points[deepest].gap + Scalar(kGapTie) * std::sqrt(extent);
  int best = static_cast<int>(deepest);
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (points[n].gap <= limit && points[n].feature < points[best].feature) best = static_cast<int>(n);
  }
  return best;
}

// Of points on a line, of which the first two taken are the deepest and the farthest from it, the ends are
// enough, unless they are clearly higher: more springs would bear no tilt, but make the contact stiffer.
template <typename Scalar>
void keep_ends(std::span<const ContactPoint<Scalar>> points, Manifold<Scalar>& manifold) {
  const ContactPoint<Scalar> deepest = manifold.point[0];
  const ContactPoint<Scalar>& end = manifold.point[1];
  const int other =
      pick(points, [&](const ContactPoint<Scalar>& p) { return (p.on_b - end.on_b).squaredNorm(); });
  if (other < 0 || points[other].feature == deepest.feature) return;
  manifold.point[0] = points[other];
  const Scalar length = (points[other].on_b - end.on_b).norm();
  if (deepest.gap < std::min(points[other].gap, end.gap) - Scalar(kGapTie) * length)
    manifold.point[manifold.count++] = deepest;
}

// At most kClipMax points.
template <typename Scalar>
void reduce_many(std::span<const ContactPoint<Scalar>> points, Manifold<Scalar>& manifold) {
  using Point = ContactPoint<Scalar>;
  const auto take = [&](int n) { manifold.point[manifold.count++] = points[n]; };
  take(pick_deepest(points));
  const Vector3<Scalar> p0 = manifold.point[0].on_b;
  const int second = pick(points, [&](const Point& p) { return (p.on_b - p0).squaredNorm(); });
  if (second < 0) return;
  take(second);
  const Vector3<Scalar> along = manifold.normal.cross(manifold.point[1].on_b - p0);
  const int third = pick(points, [&](const Point& p) { return std::abs(along.dot(p.on_b - p0)); });
  if (third < 0) return keep_ends(points, manifold);
  if (!(std::abs(along.dot(points[third].on_b - p0)) > Scalar(kOnLine) * along.squaredNorm()))
    return keep_ends(points, manifold);
  take(third);

  // What a point adds to the triangle of the others is beyond one of the sides.
  const bool is_left = along.dot(points[third].on_b - p0) > 0;
  Vector3<Scalar> corner[3] = {p0, manifold.point[1].on_b, manifold.point[2].on_b};
  if (!is_left) std::swap(corner[1], corner[2]);
  Vector3<Scalar> out[3];
  for (int k = 0; k < 3; ++k) out[k] = (corner[(k + 1) % 3] - corner[k]).cross(manifold.normal);
  const int fourth = pick(points, [&](const Point& p) {
    return std::max(
        {out[0].dot(p.on_b - corner[0]), out[1].dot(p.on_b - corner[1]), out[2].dot(p.on_b - corner[2])});
  });
  const auto is_taken = [&](int n) {
    return std::any_of(manifold.point, manifold.point + manifold.count,
                       [&](const Point& p) { return p.feature == points[n].feature; });
  };
  if (fourth >= 0 && !is_taken(fourth)) take(fourth);
}

// Three or four points.
template <typename Scalar>
bool are_on_line(std::span<const ContactPoint<Scalar>> points) {
  const Vector3<Scalar>& first = points[0].on_b;
  const Vector3<Scalar> second = points[1].on_b - first;
  const Vector3<Scalar> third = points[2].on_b - first;
  const Vector3<Scalar> last = points.back().on_b - first;
  const Scalar most = std::max({second.squaredNorm(), third.squaredNorm(), last.squaredNorm()});
  const Scalar limit = Scalar(kOnLine * kOnLine) * most * most;
  // Most faces are far from lines.
  if (second.cross(third).squaredNorm() > limit) return false;
  const Vector3<Scalar>& way = second.squaredNorm() == most  ? second
                               : third.squaredNorm() == most ? third
                                                             : last;
  return way.cross(second).squaredNorm() <= limit && way.cross(third).squaredNorm() <= limit &&
         way.cross(last).squaredNorm() <= limit;
}

template <typename Scalar>
Scalar shortest_side(const Face<Scalar>& face) {
  Scalar least = std::numeric_limits<Scalar>::max();
  for (int n = 0; n < face.count; ++n)
    least = std::min(least, (face.vertex[n + 1 < face.count ? n + 1 : 0] - face.vertex[n]).squaredNorm());
  return std::sqrt(least);
}

}  // namespace

template <typename Scalar>
Manifold<Scalar> swapped(const Manifold<Scalar>& manifold, const Vector3<Scalar>& offset) {
  Manifold<Scalar> result;
  if (manifold.count == 0) return result;
  result.normal = -manifold.normal;
  result.count = manifold.count;
  for (int n = 0; n < manifold.count; ++n) {
    const ContactPoint<Scalar>& p = manifold.point[n];
    result.point[n] = {p.on_b - offset, p.on_a - offset, p.gap, p.feature};
  }
  return result;
}

template <typename Scalar>
Face<Scalar> supporting_face(const Box<Scalar>& box, const Vector3<Scalar>& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  Face<Scalar> face;
  face.id = 2 * axis + (direction[axis] > 0);
  face.normal = Vector3<Scalar>::Zero();
  face.normal[axis] = direction[axis] > 0 ? Scalar(1) : Scalar(-1);
  face.count = 4;
  for (int n = 0; n < 4; ++n) {
    face.vertex_id[n] = kBoxCorners[4 * face.id + n];
    face.vertex[n] = box_vertex(box.half, face.vertex_id[n]);
  }
  return face;
}

template <typename Scalar>
Face<Scalar> supporting_face(const Polyhedron<Scalar>& polyhedron, const Vector3<Scalar>& direction) {
  const Hull<Scalar> hull = view(polyhedron);
  return face_of(hull, supporting_face_index(hull, direction));
}

template <typename Scalar>
Face<Scalar> supporting_face(const MeshTriangle<Scalar>& triangle, const Vector3<Scalar>& direction) {
  const bool is_front = triangle.normal.dot(direction) >= 0;
  Face<Scalar> face;
  face.id = is_front ? 0 : 1;
  face.normal = is_front ? triangle.normal : Vector3<Scalar>(-triangle.normal);
  face.count = 3;
  for (int n = 0; n < 3; ++n) {
    face.vertex_id[n] = static_cast<std::uint16_t>(is_front ? n : 2 - n);
    face.vertex[n] = triangle.vertex[face.vertex_id[n]];
  }
  return face;
}

template <typename Scalar>
Face<Scalar> placed(const Face<Scalar>& face, const Matrix3<Scalar>& rotation,
                    const Vector3<Scalar>& offset) {
  Face<Scalar> result;
  result.normal = rotation * face.normal;
  result.id = face.id;
  result.count = face.count;
  for (int n = 0; n < face.count; ++n) {
    result.vertex[n] = rotation * face.vertex[n] + offset;
    result.vertex_id[n] = face.vertex_id[n];
  }
  return result;
}

template <typename Scalar>
void reduce(std::span<const ContactPoint<Scalar>> points, Manifold<Scalar>& manifold) {
  using Point = ContactPoint<Scalar>;
  manifold.count = 0;
  Point chosen[kClipMax];
  int count = 0;
  if (points.size() > 4) {
    const auto overlaps = [](const Point& p) { return p.gap <= 0; };
    const bool only_overlaps = std::count_if(points.begin(), points.end(), overlaps) >= 4;
    for (const Point& p : points) {
      if ((!only_overlaps || overlaps(p)) && count < kClipMax) chosen[count++] = p;
    }
  } else {
    for (const Point& p : points) chosen[count++] = p;
  }
  const std::span<const Point> all(chosen, count);
  if (count > 4 || (count > 2 && are_on_line(all))) reduce_many(all, manifold);
  if (manifold.count == 0) {
    for (int n = 0; n < count; ++n) manifold.point[manifold.count++] = chosen[n];
  }
  for (int n = 1; n < manifold.count; ++n) {
    for (int m = n; m > 0 && manifold.point[m].feature < manifold.point[m - 1].feature; --m)
      std::swap(manifold.point[m], manifold.point[m - 1]);
  }
}

template <typename Scalar>
Manifold<Scalar> clip_faces(const Face<Scalar>& a, const Face<Scalar>& b, const Vector3<Scalar>& normal,
                            std::type_identity_t<Scalar> margin) {
  using Vector = Vector3<Scalar>;
  Manifold<Scalar> manifold;
  manifold.normal = normal;
  const Scalar alignment_a = -a.normal.dot(normal);
  const Scalar alignment_b = b.normal.dot(normal);
  const bool is_b_reference = alignment_b > alignment_a * Scalar(1 + 1e-6);
  const Face<Scalar>& reference = is_b_reference ? b : a;
  const Face<Scalar>& incident = is_b_reference ? a : b;
  const Scalar alignment = is_b_reference ? alignment_b : -alignment_a;  // of the reference to `normal`
  if (!(std::abs(alignment) > 0)) return manifold;
  const ClipNames names{reference.vertex_id, reference.count, reference.id,
                        incident.vertex_id,  incident.id,     is_b_reference};

  ClipPolygon<Scalar, kClipMax> buffer[2];
  int current = 0;
  for (int n = 0; n < incident.count; ++n) buffer[0].add({incident.vertex[n], names.incident_vertex(n), n});
  const Scalar slack = Scalar(kClipSlack) * shortest_side(reference);
  const Vector outward = alignment < 0 ? Vector(-normal) : normal;
  for (int side = 0; side < reference.count; ++side) {
    const Vector& tail = reference.vertex[side];
    const Vector& head = reference.vertex[side + 1 < reference.count ? side + 1 : 0];
    const Vector out = (head - tail).cross(outward);
    const auto scaled = [&](const Vector& p) { return out.dot(p - tail); };
    if (clip_side(buffer[current], side, names, slack * out.norm(), scaled, buffer[1 - current]))
      current = 1 - current;
    if (buffer[current].count == 0) return manifold;
  }

  ContactPoint<Scalar> points[kClipMax];
  int count = 0;
  const Vector& origin = reference.vertex[0];
  for (int n = 0; n < buffer[current].count; ++n) {
    const ClipVertex<Scalar>& v = buffer[current].vertex[n];
    // From the plane of the reference to the point, along the normal.
    const Scalar height = reference.normal.dot(v.p - origin) / alignment;
    const Scalar gap = is_b_reference ? height : -height;
    if (gap > margin) continue;
    const Vector on_plane = v.p - height * normal;
    points[count++] = is_b_reference ? ContactPoint<Scalar>{v.p, on_plane, gap, v.feature}
                                     : ContactPoint<Scalar>{on_plane, v.p, gap, v.feature};
  }
  reduce(std::span<const ContactPoint<Scalar>>(points, count), manifold);
  return manifold;
}

template Manifold<float> swapped(const Manifold<float>&, const Vector3<float>&);
template Manifold<double> swapped(const Manifold<double>&, const Vector3<double>&);
template Face<float> supporting_face(const Box<float>&, const Vector3<float>&);
template Face<double> supporting_face(const Box<double>&, const Vector3<double>&);
template Face<float> supporting_face(const Polyhedron<float>&, const Vector3<float>&);
template Face<double> supporting_face(const Polyhedron<double>&, const Vector3<double>&);
template Face<float> supporting_face(const MeshTriangle<float>&, const Vector3<float>&);
template Face<double> supporting_face(const MeshTriangle<double>&, const Vector3<double>&);
template Face<float> placed(const Face<float>&, const Matrix3<float>&, const Vector3<float>&);
template Face<double> placed(const Face<double>&, const Matrix3<double>&, const Vector3<double>&);
template void reduce(std::span<const ContactPoint<float>>, Manifold<float>&);
template void reduce(std::span<const ContactPoint<double>>, Manifold<double>&);
template Manifold<float> clip_faces(const Face<float>&, const Face<float>&, const Vector3<float>&, float);
template Manifold<double> clip_faces(const Face<double>&, const Face<double>&, const Vector3<double>&,
                                     double);

}  // namespace tessera::collision
