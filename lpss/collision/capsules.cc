// Balls and capsules against each other and against polyhedra. A round shape is the distance `radius` around
// a core: a point, or a segment.

#include "lpss/collision/capsules.h"

#include "lpss/collision/collide.h"

namespace tessera::collision {
namespace {

template <typename Scalar>
Vector3<Scalar> any_perpendicular(const Vector3<Scalar>& v) {
  int least = 0;
  v.cwiseAbs().minCoeff(&least);
  return v.cross(Vector3<Scalar>::Unit(least)).normalized();
}

// Two round shapes whose cores are closest at `a` and `b`; `normal` is for cores that meet.
template <typename Scalar>
void touch_round(const Vector3<Scalar>& a, Scalar radius_a, const Vector3<Scalar>& b, Scalar radius_b,
                 const Vector3<Scalar>& normal, Scalar margin, Manifold<Scalar>& manifold) {
  const Vector3<Scalar> away = a - b;
  const Scalar square = away.squaredNorm();
  const Scalar reach = radius_a + radius_b + margin;
  if (square > reach * reach) return;
  const Scalar distance = std::sqrt(square);
  const Scalar noise = 4 * std::numeric_limits<Scalar>::epsilon() * (radius_a + radius_b);
  manifold.normal = distance > noise ? Vector3<Scalar>(away / distance) : normal;
  manifold.count = 1;
  const Scalar along = distance > noise ? distance : away.dot(normal);
  manifold.point[0] = {a - radius_a * manifold.normal, b + radius_b * manifold.normal,
                       along - radius_a - radius_b, 0};
}

template <typename Scalar>
Vector3<Scalar> closest_on_segment(const Vector3<Scalar>& centre, const Vector3<Scalar>& axis,
                                   Scalar half_length, const Vector3<Scalar>& p) {
  return centre + std::clamp(axis.dot(p - centre), -half_length, half_length) * axis;
}

// The second point of capsules that lie side by side: that of the cores' ends, if it faces the same way.
template <typename Scalar>
bool touch_along(const Vector3<Scalar>& a, Scalar radius_a, const Vector3<Scalar>& b, Scalar radius_b,
                 const Vector3<Scalar>& normal, Scalar margin, std::uint32_t feature,
                 ContactPoint<Scalar>& point) {
  constexpr Scalar kSameWay(0.9);
  const Vector3<Scalar> away = a - b;
  const Scalar distance = away.norm();
  if (!(away.dot(normal) > kSameWay * distance)) return false;
  const Vector3<Scalar> direction = away / distance;
  const Vector3<Scalar> on_a = a - radius_a * direction;
  const Vector3<Scalar> on_b = b + radius_b * direction;
  point = {on_a, on_b, (on_a - on_b).dot(normal), feature};
  return point.gap <= margin;
}

// A ball at `centre` that is above face `face` of a polyhedron by `height`; both in the axes of the
// polyhedron.
template <typename Scalar>
void touch_ball(const Hull<Scalar>& hull, const Vector3<Scalar>& centre, Scalar radius, Scalar height,
                int face, Scalar margin, Manifold<Scalar>& manifold) {
  const Vector3<Scalar>& normal = hull.planes[face].normal;
  if (height > 0) {
    bool is_on_face = false;
    const Vector3<Scalar> on_hull = closest_on_hull(hull, centre, face, is_on_face);
    if (!is_on_face) {
      touch_round(centre, radius, on_hull, Scalar(0), normal, margin, manifold);
      // What is all but above the face touches that: a lean is a slope to what rolls on.
      constexpr Scalar kLean(1e-3);
      if (manifold.count > 0 && (manifold.normal - normal).squaredNorm() < kLean * kLean)
        manifold.normal = normal;
      return;
    }
  }
  manifold.normal = normal;
  manifold.count = 1;
  manifold.point[0] = {centre - radius * normal, centre - height * normal, height - radius, 0};
}

// On a ball so large that a face of the shape is all but level with it, the point that is nearest runs from
// edge to edge as the shape tilts by the least angle: the corners of the face touch instead. In the axes of
// the shape.
template <typename Scalar, typename Shape>
void touch_by_corners(const Shape& shape, const Vector3<Scalar>& centre, Scalar radius, Scalar margin,
                      Manifold<Scalar>& manifold) {
  constexpr Scalar kLevel(1.0 / 16);  // of the margin
  if (manifold.count == 0) return;
  // The centre of an even larger one is rounded by more than its surface is level.
  if (radius * std::numeric_limits<Scalar>::epsilon() > kLevel * margin) return;
  const ContactPoint<Scalar> nearest = manifold.point[0];
  const Vector3<Scalar> away = centre - nearest.on_b;
  const Scalar distance = away.norm();
  const Face<Scalar> face = supporting_face(shape, manifold.normal);
  ContactPoint<Scalar> corners[kFaceVerticesMax];
  std::size_t count = 0;
  for (int n = 0; n < face.count; ++n) {
    const Vector3<Scalar> way = nearest.on_b - face.vertex[n];
    if (way.squaredNorm() > 2 * radius * kLevel * margin) return;
    // How much farther it is from the centre, without the difference of two large numbers.
    const Scalar farther = (way.squaredNorm() + 2 * away.dot(way)) / ((away + way).norm() + distance);
    const Scalar gap = nearest.gap + farther;
    if (gap > margin) continue;
    corners[count++] = {face.vertex[n] + gap * manifold.normal, face.vertex[n], gap, 1u + face.vertex_id[n]};
  }
  if (count > 1) reduce(std::span<const ContactPoint<Scalar>>(corners, count), manifold);
}

// From axes and origin of b to those of the world and a's centre.
template <typename Scalar>
void from_b(const Placement<Scalar>& placement, Manifold<Scalar>& manifold) {
  turn(placement.b, manifold);
  for (int n = 0; n < manifold.count; ++n) {
    manifold.point[n].on_a += placement.offset;
    manifold.point[n].on_b += placement.offset;
  }
}

// A capsule against a polyhedron, in the axes of the polyhedron.
template <typename Scalar>
class CapsuleHull {
 public:
  using Vector = Vector3<Scalar>;

  CapsuleHull(const Hull<Scalar>& hull, const Capsule<Scalar>& capsule, const Vector& centre,
              const Vector& axis, Scalar margin)
      : hull_(hull),
        radius_(capsule.radius),
        margin_(margin),
        low_(centre - capsule.half_length * axis),
        along_(2 * capsule.half_length * axis) {}

  Manifold<Scalar> collide() {
    Manifold<Scalar> manifold;
    if (!find_face() || !find_edge()) return manifold;
    const Scalar noise = Scalar(kCoreNoise) * std::min(hull_.thickness, radius_);
    const Scalar separation = std::max(face_separation_, edge_separation_);
    const bool is_edge = edge_separation_ > face_separation_ + Scalar(kEdgeBias) * hull_.thickness;
    if (separation > noise) {
      find_closest();
    } else if (is_edge) {
      const HullEdge& edge = hull_.edges[edge_];
      const Vector& tail = hull_.vertices[edge.tail];
      const ClosestSegments<Scalar> closest(low_, along_, tail, hull_.vertices[edge.head] - tail);
      normal_ = edge_out_;
      core_ = closest.s;
      on_hull_ = closest.on_b;
    } else {
      normal_ = hull_.planes[face_].normal;
      core_ = normal_.dot(along_) > 0 ? 0 : 1;
      on_hull_ = at(core_) - face_separation_ * normal_;
    }
    const bool is_deep = separation <= noise;
    touch(is_deep && is_edge, is_deep, manifold);
    return manifold;
  }

 private:
  Vector at(Scalar t) const { return low_ + t * along_; }

  // False if apart by more than the margin; likewise below.
  bool find_face() {
    slopes_.find(hull_, along_);
    for (int f = 0; f < static_cast<int>(hull_.planes.size()); ++f) {
      const HalfSpace<Scalar>& plane = hull_.planes[f];
      const Scalar height = plane.normal.dot(low_) - plane.offset;
      const Scalar separation = height + std::min(slopes_.of[f], Scalar(0));
      if (separation > margin_ + radius_) return false;
      if (separation <= face_separation_) continue;
      face_separation_ = separation;
      face_ = f;
    }
    return true;
  }

  // An edge matters only if its arc on the Gauss map crosses the great circle of the core.
  bool crosses(const HullEdge& edge) const { return slopes_.of[edge.left] * slopes_.of[edge.right] < 0; }

  bool find_edge() {
    const Scalar square_core = along_.squaredNorm();
    for (int n = 0; n < static_cast<int>(hull_.edges.size()); ++n) {
      const HullEdge& edge = hull_.edges[n];
      if (!crosses(edge)) continue;
      const Vector& tail = hull_.vertices[edge.tail];
      const Vector direction = hull_.vertices[edge.head] - tail;
      Vector out = direction.cross(along_);
      const Scalar square = out.squaredNorm();
      if (square <= Scalar(kParallelSine * kParallelSine) * direction.squaredNorm() * square_core) continue;
      out *= (slopes_.of[edge.left] > 0 ? 1 : -1) / std::sqrt(square);
      const Scalar separation = out.dot(low_ - tail);
      if (separation > margin_ + radius_) return false;
      if (separation <= edge_separation_) continue;
      edge_separation_ = separation;
      edge_ = n;
      edge_out_ = out;
    }
    return true;
  }

  void find_closest() {
    Scalar least = std::numeric_limits<Scalar>::max();
    const auto consider = [&](Scalar core, const Vector& on_hull) {
      const Scalar square = (at(core) - on_hull).squaredNorm();
      if (square >= least) return;
      least = square;
      core_ = core;
      on_hull_ = on_hull;
    };
    for (const Scalar core : {Scalar(0), Scalar(1)}) {
      int face = 0;
      const Vector end = at(core);
      bool is_on_face = false;
      if (height_above(hull_, end, face) > 0) consider(core, closest_on_hull(hull_, end, face, is_on_face));
    }
    for (const HullEdge& edge : hull_.edges) {
      if (!crosses(edge)) continue;
      const Vector& tail = hull_.vertices[edge.tail];
      const ClosestSegments<Scalar> closest(low_, along_, tail, hull_.vertices[edge.head] - tail);
      consider(closest.s, closest.on_b);
    }
    normal_ = (at(core_) - on_hull_).normalized();
  }

  void touch(bool is_edge, bool is_deep, Manifold<Scalar>& manifold) const {
    manifold.normal = normal_;
    const Scalar gap = (at(core_) - on_hull_).dot(normal_) - radius_;
    if (gap > margin_) return;
    if (!is_edge) {
      const Face<Scalar> face = face_of(hull_, supporting_face_index(hull_, normal_));
      // The lowest end of a core that overlaps may be beside the face.
      const Scalar limit = is_deep ? std::numeric_limits<Scalar>::max() : gap;
      if (touch_face(face, low_, along_, radius_, limit, margin_, manifold)) return;
    }
    manifold.count = 1;
    manifold.point[0] = {at(core_) - radius_ * normal_, on_hull_, gap, core_ > Scalar(0.5) ? 1u : 0u};
  }

  const Hull<Scalar>& hull_;
  Scalar radius_;
  Scalar margin_;
  Vector low_;  // the end of the core at -z
  Vector along_;
  Slopes<Scalar> slopes_;  // along the core
  int face_ = 0;
  Scalar face_separation_ = std::numeric_limits<Scalar>::lowest();
  int edge_ = -1;
  Scalar edge_separation_ = std::numeric_limits<Scalar>::lowest();
  Vector edge_out_;
  // What is closest: the direction to the core, the place on it, from 0 to 1, and the point of the
  // polyhedron.
  Vector normal_;
  Scalar core_ = 0;
  Vector on_hull_;
};

template <typename Scalar>
Manifold<Scalar> collide_capsule(const Capsule<Scalar>& a, const Hull<Scalar>& b,
                                 const Placement<Scalar>& placement, Scalar margin) {
  const Matrix3<Scalar> to_b = placement.b.transpose();
  Manifold<Scalar> manifold =
      CapsuleHull<Scalar>(b, a, to_b * -placement.offset, to_b * placement.a.col(2), margin).collide();
  from_b(placement, manifold);
  return manifold;
}

}  // namespace

template <typename Scalar>
bool touch_face(const Face<Scalar>& face, const Vector3<Scalar>& low, const Vector3<Scalar>& along,
                Scalar radius, Scalar gap, Scalar margin, Manifold<Scalar>& manifold) {
  using Vector = Vector3<Scalar>;
  constexpr Scalar kSlack(1e-3);  // of the extents
  const Vector& normal = manifold.normal;
  const Scalar alignment = face.normal.dot(normal);
  if (!(alignment > Scalar(0.5))) return false;
  // The core, projected on the face along the normal.
  const auto height = [&](const Vector& p) { return face.normal.dot(p - face.vertex[0]) / alignment; };
  const Scalar low_height = height(low);
  const Scalar rise = height(low + along) - low_height;
  const Vector start = low - low_height * normal;
  const Vector way = along - rise * normal;
  Scalar from = 0;
  Scalar to = 1;
  for (int n = 0; n < face.count; ++n) {
    const Vector edge = face.vertex[n + 1 < face.count ? n + 1 : 0] - face.vertex[n];
    const Vector out = edge.cross(face.normal);
    const Scalar distance = out.dot(start - face.vertex[n]);
    const Scalar speed = out.dot(way);
    if (distance <= 0 && distance + speed <= 0) continue;
    if (speed > 0) {
      to = std::min(to, -distance / speed);
    } else if (speed < 0) {
      from = std::max(from, -distance / speed);
    } else {
      return false;
    }
    if (!(to - from > kSlack)) return false;
  }
  const Scalar gap_from = low_height + from * rise - radius;
  const Scalar gap_to = low_height + to * rise - radius;
  if (std::max(gap_from, gap_to) > margin || std::min(gap_from, gap_to) > gap + kSlack * radius) return false;
  manifold.count = 2;
  for (int n = 0; n < 2; ++n) {
    const Scalar t = n == 0 ? from : to;
    const Vector core = low + t * along;
    manifold.point[n] = {core - radius * normal, start + t * way, n == 0 ? gap_from : gap_to,
                         static_cast<std::uint32_t>(n)};
  }
  return true;
}

template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const Ball<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin) {
  using Vector = Vector3<Scalar>;
  Manifold<Scalar> manifold;
  touch_round(Vector(Vector::Zero()), a.radius, placement.offset, b.radius, Vector(Vector::UnitZ()), margin,
              manifold);
  return manifold;
}

template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const Capsule<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin) {
  using Vector = Vector3<Scalar>;
  Manifold<Scalar> manifold;
  const Vector axis = placement.b.col(2);
  const Vector centre = Vector::Zero();
  touch_round(centre, a.radius, closest_on_segment(placement.offset, axis, b.half_length, centre), b.radius,
              any_perpendicular(axis), margin, manifold);
  return manifold;
}

template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const Box<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin) {
  using Vector = Vector3<Scalar>;
  Manifold<Scalar> manifold;
  const Vector centre = placement.b.transpose() * -placement.offset;
  Vector on_box = centre.cwiseMax(-b.half).cwiseMin(b.half);
  if ((centre.cwiseAbs() - b.half).maxCoeff() > a.radius + margin) return manifold;
  int axis = 0;
  const Scalar height = (centre.cwiseAbs() - b.half).maxCoeff(&axis);
  Vector normal = Vector::Zero();
  normal[axis] = centre[axis] < 0 ? Scalar(-1) : Scalar(1);
  if (height > 0) {
    touch_round(centre, a.radius, on_box, Scalar(0), normal, margin, manifold);
  } else {
    on_box[axis] = normal[axis] * b.half[axis];
    manifold.normal = normal;
    manifold.count = 1;
    manifold.point[0] = {centre - a.radius * normal, on_box, height - a.radius, 0};
  }
  touch_by_corners(b, centre, a.radius, margin, manifold);
  from_b(placement, manifold);
  return manifold;
}

template <typename Scalar>
Manifold<Scalar> collide(const Ball<Scalar>& a, const Polyhedron<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin) {
  Manifold<Scalar> manifold;
  const Hull<Scalar> hull = view(b);
  const Vector3<Scalar> centre = placement.b.transpose() * -placement.offset;
  int face = 0;
  const Scalar height = height_above(hull, centre, face);
  if (height > a.radius + margin) return manifold;
  touch_ball(hull, centre, a.radius, height, face, margin, manifold);
  touch_by_corners(b, centre, a.radius, margin, manifold);
  from_b(placement, manifold);
  return manifold;
}

template <typename Scalar>
Manifold<Scalar> collide(const Capsule<Scalar>& a, const Capsule<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin) {
  using Vector = Vector3<Scalar>;
  constexpr Scalar kSideBySide(0.05);  // sine of the angle
  Manifold<Scalar> manifold;
  const Vector axis_a = placement.a.col(2);
  const Vector axis_b = placement.b.col(2);
  const Vector low_a = -a.half_length * axis_a;
  const Vector low_b = placement.offset - b.half_length * axis_b;
  const ClosestSegments<Scalar> closest(low_a, 2 * a.half_length * axis_a, low_b, 2 * b.half_length * axis_b);
  const Vector across = axis_a.cross(axis_b);
  const Scalar sine = across.norm();
  const bool is_parallel = sine < kSideBySide;
  touch_round(closest.on_a, a.radius, closest.on_b, b.radius,
              sine > Scalar(kParallelSine) ? Vector(across / sine) : any_perpendicular(axis_a), margin,
              manifold);
  if (manifold.count == 0) return manifold;
  manifold.point[0].feature = closest.s > Scalar(0.5) ? 1 : 0;
  if (!is_parallel) return manifold;

  // Where both are, along a's axis.
  const Scalar middle = axis_a.dot(placement.offset);
  const Scalar reach = std::abs(axis_a.dot(axis_b)) * b.half_length;
  const Scalar from = std::max(-a.half_length, middle - reach);
  const Scalar to = std::min(a.half_length, middle + reach);
  if (!(to - from > Scalar(1e-3) * a.half_length)) return manifold;
  ContactPoint<Scalar> points[2];
  for (int n = 0; n < 2; ++n) {
    const Vector core = (n == 0 ? from : to) * axis_a;
    const Vector other = closest_on_segment(placement.offset, axis_b, b.half_length, core);
    if (!touch_along(core, a.radius, other, b.radius, manifold.normal, margin, static_cast<std::uint32_t>(n),
                     points[n]))
      return manifold;
  }
  manifold.count = 2;
  manifold.point[0] = points[0];
  manifold.point[1] = points[1];
  return manifold;
}

template <typename Scalar>
Manifold<Scalar> collide(const Capsule<Scalar>& a, const Box<Scalar>& b, const Placement<Scalar>& placement,
                         Margin<Scalar> margin) {
  const BoxHull<Scalar> box(b.half);
  return collide_capsule<Scalar>(a, box.view(), placement, margin);
}

template <typename Scalar>
Manifold<Scalar> collide(const Capsule<Scalar>& a, const Polyhedron<Scalar>& b,
                         const Placement<Scalar>& placement, Margin<Scalar> margin) {
  return collide_capsule<Scalar>(a, view(b), placement, margin);
}

template bool touch_face(const Face<float>&, const Vector3<float>&, const Vector3<float>&, float, float,
                         float, Manifold<float>&);
template bool touch_face(const Face<double>&, const Vector3<double>&, const Vector3<double>&, double, double,
                         double, Manifold<double>&);
template Manifold<float> collide(const Ball<float>&, const Ball<float>&, const Placement<float>&, float);
template Manifold<double> collide(const Ball<double>&, const Ball<double>&, const Placement<double>&, double);
template Manifold<float> collide(const Ball<float>&, const Capsule<float>&, const Placement<float>&, float);
template Manifold<double> collide(const Ball<double>&, const Capsule<double>&, const Placement<double>&,
                                  double);
template Manifold<float> collide(const Ball<float>&, const Box<float>&, const Placement<float>&, float);
template Manifold<double> collide(const Ball<double>&, const Box<double>&, const Placement<double>&, double);
template Manifold<float> collide(const Ball<float>&, const Polyhedron<float>&, const Placement<float>&,
                                 float);
template Manifold<double> collide(const Ball<double>&, const Polyhedron<double>&, const Placement<double>&,
                                  double);
template Manifold<float> collide(const Capsule<float>&, const Capsule<float>&, const Placement<float>&,
                                 float);
template Manifold<double> collide(const Capsule<double>&, const Capsule<double>&, const Placement<double>&,
                                  double);
template Manifold<float> collide(const Capsule<float>&, const Box<float>&, const Placement<float>&, float);
template Manifold<double> collide(const Capsule<double>&, const Box<double>&, const Placement<double>&,
                                  double);
template Manifold<float> collide(const Capsule<float>&, const Polyhedron<float>&, const Placement<float>&,
                                 float);
template Manifold<double> collide(const Capsule<double>&, const Polyhedron<double>&, const Placement<double>&,
                                  double);

}  // namespace tessera::collision
