// Triangles of meshes.

#include "lpss/collision/capsules.h"
#include "lpss/collision/collide.h"
#include "lpss/collision/hull.h"

namespace tessera::collision {
namespace {

// A normal that leans over an edge by more than this sine belongs to the neighbour.
constexpr double kLean = 1e-3;
// Normals with a smaller sine of their angle are the same.
constexpr double kSameNormal = 0.01;

// A normal that leans to the back by more than this sine is of a contact from behind, of a shape that reaches
// around the triangle: through its neighbours, or past an open edge.
constexpr double kBehind = 0.5;

// A face whose normal is closer than some 15 degrees to that of a contact lies on what it touches.
constexpr double kLiesCosine = 0.966;

using EdgeMask = unsigned;  // bit k: edge k is touched; none: the face

constexpr int after(int k) { return k == 2 ? 0 : k + 1; }
constexpr int before(int k) { return k == 0 ? 2 : k - 1; }
constexpr HullEdge kTriangleEdges[3] = {{0, 1, 0, 1}, {1, 2, 0, 1}, {2, 0, 0, 1}};

// A triangle in axes with a's centre at the origin, with its front on the side of that centre.
template <typename Scalar>
struct Facet {
  using Vector = Vector3<Scalar>;

  Facet(const MeshTriangle<Scalar>& triangle, const Matrix3<Scalar>& rotation)
      : mesh(triangle), turn(rotation) {}

  // Places vertices and normal.
  void place(const Vector& offset) {
    for (int k = 0; k < 3; ++k) vertex[k] = turn * mesh.vertex[k] + offset;
    normal = turn * mesh.normal;
    id = 0;
    if (!is_kept_behind()) return;
    id = 1;
    std::swap(vertex[1], vertex[2]);
    normal = -normal;
  }

  // After place(), what is needed of edges.
  void place_edges() {
    for (int k = 0; k < 3; ++k) {
      const Vector along = (vertex[after(k)] - vertex[k]).normalized();
      out[k] = along.cross(normal);
      has_limit[k] = mesh.has_neighbour[id == 1 ? 2 - k : k];
      if (!has_limit[k]) continue;
      const Vector neighbour = neighbour_normal(k);
      const bool is_concave = neighbour.dot(out[k]) < Scalar(-1e-6);
      limit[k] = is_concave ? out[k] : Vector(along.cross(neighbour));
    }
  }

  bool is_kept_behind() {
    if (mesh.kept_on != KeptOn::kSideOfCentre) return mesh.kept_on == KeptOn::kBack;
    if (!(normal.dot(vertex[0]) > 0)) return false;
    // A centre behind the plane of the triangle may be beyond a ridge.
    place_edges();
    EdgeMask edges = 0;
    const Vector nearest = closest(Vector::Zero(), edges);
    return edges == 0 || is_behind_edges(nearest, edges);
  }

  // Whether a's centre is behind the surface at the point of an edge or corner that is nearest to it: the sum
  // of the normals there tells (Baerentzen and Aanaes, Signed Distance Computation Using the Angle Weighted
  // Pseudonormal, 2005).
  bool is_behind_edges(const Vector& nearest, EdgeMask edges) const {
    Vector sum = normal;
    for (int k = 0; k < 3; ++k) {
      if (edges >> k & 1 && has_limit[k]) sum += neighbour_normal(k);
    }
    return sum.dot(nearest) > 0;
  }

  Vector neighbour_normal(int k) const {
    return id == 1 ? Vector(turn * -mesh.neighbour_normal[2 - k]) : Vector(turn * mesh.neighbour_normal[k]);
  }

  bool leans_over(const Vector& direction, int k) const {
    return has_limit[k] && direction.dot(out[k]) > 0 && direction.dot(limit[k]) > Scalar(kLean);
  }
  bool leans(const Vector& direction, EdgeMask edges) const {
    for (int k = 0; k < 3; ++k) {
      if (edges >> k & 1 && leans_over(direction, k)) return true;
    }
    return false;
  }

  // The edges of the part of the triangle that is farthest along a direction.
  EdgeMask edges_towards(const Vector& direction) const {
    constexpr Scalar kLevel(0.02);  // slope along an edge that is touched as a whole
    Scalar height[3];
    for (int k = 0; k < 3; ++k) height[k] = direction.dot(vertex[k]);
    const int top = static_cast<int>(std::max_element(height, height + 3) - height);
    EdgeMask edges = 0;
    for (const int k : {top, before(top)}) {
      const Scalar length = (vertex[after(k)] - vertex[k]).norm();
      if (std::abs(height[after(k)] - height[k]) <= kLevel * length) edges |= 1u << k;
    }
    return edges ? edges : 1u << top | 1u << before(top);
  }

  // The allowed normal that is closest to one that leans over edges.
  Vector clamp(Vector direction, EdgeMask edges) const {
    for (int pass = 0; pass < 2; ++pass) {
      for (int k = 0; k < 3; ++k) {
        if (!(edges >> k & 1) || !leans_over(direction, k)) continue;
        // One that leans to the back would end up opposite to the normals on both sides of the edge.
        if (!(direction.dot(limit[k].cross(vertex[after(k)] - vertex[k])) > 0)) return normal;
        direction -= direction.dot(limit[k]) * limit[k];
        const Scalar length = direction.norm();
        if (!(length > Scalar(kLean))) return normal;
        direction /= length;
      }
    }
    return leans(direction, edges) ? normal : direction;
  }

  Scalar height(const Vector& p) const { return normal.dot(p - vertex[0]); }

  bool is_above(const Vector& p) const {
    for (int k = 0; k < 3; ++k) {
      if (out[k].dot(p - vertex[k]) > 0) return false;
    }
    return true;
  }

  Vector closest(const Vector& p, EdgeMask& edges) const {
    edges = 0;
    Vector best = p - height(p) * normal;
    Scalar least = std::numeric_limits<Scalar>::max();
    for (int k = 0; k < 3; ++k) {
      if (!(out[k].dot(p - vertex[k]) > 0)) continue;
      const Vector along = vertex[after(k)] - vertex[k];
      const Scalar t = std::clamp(along.dot(p - vertex[k]) / along.squaredNorm(), Scalar(0), Scalar(1));
      const Vector candidate = vertex[k] + t * along;
      const Scalar square = (p - candidate).squaredNorm();
      if (square >= least) continue;
      least = square;
      best = candidate;
      edges = edges_at(k, t);
    }
    return best;
  }

  // The edges at the place t, from 0 to 1, of edge k.
  static EdgeMask edges_at(int k, Scalar t) {
    if (t <= 0) return 1u << k | 1u << before(k);
    if (t >= 1) return 1u << k | 1u << after(k);
    return 1u << k;
  }

  Face<Scalar> face() const {
    Face<Scalar> result;
    result.normal = normal;
    result.id = id;
    result.count = 3;
    for (int k = 0; k < 3; ++k) {
      result.vertex[k] = vertex[k];
      result.vertex_id[k] = static_cast<std::uint16_t>(id == 1 && k > 0 ? 3 - k : k);
    }
    return result;
  }

  const MeshTriangle<Scalar>& mesh;
  const Matrix3<Scalar>& turn;  // from the axes of the mesh
  Vector vertex[3];
  Vector normal;
  Vector out[3];    // unit length, perpendicular to edge k in the plane, out of the triangle
  Vector limit[3];  // normals at edge k must not point along it: out of the neighbour's side of the edge
  bool has_limit[3];
  int id;  // 0: the front as the mesh has it, 1: the back
};

// A capsule whose core goes from `low` to `low + along`.
template <typename Scalar>
class CapsuleFacet {
 public:
  using Vector = Vector3<Scalar>;

  // Of a facet that is placed, without its edges.
  CapsuleFacet(Facet<Scalar>& facet, const Capsule<Scalar>& capsule, const Vector& axis, Scalar margin)
      : facet_(facet),
        radius_(capsule.radius),
        margin_(margin),
        low_(-capsule.half_length * axis),
        along_(2 * capsule.half_length * axis) {}

  Manifold<Scalar> collide() {
    Manifold<Scalar> manifold;
    const Scalar low_height = facet_.height(low_);
    const Scalar high_height = facet_.height(low_ + along_);
    if (std::min(low_height, high_height) > radius_ + margin_) return manifold;
    facet_.place_edges();
    if (is_beyond_an_edge()) return manifold;
    const bool crosses = low_height * high_height < 0 &&
                         facet_.is_above(low_ + low_height / (low_height - high_height) * along_);
    if (crosses) {
      find_least(std::min(low_height, high_height), low_height < high_height ? Scalar(0) : Scalar(1));
    } else {
      find_closest();
    }
    const Scalar distance = (at(core_) - on_facet_).dot(normal_);
    const Scalar gap = distance - radius_;
    const bool is_from_behind =
        !crosses && edges_ == 0 && distance < 0 && facet_.mesh.kept_on == KeptOn::kSideOfCentre;
    if (gap > margin_ || is_from_behind) return manifold;

    manifold.normal = normal_;
    if (!crosses && facet_.leans(normal_, edges_)) {
      manifold.normal = facet_.normal;
      touch_face(facet_.face(), low_, along_, radius_, std::numeric_limits<Scalar>::max(), margin_, manifold);
      for (int n = 0; n < manifold.count; ++n) {
        ContactPoint<Scalar>& point = manifold.point[n];
        point.gap = std::max(point.gap, gap);
        point.on_a = point.on_b + point.gap * manifold.normal;
      }
      return manifold;
    }
    const Scalar limit = crosses ? std::numeric_limits<Scalar>::max() : gap;
    if (touch_face(facet_.face(), low_, along_, radius_, limit, margin_, manifold)) return manifold;
    manifold.count = 1;
    manifold.point[0] = {at(core_) - radius_ * normal_, on_facet_, gap, core_ > Scalar(0.5) ? 1u : 0u};
    return manifold;
  }

 private:
  Vector at(Scalar t) const { return low_ + t * along_; }

  // Both ends are so far beyond an edge that they touch nothing, however numbers are rounded.
  bool is_beyond_an_edge() const {
    constexpr Scalar kClearly(1.01);
    constexpr Scalar kRounding(1e-5);
    for (int k = 0; k < 3; ++k) {
      const Vector lever = low_ - facet_.vertex[k];
      const Scalar low = facet_.out[k].dot(lever);
      const Scalar high = low + facet_.out[k].dot(along_);
      const Scalar reach = kClearly * (radius_ + margin_) + kRounding * lever.template lpNorm<1>();
      if (std::min(low, high) > reach) return true;
    }
    return false;
  }

  // The core goes through the triangle: along its normal, or out over an open edge.
  void find_least(Scalar height, Scalar end) {
    normal_ = facet_.normal;
    core_ = end;
    on_facet_ = at(end) - height * normal_;
    edges_ = 0;
    Scalar best = height;
    for (int k = 0; k < 3; ++k) {
      if (facet_.has_limit[k]) continue;
      const Vector edge = facet_.vertex[after(k)] - facet_.vertex[k];
      Vector axis = edge.cross(along_);
      const Scalar length = axis.norm();
      if (!(length > Scalar(kParallelSine) * edge.norm() * along_.norm())) continue;
      axis *= (axis.dot(facet_.out[k]) < 0 ? -1 : 1) / length;
      const Scalar separation = axis.dot(low_ - facet_.vertex[k]);
      if (separation <= best + Scalar(kEdgeBias) * radius_) continue;
      const ClosestSegments<Scalar> closest(low_, along_, facet_.vertex[k], edge);
      best = separation;
      normal_ = axis;
      core_ = closest.s;
      on_facet_ = closest.on_b;
      edges_ = 1u << k;
    }
  }

  void find_closest() {
    Scalar least = std::numeric_limits<Scalar>::max();
    const auto consider = [&](Scalar core, const Vector& on_facet, EdgeMask edges) {
      const Scalar square = (at(core) - on_facet).squaredNorm();
      if (square >= least) return;
      least = square;
      core_ = core;
      on_facet_ = on_facet;
      edges_ = edges;
    };
    for (const Scalar core : {Scalar(0), Scalar(1)}) {
      EdgeMask edges = 0;
      const Vector on_facet = facet_.closest(at(core), edges);
      consider(core, on_facet, edges);
    }
    for (int k = 0; k < 3; ++k) {
      const ClosestSegments<Scalar> closest(low_, along_, facet_.vertex[k],
                                            facet_.vertex[after(k)] - facet_.vertex[k]);
      consider(closest.s, closest.on_b, Facet<Scalar>::edges_at(k, closest.t));
    }
    const bool is_noise = !(least > Scalar(kCoreNoise * kCoreNoise) * radius_ * radius_);
    normal_ = is_noise || edges_ == 0 ? facet_.normal : Vector((at(core_) - on_facet_) / std::sqrt(least));
  }

  Facet<Scalar>& facet_;
  Scalar radius_;
  Scalar margin_;
  Vector low_;
  Vector along_;
  Vector normal_;
  Scalar core_ = 0;  // the place on the core, from 0 to 1
  Vector on_facet_;
  EdgeMask edges_ = 0;
};

// A polyhedron, in its own axes.
template <typename Scalar>
class HullFacet {
 public:
  using Vector = Vector3<Scalar>;

  HullFacet(const Hull<Scalar>& hull, Facet<Scalar>& facet, Scalar margin)
      : hull_(hull), facet_(facet), margin_(margin) {}

  Manifold<Scalar> collide() {
    Manifold<Scalar> manifold;
    const Scalar height = lowest(hull_.vertices, facet_.normal) - facet_.normal.dot(facet_.vertex[0]);
    if (height > margin_ || !find_face()) return manifold;
    facet_.place_edges();
    if (!find_edge()) return manifold;
    const Scalar face_best = std::max(height, face_separation_);
    bool is_done = false;
    if (edge_separation_ > face_best + Scalar(kEdgeBias) * hull_.thickness) {
      if (edge_separation_ <= 0) manifold = lie_on_edge();
      is_done = manifold.count > 0 || touch_edge(manifold) || edge_separation_ <= 0;
    } else if (face_separation_ > height + Scalar(kFaceBias) * hull_.thickness) {
      manifold =
          clip_faces(face_of(hull_, face_), facet_.face(), Vector(-hull_.planes[face_].normal), margin_);
      is_done = manifold.count > 0;
    } else {
      manifold = touch_facet();
      if (manifold.count > 0) return manifold;
    }
    if (!is_done) touch_rest(std::max(face_best, edge_separation_), manifold);
    if (manifold.count > 0) keep_off_neighbours(manifold);
    return manifold;
  }

 private:
  // False if apart by more than the margin; likewise below.
  bool find_face() {
    for (int f = 0; f < static_cast<int>(hull_.planes.size()); ++f) {
      const HalfSpace<Scalar>& plane = hull_.planes[f];
      const Scalar separation = lowest(std::span<const Vector>(facet_.vertex), plane.normal) - plane.offset;
      const bool is_from_behind = plane.normal.dot(facet_.normal) > Scalar(kBehind);
      if (separation > (is_from_behind ? 0 : margin_)) return false;
      if (separation <= face_separation_ || is_from_behind) continue;
      face_separation_ = separation;
      face_ = f;
    }
    return true;
  }

  // Normals at an edge of a triangle are on a half of a great circle of the Gauss map.
  bool find_edge() {
    Slopes<Scalar> slopes;
    for (int k = 0; k < 3; ++k) {
      const Vector along = facet_.vertex[after(k)] - facet_.vertex[k];
      const Scalar square_along = along.squaredNorm();
      slopes.find(hull_, along);
      for (int n = 0; n < static_cast<int>(hull_.edges.size()); ++n) {
        const HullEdge& edge = hull_.edges[n];
        const Scalar left = slopes.of[edge.left];
        if (left * slopes.of[edge.right] >= 0) continue;
        const Vector& tail = hull_.vertices[edge.tail];
        const Vector direction = hull_.vertices[edge.head] - tail;
        Vector out = direction.cross(along);
        if (out.dot(facet_.out[k]) * left >= 0) continue;
        const Scalar square = out.squaredNorm();
        if (square <= Scalar(kParallelSine * kParallelSine) * direction.squaredNorm() * square_along)
          continue;
        out *= (left > 0 ? 1 : -1) / std::sqrt(square);
        const Scalar separation = out.dot(facet_.vertex[k] - tail);
        const bool is_from_behind = out.dot(facet_.normal) > Scalar(kBehind);
        if (separation > (is_from_behind ? 0 : margin_)) return false;
        if (separation <= edge_separation_ || is_from_behind) continue;
        edge_separation_ = separation;
        edge_ = n;
        side_ = k;
        edge_out_ = out;
      }
    }
    return true;
  }

  // Returns whether the points are between the ends of the edges.
  bool touch_edge(Manifold<Scalar>& manifold) const {
    const HullEdge& edge = hull_.edges[edge_];
    const Vector& tail = hull_.vertices[edge.tail];
    const ClosestSegments<Scalar> closest(tail, hull_.vertices[edge.head] - tail, facet_.vertex[side_],
                                          facet_.vertex[after(side_)] - facet_.vertex[side_]);
    manifold.normal = -edge_out_;
    manifold.count = 1;
    manifold.point[0] = {closest.on_a, closest.on_b, (closest.on_b - closest.on_a).dot(edge_out_),
                         make_feature(Touch::kEdges, edge_, side_)};
    return closest.is_inside();
  }

  // A face that lies on an edge of the triangle touches along it, though far corners of a large triangle are
  // higher.
  Manifold<Scalar> lie_on_edge() const {
    const int face = supporting_face_index(hull_, edge_out_);
    if (hull_.planes[face].normal.dot(edge_out_) < Scalar(kLiesCosine)) return {};
    return clip_faces(face_of(hull_, face), facet_.face(), Vector(-edge_out_), margin_);
  }

  // Where no faces are opposite each other.
  void touch_rest(Scalar separation, Manifold<Scalar>& manifold) const {
    if (separation > 0) {
      closest_edges<Scalar>({hull_.vertices, hull_.edges}, {facet_.vertex, kTriangleEdges},
                            Vector(manifold.normal), margin_, manifold);
    } else if (edge_ >= 0) {
      touch_edge(manifold);
    } else {
      manifold = touch_facet();
    }
  }

  Manifold<Scalar> touch_facet() const {
    const int face = supporting_face_index(hull_, Vector(-facet_.normal));
    return clip_faces(face_of(hull_, face), facet_.face(), facet_.normal, margin_);
  }

  void keep_off_neighbours(Manifold<Scalar>& manifold) const {
    const EdgeMask edges = facet_.edges_towards(manifold.normal);
    if (!facet_.leans(manifold.normal, edges)) return;
    Scalar least = manifold.point[0].gap;
    for (int n = 1; n < manifold.count; ++n) least = std::min(least, manifold.point[n].gap);

    const Vector normal = facet_.clamp(manifold.normal, edges);
    if (least > 0 || facet_.normal.cross(normal).squaredNorm() < Scalar(kSameNormal * kSameNormal)) {
      const Manifold<Scalar> above = touch_facet();
      if (least > 0 || above.count > 0) {
        manifold = above;
        for (int n = 0; n < manifold.count; ++n)
          manifold.point[n].gap = std::max(manifold.point[n].gap, least);
      }
    }
    if (manifold.count > 0 && least <= 0) manifold.normal = normal;
    for (int n = 0; n < manifold.count; ++n) {
      ContactPoint<Scalar>& point = manifold.point[n];
      point.on_a = point.on_b + point.gap * manifold.normal;
    }
  }

  const Hull<Scalar>& hull_;
  Facet<Scalar>& facet_;
  Scalar margin_;
  int face_ = 0;
  Scalar face_separation_ = std::numeric_limits<Scalar>::lowest();
  int edge_ = -1;
  int side_ = 0;
  Scalar edge_separation_ = std::numeric_limits<Scalar>::lowest();
  Vector edge_out_;
};

template <typename Scalar>
Manifold<Scalar> collide_hull(const Hull<Scalar>& a, const MeshTriangle<Scalar>& b,
                              const Placement<Scalar>& placement, Scalar margin) {
  const Matrix3<Scalar> to_a = placement.a.transpose();
  const Matrix3<Scalar> rotation = to_a * placement.b;
  Facet<Scalar> facet(b, rotation);
  facet.place(to_a * placement.offset);
  Manifold<Scalar> manifold = HullFacet<Scalar>(a, facet, margin).collide();
  turn(placement.a, manifold);
  return manifold;
}

}  // namespace

template <typename Scalar>
bool is_kept_behind(const MeshTriangle<Scalar>& triangle, const Vector3<Scalar>& p) {
  const Matrix3<Scalar> level = Matrix3<Scalar>::Identity();
  Facet<Scalar> facet(triangle, level);
  facet.place(-p);
  return facet.id == 1;
}

template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const MeshTriangle<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin) {
  using Vector = Vector3<Scalar>;
  Manifold<Scalar> manifold;
  Facet<Scalar> facet(b, placement.b);
  facet.place(placement.offset);
  const Scalar reach = a.radius + margin;
  const Scalar height = facet.height(Vector::Zero());
  if (height > reach) return manifold;
  facet.place_edges();
  EdgeMask edges = 0;
  const Vector on_b = facet.closest(Vector::Zero(), edges);
  Scalar distance = height;
  manifold.normal = facet.normal;
  if (edges != 0) {
    distance = on_b.norm();
    if (distance > reach) return manifold;
    if (b.kept_on != KeptOn::kSideOfCentre && facet.is_behind_edges(on_b, edges)) {
      distance = -distance;
    } else {
      if (distance > Scalar(1e-4) * a.radius) manifold.normal = -on_b / distance;
      if (facet.leans(manifold.normal, edges)) return manifold;
      // What is all but above the face touches that: a lean is a slope to what rolls on.
      if ((manifold.normal - facet.normal).squaredNorm() < Scalar(kLean * kLean))
        manifold.normal = facet.normal;
    }
  }
  manifold.count = 1;
  manifold.point[0] = {-a.radius * manifold.normal, on_b, distance - a.radius, 0};
  return manifold;
}

template <typename Scalar>
Manifold<Scalar> collide(const Capsule<Scalar>& a, const MeshTriangle<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin) {
  Facet<Scalar> facet(b, placement.b);
  facet.place(placement.offset);
  return CapsuleFacet<Scalar>(facet, a, placement.a.col(2), margin).collide();
}

template <typename Scalar>
Manifold<Scalar> collide(const Box<Scalar>& a, const MeshTriangle<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin) {
  const BoxHull<Scalar> box(a.half);
  return collide_hull<Scalar>(box.view(), b, placement, margin);
}

template <typename Scalar>
Manifold<Scalar> collide(const Polyhedron<Scalar>& a, const MeshTriangle<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin) {
  return collide_hull<Scalar>(view(a), b, placement, margin);
}

template bool is_kept_behind(const MeshTriangle<float>&, const Vector3<float>&);
template bool is_kept_behind(const MeshTriangle<double>&, const Vector3<double>&);
template Manifold<float> collide(const Ball<float>&, const MeshTriangle<float>&, const Placement<float>&,
                                 float);
template Manifold<double> collide(const Ball<double>&, const MeshTriangle<double>&, const Placement<double>&,
                                  double);
template Manifold<float> collide(const Capsule<float>&, const MeshTriangle<float>&, const Placement<float>&,
                                 float);
template Manifold<double> collide(const Capsule<double>&, const MeshTriangle<double>&,
                                  const Placement<double>&, double);
template Manifold<float> collide(const Box<float>&, const MeshTriangle<float>&, const Placement<float>&,
                                 float);
template Manifold<double> collide(const Box<double>&, const MeshTriangle<double>&, const Placement<double>&,
                                  double);
template Manifold<float> collide(const Polyhedron<float>&, const MeshTriangle<float>&,
                                 const Placement<float>&, float);
template Manifold<double> collide(const Polyhedron<double>&, const MeshTriangle<double>&,
                                  const Placement<double>&, double);

}  // namespace tessera::collision
