// Polyhedra against polyhedra, by separating axes (Gregorius, 2013).

#include <array>

#include "lpss/collision/collide.h"
#include "lpss/collision/hull.h"

namespace tessera::collision {
namespace {

// A vector between points that is longer than so many roundings of them has a direction.
constexpr int kNoise = 1000;

// A direction along which two shapes are apart, or overlap least.
template <typename Scalar>
struct FaceAxis {
  int face = -1;
  Scalar separation = std::numeric_limits<Scalar>::lowest();
};

template <typename Scalar>
struct EdgeAxis {
  int a = -1;
  int b = -1;
  Vector3<Scalar> out;  // unit length, from a
  Scalar separation = std::numeric_limits<Scalar>::lowest();
};

// Whether the line between the centres shows it already, as it does of most that are apart.
template <typename Scalar>
bool are_apart(const Hull<Scalar>& a, const Hull<Scalar>& b, const Matrix3<Scalar>& rotation,
               const Vector3<Scalar>& offset, Scalar margin) {
  const Scalar distance = offset.norm();
  if (!(distance > 0)) return false;
  const Vector3<Scalar> out = offset / distance;
  const Scalar of_a = -lowest(a.vertices, Vector3<Scalar>(-out));
  return distance + lowest(b.vertices, Vector3<Scalar>(rotation.transpose() * out)) - of_a > margin;
}

// The best of the faces of `hull`; b's axes to its own: x -> rotation x + offset. Stops beyond `enough`.
template <typename Scalar>
FaceAxis<Scalar> best_face(const Hull<Scalar>& hull, const Hull<Scalar>& other,
                           const Matrix3<Scalar>& rotation, const Vector3<Scalar>& offset, Scalar enough) {
  FaceAxis<Scalar> best;
  for (int f = 0; f < static_cast<int>(hull.planes.size()); ++f) {
    const HalfSpace<Scalar>& plane = hull.planes[f];
    const Vector3<Scalar> direction = rotation.transpose() * plane.normal;
    const Scalar separation = lowest(other.vertices, direction) + plane.normal.dot(offset) - plane.offset;
    if (separation <= best.separation) continue;
    best = {f, separation};
    if (separation > enough) break;
  }
  return best;
}

// The best pair of edges. A pair matters only if its arcs on the Gauss map cross.
template <typename Scalar>
EdgeAxis<Scalar> best_edges(const Hull<Scalar>& a, const Hull<Scalar>& b, const Matrix3<Scalar>& rotation,
                            const Vector3<Scalar>& offset, Scalar enough) {
  using Vector = Vector3<Scalar>;
  EdgeAxis<Scalar> best;
  Slopes<Scalar> slopes;
  for (int n = 0; n < static_cast<int>(b.edges.size()); ++n) {
    const HullEdge& edge_b = b.edges[n];
    const Vector along_b = rotation * (b.vertices[edge_b.head] - b.vertices[edge_b.tail]);
    const Vector left_b = rotation * b.planes[edge_b.left].normal;
    const Vector right_b = rotation * b.planes[edge_b.right].normal;
    const Scalar square_b = along_b.squaredNorm();
    slopes.find(a, along_b);
    for (int m = 0; m < static_cast<int>(a.edges.size()); ++m) {
      const HullEdge& edge_a = a.edges[m];
      const Scalar left = slopes.of[edge_a.left];
      const Scalar right = slopes.of[edge_a.right];
      if (left * right >= 0) continue;
      const Vector along_a = a.vertices[edge_a.head] - a.vertices[edge_a.tail];
      const Scalar other_left = left_b.dot(along_a);
      if (other_left * right >= 0 || other_left * right_b.dot(along_a) >= 0) continue;
      Vector out = along_a.cross(along_b);
      const Scalar square = out.squaredNorm();
      if (square <= Scalar(kParallelSine * kParallelSine) * along_a.squaredNorm() * square_b) continue;
      out *= (left > 0 ? 1 : -1) / std::sqrt(square);
      const Vector tail_b = rotation * b.vertices[edge_b.tail] + offset;
      const Scalar separation = out.dot(tail_b - a.vertices[edge_a.tail]);
      if (separation <= best.separation) continue;
      best = {m, n, out, separation};
      if (separation > enough) return best;
    }
  }
  return best;
}

// The points of two crossing edges; returns whether they are between the ends of the edges.
template <typename Scalar>
bool touch_edges(const Hull<Scalar>& a, const Hull<Scalar>& b, const Matrix3<Scalar>& rotation,
                 const Vector3<Scalar>& offset, const EdgeAxis<Scalar>& axis, Manifold<Scalar>& manifold) {
  const HullEdge& edge_a = a.edges[axis.a];
  const HullEdge& edge_b = b.edges[axis.b];
  const Vector3<Scalar>& tail_a = a.vertices[edge_a.tail];
  const Vector3<Scalar>& tail_b = b.vertices[edge_b.tail];
  const ClosestSegments<Scalar> closest(tail_a, a.vertices[edge_a.head] - tail_a, rotation * tail_b + offset,
                                        rotation * (b.vertices[edge_b.head] - tail_b));
  manifold.normal = -axis.out;
  manifold.count = 1;
  manifold.point[0] = {closest.on_a, closest.on_b, (closest.on_b - closest.on_a).dot(axis.out),
                       make_feature(Touch::kEdges, axis.a, axis.b)};
  return closest.is_inside();
}

template <typename Scalar>
struct Bounds {
  explicit Bounds(std::span<const Vector3<Scalar>> points) : low(points[0]), high(points[0]) {
    for (const Vector3<Scalar>& p : points) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  bool is_near(const Vector3<Scalar>& p, const Vector3<Scalar>& q, Scalar margin) const {
    return (p.cwiseMin(q).array() <= high.array() + margin).all() &&
           (p.cwiseMax(q).array() >= low.array() - margin).all();
  }

  Vector3<Scalar> low;
  Vector3<Scalar> high;
};

}  // namespace

template <typename Scalar>
void closest_edges(const EdgeSet<Scalar>& a, const EdgeSet<Scalar>& b, const Vector3<Scalar>& normal,
                   Scalar margin, Manifold<Scalar>& manifold) {
  using Vector = Vector3<Scalar>;
  manifold.count = 0;
  const Bounds<Scalar> bounds_a(a.vertices);
  const Bounds<Scalar> bounds_b(b.vertices);
  int near_a[kHullEdgesMax];
  int count_a = 0;
  for (int m = 0; m < static_cast<int>(a.edges.size()); ++m) {
    if (bounds_b.is_near(a.vertices[a.edges[m].tail], a.vertices[a.edges[m].head], margin))
      near_a[count_a++] = m;
  }
  Scalar least = margin * margin;
  ContactPoint<Scalar>& point = manifold.point[0];
  for (int n = 0; n < static_cast<int>(b.edges.size()); ++n) {
    const Vector ends_b[2] = {b.vertices[b.edges[n].tail], b.vertices[b.edges[n].head]};
    if (!bounds_a.is_near(ends_b[0], ends_b[1], margin)) continue;
    const Bounds<Scalar> bounds(ends_b);
    for (int k = 0; k < count_a; ++k) {
      const HullEdge& edge_a = a.edges[near_a[k]];
      const Vector& tail_a = a.vertices[edge_a.tail];
      const Vector& head_a = a.vertices[edge_a.head];
      if (!bounds.is_near(tail_a, head_a, margin)) continue;
      const ClosestSegments<Scalar> closest(tail_a, head_a - tail_a, ends_b[0], ends_b[1] - ends_b[0]);
      const Scalar square = (closest.on_a - closest.on_b).squaredNorm();
      if (square > least || (square == least && manifold.count > 0)) continue;
      least = square;
      manifold.count = 1;
      point = {closest.on_a, closest.on_b, 0, make_feature(Touch::kEdges, near_a[k], n)};
    }
  }
  if (manifold.count == 0) return;
  const Scalar extent =
      std::max((bounds_a.high - bounds_a.low).maxCoeff(), (bounds_b.high - bounds_b.low).maxCoeff());
  const Scalar noise = kNoise * std::numeric_limits<Scalar>::epsilon() * extent;
  const Vector away = point.on_a - point.on_b;
  manifold.normal = least > noise * noise ? Vector(away / std::sqrt(least)) : normal;
  point.gap = away.dot(manifold.normal);
}

template <typename Scalar>
Manifold<Scalar> collide_hulls(const Hull<Scalar>& a, const Hull<Scalar>& b, const Matrix3<Scalar>& rotation,
                               const Vector3<Scalar>& offset, Scalar margin) {
  using Vector = Vector3<Scalar>;
  Manifold<Scalar> manifold;
  if (are_apart(a, b, rotation, offset, margin)) return manifold;
  const FaceAxis<Scalar> face_a = best_face(a, b, rotation, offset, margin);
  if (face_a.separation > margin) return manifold;
  const Matrix3<Scalar> back = rotation.transpose();
  const FaceAxis<Scalar> face_b = best_face(b, a, back, Vector(-(back * offset)), margin);
  if (face_b.separation > margin) return manifold;
  const EdgeAxis<Scalar> edges = best_edges(a, b, rotation, offset, margin);
  if (edges.separation > margin) return manifold;

  const Scalar thickness = std::min(a.thickness, b.thickness);
  const bool is_face_b = face_b.separation > face_a.separation + Scalar(kFaceBias) * thickness;
  const Scalar best = is_face_b ? face_b.separation : face_a.separation;
  if (edges.separation > best + Scalar(kEdgeBias) * thickness) {
    const bool is_inside = touch_edges(a, b, rotation, offset, edges, manifold);
    if (is_inside || edges.separation <= 0) return manifold;
  } else {
    for (const bool by_b : {is_face_b, !is_face_b}) {
      const Vector normal =
          by_b ? Vector(rotation * b.planes[face_b.face].normal) : Vector(-a.planes[face_a.face].normal);
      const int index_a = by_b ? supporting_face_index(a, Vector(-normal)) : face_a.face;
      const int index_b = by_b ? face_b.face : supporting_face_index(b, Vector(back * normal));
      manifold =
          clip_faces(face_of(a, index_a), placed(face_of(b, index_b), rotation, offset), normal, margin);
      if (manifold.count > 0) return manifold;
    }
  }
  // The faces are not opposite each other: an edge or a vertex of each is what is closest.
  if (std::max({face_a.separation, face_b.separation, edges.separation}) > 0) {
    std::array<Vector, kHullVerticesMax> vertices;
    for (std::size_t n = 0; n < b.vertices.size(); ++n) vertices[n] = rotation * b.vertices[n] + offset;
    const EdgeSet<Scalar> placed_b{std::span<const Vector>(vertices.data(), b.vertices.size()), b.edges};
    closest_edges<Scalar>({a.vertices, a.edges}, placed_b, Vector(manifold.normal), margin, manifold);
  } else if (edges.a >= 0) {
    touch_edges(a, b, rotation, offset, edges, manifold);
  }
  return manifold;
}

template <typename Scalar>
Manifold<Scalar> collide(const Box<Scalar>& a, const Polyhedron<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin) {
  const BoxHull<Scalar> box(a.half);
  const Matrix3<Scalar> to_a = placement.a.transpose();
  Manifold<Scalar> manifold =
      collide_hulls<Scalar>(box.view(), view(b), to_a * placement.b, to_a * placement.offset, margin);
  turn(placement.a, manifold);
  return manifold;
}

template <typename Scalar>
Manifold<Scalar> collide(const Polyhedron<Scalar>& a, const Polyhedron<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin) {
  const Matrix3<Scalar> to_a = placement.a.transpose();
  Manifold<Scalar> manifold =
      collide_hulls<Scalar>(view(a), view(b), to_a * placement.b, to_a * placement.offset, margin);
  turn(placement.a, manifold);
  return manifold;
}

template void closest_edges(const EdgeSet<float>&, const EdgeSet<float>&, const Vector3<float>&, float,
                            Manifold<float>&);
template void closest_edges(const EdgeSet<double>&, const EdgeSet<double>&, const Vector3<double>&, double,
                            Manifold<double>&);
template Manifold<float> collide_hulls(const Hull<float>&, const Hull<float>&, const Matrix3<float>&,
                                       const Vector3<float>&, float);
template Manifold<double> collide_hulls(const Hull<double>&, const Hull<double>&, const Matrix3<double>&,
                                        const Vector3<double>&, double);
template Manifold<float> collide(const Box<float>&, const Polyhedron<float>&, const Placement<float>&, float);
template Manifold<double> collide(const Box<double>&, const Polyhedron<double>&, const Placement<double>&,
                                  double);
template Manifold<float> collide(const Polyhedron<float>&, const Polyhedron<float>&, const Placement<float>&,
                                 float);
template Manifold<double> collide(const Polyhedron<double>&, const Polyhedron<double>&,
                                  const Placement<double>&, double);

}  // namespace tessera::collision
