#include "lpss/native/narrow_phase.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <span>

#include "lpss/base/columns.h"
#include "lpss/collision/hull.h"
#include "lpss/native/combine.h"
#include "lpss/native/deep_overlap.h"
#include "lpss/native/round_shapes.h"

namespace tessera::native {
namespace {

using collision::Manifold;
using collision::Placement;
using Kind = Part::Kind;

// Contacts with triangles whose normals differ by less than some 8 degrees are one patch.
constexpr Scalar kSameNormal = Scalar(0.99);
// A patch continues one of the last tick whose normal differs by less than some 45 degrees.
constexpr Scalar kContinues = Scalar(0.7);
// Points that are closer to each other than this share of a shape's diagonal are one: at an edge that two
// triangles share, both have it.
constexpr Scalar kSamePoint = Scalar(1e-3);
// Points of a surface with one body, at most.
constexpr std::size_t kSurfacePatchesMax = 8;
constexpr std::size_t kPointsMax = 64;
// Directions whose angle has a larger cosine than this are on the same side of a surface.
constexpr Scalar kOutside = Scalar(0.3);
// How far a shape with its centre beyond a surface is still taken for one that was pushed through, as a share
// of its width across the surface.
constexpr Scalar kThrough = Scalar(0.5);

bool is_convex(Kind kind) { return kind != Kind::kPlane && kind != Kind::kTerrain; }

// A ball as large as a planet beside a small body. Numbers relative to its centre are too coarse to say where
// its surface is.
bool is_planet(const Body& body, const Part& part, const Body& other) {
  constexpr double kLarge = 1024;
  return body.motion == Motion::kStatic && part.kind == Kind::kBall &&
         part.radius > kLarge * double(other.solid->radius());
}

// Its surface near a body: a plane, but for the curvature. In the world's axes.
class PlanetSurface {
 public:
  PlanetSurface(const Body& planet, const Part& ball, const Body& near) : radius_(ball.radius) {
    const Eigen::Vector3d up = near.pose.position.cast<double>() - centre_of(planet, ball);
    up_ = up.normalized();
    height_ = up.norm() - radius_;
  }

  Vector up() const { return up_.cast<Scalar>(); }
  // m, of its plane below the body's centre.
  Vector foot() const { return (up_ * -height_).cast<Scalar>(); }

  // m, from the surface to a point that is `gap` above the plane, `from_body` relative to the body's centre:
  // sqrt((r + gap)^2 + side^2) - r, without cancellation.
  Scalar gap(Scalar gap, const Vector& from_body) const {
    const Eigen::Vector3d lever = from_body.cast<double>();
    const double side = (lever - up_ * up_.dot(lever)).squaredNorm();
    const double square = side + double(gap) * double(gap) + 2 * radius_ * double(gap);
    return Scalar(square / (std::sqrt(radius_ * radius_ + square) + radius_));
  }

 private:
  static Eigen::Vector3d centre_of(const Body& planet, const Part& ball) {
    const Eigen::Vector3d body(planet.static_state->position.data());
    return body +
           matrix(planet.static_state->rotation).cast<double>() *
               planet.solid->offset().position.cast<double>() +
           planet.pose.rotation.cast<double>() * ball.frame.position.cast<double>();
  }

  double radius_;  // m
  double height_;  // m, of the body's centre
  Eigen::Vector3d up_;
};

bool is_flat(const Part& part) {
  return part.kind == Kind::kBox || part.kind == Kind::kPlane || part.kind == Kind::kTerrain ||
         part.polyhedron;
}

// Points on flat shapes stay where they are on the shape, and so do those on the caps of cylinders, where
// there are three or more; other round ones roll over theirs.
bool keeps_points(const Solid& solid, std::span<const ContactPatch> patches) {
  const auto lies_on_caps = [&] {
    return std::all_of(patches.begin(), patches.end(),
                       [](const ContactPatch& patch) { return patch.count >= 3; });
  };
  return std::all_of(solid.parts().begin(), solid.parts().end(), [&](const Part& part) {
    return is_flat(part) || (is_cylinder(part) && lies_on_caps());
  });
}

// Calls `with` with the shape of a part that lpss/collision knows.
template <typename With>
Manifold<Scalar> visit(const Part& part, const With& with) {
  switch (part.kind) {
    case Kind::kBall:
      return with(part.ball);
    case Kind::kCapsule:
      return with(part.capsule);
    case Kind::kBox:
      return with(part.cuboid);
    case Kind::kPolyhedron:
      return with(*part.polyhedron);
    default:
      return {};
  }
}

Manifold<Scalar> collide_convex(const Part& a, const Part& b, const Placement<Scalar>& placement,
                                Scalar margin, const Vector& before) {
  if (a.kind == Kind::kRound || b.kind == Kind::kRound) return collide_round(a, b, placement, margin, before);
  return visit(a, [&](const auto& shape_a) {
    return visit(
        b, [&](const auto& shape_b) { return collision::collide(shape_a, shape_b, placement, margin); });
  });
}

Manifold<Scalar> collide_triangle(const Part& a, const MeshTriangle<Scalar>& b,
                                  const Placement<Scalar>& placement, Scalar margin) {
  if (a.kind == Kind::kRound) return collide_round(a, b, placement, margin);
  return visit(a, [&](const auto& shape) { return collision::collide(shape, b, placement, margin); });
}

// The bounds of a shape a, seen from the frame of b.
Bounds seen_from_b(const Bounds& bounds, const Placement<Scalar>& placement) {
  return bounds.posed({placement.b.transpose() * placement.a, placement.b.transpose() * -placement.offset});
}

// Manifolds of one convex shape with the triangles of a surface, by normals. Few, and the deepest ones, are
// left.
class SurfaceContact {
 public:
  // `turn`: from the frame of the convex part to that of the manifolds.
  SurfaceContact(const Part& convex, const Matrix& turn)
      : apart_((convex.bounds.high - convex.bounds.low).squaredNorm() * (kSamePoint * kSamePoint)) {
    if (convex.kind == Kind::kCapsule) axis_ = turn.col(2);
  }

  void add(std::uint32_t triangle, const Manifold<Scalar>& manifold) {
    if (manifold.count == 0) return;
    Cluster* cluster = nullptr;
    for (Cluster& known : clusters_) {
      if (known.normal.dot(manifold.normal) > kSameNormal) {
        cluster = &known;
        break;
      }
    }
    if (!cluster) cluster = &clusters_.emplace_back();
    Scalar least = std::numeric_limits<Scalar>::max();
    for (int n = 0; n < manifold.count; ++n) {
      collision::ContactPoint<Scalar> point = manifold.point[n];
      least = std::min(least, point.gap);
      // Unique within the contact, and the same as long as the same features touch.
      point.feature ^= (triangle + 1) * std::uint32_t{0x9e3779b1};
      const bool is_known = std::ranges::any_of(cluster->points, [&](const auto& known) {
        return (known.on_b - point.on_b).squaredNorm() < apart_;
      });
      if (is_known) continue;
      if (cluster->points.size() == kPointsMax) keep_extreme(*cluster);
      cluster->points.push_back(point);
    }
    if (least < cluster->least) {
      cluster->least = least;
      cluster->normal = manifold.normal;
    }
  }

  // Of clusters that push a shape from both sides of one surface, in which it would jam, keeps the one
  // towards `outside`, or the one that overlaps less where that says nothing. Their overlaps add up to the
  // width of the shape; in a crack between two surfaces, it is the width of the crack less.
  void keep_one_side(const Vector& outside, const Part& convex, const Matrix& turn) {
    constexpr Scalar kOpposite = Scalar(-0.7);
    constexpr Scalar kOfWidth = Scalar(0.5);
    const auto is_beaten = [&](const Cluster& cluster) {
      return std::ranges::any_of(clusters_, [&](const Cluster& other) {
        if (cluster.normal.dot(other.normal) > kOpposite) return false;
        const Scalar width = (convex.bounds.high - convex.bounds.low)
                                 .dot(Vector(turn.transpose() * cluster.normal).cwiseAbs());
        if (-(cluster.least + other.least) < kOfWidth * width) return false;
        const Scalar towards = outside.dot(cluster.normal - other.normal);
        return towards < 0 || (towards == 0 && cluster.least < other.least);
      });
    };
    if (clusters_.size() < 2) return;
    absl::InlinedVector<Cluster, 2> kept;
    std::ranges::copy_if(clusters_, std::back_inserter(kept),
                         [&](const Cluster& cluster) { return !is_beaten(cluster); });
    clusters_ = std::move(kept);
  }

  template <typename Take>
  void for_each(const Take& take) {
    std::stable_sort(clusters_.begin(), clusters_.end(),
                     [](const Cluster& x, const Cluster& y) { return x.least < y.least; });
    if (clusters_.size() > kSurfacePatchesMax) clusters_.resize(kSurfacePatchesMax);
    for (Cluster& cluster : clusters_) {
      if (!axis_.isZero(0)) keep_line(cluster);
      Manifold<Scalar> manifold;
      manifold.normal = cluster.normal;
      collision::reduce(std::span<const collision::ContactPoint<Scalar>>(cluster.points), manifold);
      take(manifold);
    }
  }

 private:
  // Points whose normals are about the same.
  struct Cluster {
    Vector normal = Vector::Zero();
    Scalar least = std::numeric_limits<Scalar>::max();
    absl::InlinedVector<collision::ContactPoint<Scalar>, 8> points;
  };

  // A shape on many small triangles has more points than there is room for: those in the middle matter least.
  static void keep_extreme(Cluster& cluster) {
    Manifold<Scalar> manifold;
    manifold.normal = cluster.normal;
    collision::reduce(std::span<const collision::ContactPoint<Scalar>>(cluster.points), manifold);
    cluster.points.assign(manifold.point, manifold.point + manifold.count);
  }

  // A capsule touches a plane along its axis: of points that several triangles have there, one beside the
  // other by rounding, those at the ends bear it, and the deepest where the surface bulges.
  void keep_line(Cluster& cluster) const {
    if (cluster.points.size() <= 2) return;
    const auto along = [&](const auto& point) { return axis_.dot(point.on_a); };
    const auto [low, high] = std::ranges::minmax_element(cluster.points, {}, along);
    const auto deepest = std::ranges::min_element(cluster.points, {}, [](const auto& p) { return p.gap; });
    const Scalar slack = (along(*high) - along(*low)) * kSamePoint;
    const bool bulges = deepest->gap < std::min(low->gap, high->gap) - slack;
    absl::InlinedVector<collision::ContactPoint<Scalar>, 8> kept = {*low, *high};
    if (bulges) kept.push_back(*deepest);
    cluster.points = std::move(kept);
  }

  const Scalar apart_;            // m^2, the square of how far apart two points are
  Vector axis_ = Vector::Zero();  // of a capsule; otherwise 0
  absl::InlinedVector<Cluster, 2> clusters_;
};

// The direction, from b to a, in which the two parts were kept off each other in the last tick; 0 if they
// were not.
Vector outside_of(const Contact& before, std::uint64_t parts) {
  Vector sum = Vector::Zero();
  for (const ContactPatch& patch : before.patches) {
    if (patch.parts == parts) sum += patch.normal;
  }
  const Scalar length = sum.norm();
  return length > kOutside ? Vector(sum / length) : Vector(Vector::Zero());
}

// The normal of two parts in the last tick; 0 if they had none.
Vector normal_of(const Contact& before, std::uint64_t parts) {
  for (const ContactPatch& patch : before.patches) {
    if (patch.parts == parts) return patch.normal;
  }
  return Vector::Zero();
}

// What has been pushed with its centre a little way through a surface is kept on the side on which it was.
// `outside` in the frame of the surface.
void keep_outside(const Vector& outside, const Part& convex, const Placement<Scalar>& placement,
                  MeshTriangle<Scalar>& triangle) {
  if (triangle.kept_on != collision::KeptOn::kSideOfCentre) return;
  const Scalar slope = outside.dot(triangle.normal);
  if (!(std::abs(slope) > kOutside)) return;
  const Vector centre = placement.b.transpose() * -placement.offset;
  const Scalar height = triangle.normal.dot(centre - triangle.vertex[0]);
  const Vector across = placement.a.transpose() * (placement.b * triangle.normal);
  if (std::abs(height) > kThrough * (convex.bounds.high - convex.bounds.low).dot(across.cwiseAbs())) return;
  triangle.kept_on = slope > 0 ? collision::KeptOn::kFront : collision::KeptOn::kBack;
}

// m, the gap up to which two bodies have points. Two balls that bounce have none before they meet: a row of
// them, each at rest a little way off, would take the blow together, as one body.
Scalar margin_of(const Body& a, const Body& b) {
  const auto is_ball = [](const Body& body) {
    return body.solid->parts().size() == 1 && body.solid->parts().front().kind == Kind::kBall;
  };
  if (a.restitution * b.restitution > 0 && is_ball(a) && is_ball(b)) return 0;
  return std::min(a.solid->margin(), b.solid->margin());
}

// The motion of one body as another sees it: which of the two is the smaller one, and where it is in the
// other's frame.
Frame seen_by_larger(const Body& a, const Body& b) {
  const bool a_is_larger = a.solid->radius() >= b.solid->radius();
  const Body& larger = a_is_larger ? a : b;
  const Body& smaller = a_is_larger ? b : a;
  const Columns<Scalar> back(larger.pose.rotation.transpose());
  return {back * smaller.pose.rotation, back * Vector(smaller.pose.position - larger.pose.position)};
}

// Where numbers tell no smaller gaps, there is none: the solver would hold what it takes for open harder than
// what touches, and turn a box by its corners.
void close_gaps(const Body& a, const Body& b, Contact& contact) {
  constexpr Scalar kSpacing = 2 * std::numeric_limits<Scalar>::epsilon();
  const bool by_a = a.is_dynamic();
  for (ContactPatch& patch : contact.patches) {
    for (int n = 0; n < patch.count; ++n) {
      ContactPoint& point = patch.point[n];
      if (!(point.gap > 0)) continue;
      const Vector place = by_a ? a.pose * point.on_a : b.pose * point.on_b;
      if (point.gap <= kSpacing * std::abs(patch.normal.dot(place))) point.gap = 0;
    }
  }
}

}  // namespace

bool NarrowPhase::may_touch(const Body& a, const Body& b) {
  // Of what is added up here: more than rounding can be.
  constexpr Scalar kSlack = Scalar(1e-5);
  const Vector offset = b.pose.position - a.pose.position;
  const auto is_within = [&](const Vector& apart, Scalar reach) {
    const Scalar most = reach * (1 + kSlack) + std::min(a.solid->margin(), b.solid->margin());
    return apart.squaredNorm() <= most * most;
  };
  if (!is_within(offset, a.solid->radius() + b.solid->radius())) return false;
  const Part& p = a.solid->parts().front();
  const Part& q = b.solid->parts().front();
  const auto is_lone_on_axis = [](const Body& body, const Part& part) {
    return body.solid->parts().size() == 1 && !part.is_placed &&
           (part.kind == Kind::kBall || part.kind == Kind::kCapsule || is_cylinder(part));
  };
  if (!is_lone_on_axis(a, p) || !is_lone_on_axis(b, q)) return true;
  // A cylinder is within its radius of its axis, too.
  const auto radius = [](const Part& part) {
    return part.kind == Kind::kBall ? part.ball.radius : Scalar(part.half.x());
  };
  const Scalar reach = radius(p) + radius(q);
  if (p.kind == Kind::kBall && q.kind == Kind::kBall) return is_within(offset, reach);
  const Vector half_a = a.pose.rotation.col(2) * p.core.half.z();
  const Vector half_b = b.pose.rotation.col(2) * q.core.half.z();
  const Vector low_b = offset - half_b;
  // Of two segments, the first one may be a point.
  using Segments = collision::ClosestSegments<Scalar>;
  const Segments axes = q.kind == Kind::kBall
                            ? Segments(low_b, Vector(Vector::Zero()), Vector(-half_a), Vector(2 * half_a))
                            : Segments(Vector(-half_a), Vector(2 * half_a), low_b, Vector(2 * half_b));
  return is_within(axes.on_a - axes.on_b, reach);
}

bool NarrowPhase::update(const Body& a, const Body& b, Contact& contact) {
  if (contact.is_predicted() || contact.materials) drop_predicted(contact);
  const Scalar margin = margin_of(a, b);
  const bool is_new = !contact.is_found || !move_along(a, b, seen_by_larger(a, b), margin, contact);
  if (is_new) {
    found_.clear();
    find(a, b, contact, margin);
    inherit(contact);
    contact.patches.assign(found_.begin(), found_.end());
    contact.is_found = !found_.empty() && keeps_points(*a.solid, found_) && keeps_points(*b.solid, found_);
    contact.found_at = contact.is_found ? seen_by_larger(a, b) : Frame{};
  }
  close_gaps(a, b, contact);
  return is_new;
}

void NarrowPhase::look(const Body& a, const Body& b, Scalar margin, Contact& contact) {
  contact.patches.clear();
  found_.clear();
  find(a, b, contact, margin);
  contact.patches.assign(found_.begin(), found_.end());
}

// As long as no point of the smaller body has moved by more than half the margin, nothing else can touch.
bool NarrowPhase::move_along(const Body& a, const Body& b, const Frame& seen, Scalar margin,
                             Contact& contact) const {
  const Scalar radius = std::min(a.solid->radius(), b.solid->radius());
  const Scalar turn = (seen.rotation - contact.found_at.rotation).norm() * Scalar(std::numbers::sqrt2 / 2);
  const Scalar way = (seen.position - contact.found_at.position).norm();
  if (!(way + turn * radius <= margin / 2)) return false;
  using Axes = Columns<Scalar>;
  const Axes of_a(a.pose.rotation);
  const Axes of_b(b.pose.rotation);
  const Axes::Wide offset = Axes::widened(b.pose.position - a.pose.position);
  for (ContactPatch& patch : contact.patches) {
    patch.normal = (patch.is_fixed_to_a ? of_a : of_b) * patch.fixed_normal;
    for (int n = 0; n < patch.count; ++n) {
      ContactPoint& point = patch.point[n];
      const Axes::Wide apart = of_a.times(point.on_a) - of_b.times(point.on_b) - offset;
      point.gap = Axes::narrowed(apart).dot(patch.normal);
    }
  }
  return true;
}

void NarrowPhase::find(const Body& a, const Body& b, const Contact& before, Scalar margin) {
  const std::vector<Part>& parts_a = a.solid->parts();
  const std::vector<Part>& parts_b = b.solid->parts();
  const bool is_filtered = a.solid->has_materials() || b.solid->has_materials();
  const auto may_touch = [&](const Part& p, const Part& q) {
    return !is_filtered || native::may_touch(a, p, b, q);
  };
  if (parts_a.size() == 1 && parts_b.size() == 1) {
    if (may_touch(parts_a[0], parts_b[0])) find(a, parts_a[0], b, parts_b[0], 0, before, margin);
    return;
  }
  const auto seen = [&](const Bounds& bounds, const Body& from, const Body& by) {
    return bounds
        .posed({by.pose.rotation.transpose() * from.pose.rotation, by.pose.inverse(from.pose.position)})
        .grown(margin);
  };
  a.solid->parts_near(seen(b.solid->bounds(), b, a), parts_of_a_);
  for (const std::uint32_t i : parts_of_a_) {
    b.solid->parts_near(seen(bounds_at(parts_a[i], {}), a, b), parts_of_b_);
    for (const std::uint32_t j : parts_of_b_) {
      if (!may_touch(parts_a[i], parts_b[j])) continue;
      find(a, parts_a[i], b, parts_b[j], std::uint64_t{i} << 32 | j, before, margin);
    }
  }
  open_one_way(a, b, found_);
}

void NarrowPhase::find(const Body& a, const Part& p, const Body& b, const Part& q, std::uint64_t parts,
                       const Contact& before, Scalar margin) {
  if (!is_convex(p.kind) && !is_convex(q.kind)) return;
  if (is_planet(b, q, a)) return find_on_planet(a, p, b, q, parts, margin);
  if (is_planet(a, p, b)) return find_on_planet(b, q, a, p, parts, margin);
  const Vector offset = b.pose.position - a.pose.position;
  const Vector lever_a = p.is_placed ? Vector(a.pose.rotation * p.frame.position) : Vector(Vector::Zero());
  const Vector lever_b = q.is_placed ? Vector(b.pose.rotation * q.frame.position) : Vector(Vector::Zero());
  const Placement<Scalar> placement{
      p.is_placed ? Matrix(a.pose.rotation * p.frame.rotation) : a.pose.rotation,
      q.is_placed ? Matrix(b.pose.rotation * q.frame.rotation) : b.pose.rotation,
      offset + lever_b - lever_a,
  };
  const auto keep = [&](const Manifold<Scalar>& manifold) {
    if (manifold.count == 0) return;
    const Matrix to_a = a.pose.rotation.transpose();
    const Matrix to_b = b.pose.rotation.transpose();
    ContactPatch& patch = found_.emplace_back();
    patch.parts = parts;
    patch.normal = manifold.normal;
    patch.count = static_cast<std::uint8_t>(manifold.count);
    bool is_on_face_of_a = is_convex(p.kind) && is_convex(q.kind);
    for (int n = 0; n < manifold.count; ++n) {
      const collision::ContactPoint<Scalar>& from = manifold.point[n];
      patch.point[n] = {to_a * (from.on_a + lever_a), to_b * (from.on_b + lever_a - offset), from.gap, 0,
                        from.feature};
      is_on_face_of_a = is_on_face_of_a && collision::touch_of(from.feature) == collision::Touch::kVertexB;
    }
    // A face keeps its normal; vertices move over it.
    patch.is_fixed_to_a = is_on_face_of_a || !is_convex(p.kind);
    patch.fixed_normal = (patch.is_fixed_to_a ? to_a : to_b) * manifold.normal;
  };
  if (is_convex(p.kind) && is_convex(q.kind))
    return keep(collide_convex(p, q, placement, margin, normal_of(before, parts)));

  // A plane or a surface is the second of the two.
  const bool is_swapped = !is_convex(p.kind);
  const Part& convex = is_swapped ? q : p;
  const Part& ground = is_swapped ? p : q;
  const Placement<Scalar> above = is_swapped ? placement.swapped() : placement;
  const auto keep_above = [&](const Manifold<Scalar>& manifold) {
    keep(is_swapped ? collision::swapped(manifold, above.offset) : manifold);
  };
  if (ground.kind == Kind::kPlane) return keep_above(collide_plane(convex, ground.normal, above, margin));
  Terrain::List triangles;
  ground.terrain->near(seen_from_b(convex.bounds, above).grown(margin), triangles);
  SurfaceContact contact(convex, above.a);
  const Vector outside = above.b.transpose() * (outside_of(before, parts) * (is_swapped ? -1 : 1));
  for (Terrain::Found& found : triangles) {
    keep_outside(outside, convex, above, found.triangle);
    contact.add(found.index, collide_triangle(convex, found.triangle, above, margin));
  }
  contact.keep_one_side(above.b * outside, convex, above.a);
  contact.for_each(keep_above);
}

void NarrowPhase::find_on_planet(const Body& body, const Part& part, const Body& planet, const Part& ball,
                                 std::uint64_t parts, Scalar margin) {
  const PlanetSurface surface(planet, ball, body);
  const Vector lever = body.pose.rotation * part.frame.position;
  const Placement<Scalar> above{body.pose.rotation * part.frame.rotation, Matrix::Identity(),
                                surface.foot() - lever};
  const Manifold<Scalar> manifold = collide_plane(part, surface.up(), above, margin);
  if (manifold.count == 0) return;
  const bool is_planet_a = planet.id < body.id;
  ContactPatch& patch = found_.emplace_back();
  patch.parts = parts;
  patch.normal = is_planet_a ? Vector(-surface.up()) : surface.up();
  patch.count = static_cast<std::uint8_t>(manifold.count);
  for (int n = 0; n < manifold.count; ++n) {
    const collision::ContactPoint<Scalar>& from = manifold.point[n];
    const Vector on_body = body.pose.rotation.transpose() * (from.on_a + lever);
    const Vector on_planet = planet.pose.inverse(body.pose.position + lever + from.on_b);
    patch.point[n] = {is_planet_a ? on_planet : on_body, is_planet_a ? on_body : on_planet,
                      surface.gap(from.gap, from.on_a + lever), 0, from.feature};
  }
  patch.is_fixed_to_a = is_planet_a;
  patch.fixed_normal = planet.pose.rotation.transpose() * patch.normal;
}

// Impulses stay with their features; a point with a new one inherits from an old point near it that none
// continues.
void NarrowPhase::inherit(const Contact& before) {
  if (before.patches.empty()) return;
  for (ContactPatch& patch : found_) {
    const ContactPatch* best = nullptr;
    Scalar most = kContinues;
    for (const ContactPatch& old : before.patches) {
      if (old.parts != patch.parts) continue;
      const Scalar agreement = old.normal.dot(patch.normal);
      if (agreement > most) {
        most = agreement;
        best = &old;
      }
    }
    if (!best) continue;
    patch.friction_impulse = best->friction_impulse;
    patch.twist_impulse = best->twist_impulse;
    patch.rolling_impulse = best->rolling_impulse;
    bool is_taken[kPatchPointsMax] = {};
    bool has_inherited[kPatchPointsMax] = {};
    for (int n = 0; n < patch.count; ++n) {
      for (int m = 0; m < best->count; ++m) {
        if (is_taken[m] || best->point[m].feature != patch.point[n].feature) continue;
        patch.point[n].impulse = best->point[m].impulse;
        is_taken[m] = has_inherited[n] = true;
        break;
      }
    }
    for (int n = 0; n < patch.count; ++n) {
      if (has_inherited[n]) continue;
      int nearest = -1;
      Scalar least = std::numeric_limits<Scalar>::max();
      for (int m = 0; m < best->count; ++m) {
        if (is_taken[m]) continue;
        const Scalar distance = (best->point[m].on_a - patch.point[n].on_a).squaredNorm();
        if (distance < least) {
          least = distance;
          nearest = m;
        }
      }
      if (nearest < 0) continue;
      patch.point[n].impulse = best->point[nearest].impulse;
      is_taken[nearest] = true;
    }
  }
}

Scalar NarrowPhase::distance(const Solid& p, const Frame& p_at, const Solid& q, const Frame& q_at,
                             Scalar reach) {
  Scalar least = std::numeric_limits<Scalar>::max();
  const auto posed = [](const Part& part, const Frame& at) { return part.is_placed ? at * part.frame : at; };
  for (const Part& i : p.parts()) {
    for (const Part& j : q.parts()) {
      if (!is_convex(i.kind) && !is_convex(j.kind)) continue;
      const Part& convex = is_convex(i.kind) ? i : j;
      const Part& other = is_convex(i.kind) ? j : i;
      const Frame at = posed(convex, is_convex(i.kind) ? p_at : q_at);
      const Frame other_at = posed(other, is_convex(i.kind) ? q_at : p_at);
      if (is_convex(other.kind)) {
        least = std::min(least, native::distance(convex, at, other, other_at, reach));
        continue;
      }
      if (other.kind == Kind::kPlane) {
        const Vector up = other_at.rotation * other.normal;
        const Vector lowest = at * farthest(convex, Vector(at.rotation.transpose() * -up));
        least = std::min(least, up.dot(lowest - other_at.position));
        continue;
      }
      const Placement<Scalar> placement{at.rotation, other_at.rotation, other_at.position - at.position};
      Terrain::List triangles;
      other.terrain->near(seen_from_b(convex.bounds, placement).grown(reach), triangles);
      for (const Terrain::Found& found : triangles) {
        least = std::min(least, native::distance(convex, at, found.triangle, other_at, reach));
      }
    }
  }
  return least;
}

}  // namespace tessera::native
