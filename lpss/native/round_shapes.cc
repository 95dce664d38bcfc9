#include "lpss/native/round_shapes.h"

#include <absl/container/inlined_vector.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "lpss/collision/closest.h"
#include "lpss/native/features.h"

namespace tessera::native {
namespace {

using collision::Face;
using collision::Manifold;
using collision::MeshTriangle;
using collision::Placement;
using Point = collision::ContactPoint<Scalar>;
using Points = absl::InlinedVector<Point, 16>;

// A direction closer than this to the normal of a triangle looks at its face.
constexpr Scalar kLiesFrom = Scalar(0.7071);
// A cap or side that is tilted by more than some 15 degrees touches at one point: others are beyond the
// margin.
constexpr Scalar kLiesCosine = Scalar(0.966);
// The nearest points are points of their own where they are deeper than all others by this share of the
// margin.
constexpr Scalar kDeeper = Scalar(0.05);
constexpr std::uint32_t kNearest = 0x7fff7fff;
// Of 1 less the cosine: a direction that GJK finds is that of a face where it differs by less.
constexpr Scalar kFaceDirection = Scalar(5e-5);
// What overlaps a face by less than this share of the margin lies on it, however little it overlaps it
// sideways.
constexpr Scalar kShallow = Scalar(0.25);
// Lines whose angle has a smaller sine than this lie along each other.
constexpr Scalar kParallel = Scalar(0.1);

using Nearest = collision::Closest<Scalar>;

// With a and b exchanged; `offset` is from the centre of b to that of a, as in `found`.
Nearest swapped(const Nearest& found, const Vector& offset) {
  return {-found.normal, found.on_b + offset, found.on_a + offset, found.gap};
}

// The middle of a part, which a hull's centre of mass may be far from. In its frame.
Vector middle_of(const Part& part) { return (part.bounds.low + part.bounds.high) / 2; }

std::optional<Nearest> nearest(const Part& a, const Part& b, const Placement<Scalar>& placement,
                               Scalar margin, const Vector& before = Vector::Zero()) {
  return collision::closest<Scalar>(a.core, b.core, placement, margin, before);
}

std::optional<Nearest> nearest(const Part& a, const MeshTriangle<Scalar>& b,
                               const Placement<Scalar>& placement, Scalar margin) {
  collision::Core<Scalar> triangle;
  triangle.kind = collision::Core<Scalar>::Kind::kPoints;
  triangle.points = b.vertex;
  triangle.middle = (b.vertex[0] + b.vertex[1] + b.vertex[2]) / 3;
  return collision::closest<Scalar>(a.core, triangle, placement, margin, Vector::Zero());
}

// Whether a part of what is lowest of a shape, a line or a face, is over the face of a solid that looks along
// `out`, though the one lowest point, `gap` above it, may not be.
template <typename Solid>
bool is_level_over(const Part& shape, const Solid& solid, const Placement<Scalar>& placement,
                   const Vector& out, Scalar gap, Scalar margin) {
  const Feature feature =
      placed(feature_of(shape, placement.a.transpose() * -out), placement.a, Vector::Zero());
  if (!feature.line && !feature.face) return false;
  const Face<Scalar> face =
      collision::placed(collision::supporting_face(solid, Vector(placement.b.transpose() * out)), placement.b,
                        placement.offset);
  Scalar least = std::numeric_limits<Scalar>::max();
  const auto see = [&](const Vector& point) { least = std::min(least, out.dot(point - face.vertex[0])); };
  if (feature.line) {
    if (const std::optional<Line> over = clipped(*feature.line, face)) {
      see(over->from);
      see(over->to);
    }
  } else {
    const Manifold<Scalar> over = collision::clip_faces(*feature.face, face, out, margin);
    for (int n = 0; n < over.count; ++n) see(over.point[n].on_a);
  }
  return least <= gap + kDeeper * margin;
}

// A point that is the lowest over a face of a box, inside of the face's edges, is the nearest one. GJK finds
// it, too, but its normal leans by what numbers are too coarse for, by which rollers gain speed; and now and
// then it finds nothing where a small shape lies on a large one. `placement` is of the shape and the box; the
// normal points to the shape. `is_apart` is set where a face shows that they are.
std::optional<Nearest> over_a_face(const Part& shape, const collision::Box<Scalar>& box,
                                   const Placement<Scalar>& placement, Scalar margin, bool& is_apart) {
  std::optional<Nearest> best;
  for (int axis = 0; axis < 3; ++axis) {
    for (const Scalar side : {Scalar(-1), Scalar(1)}) {
      const Vector out = placement.b.col(axis) * side;
      const Vector lowest = placement.a * farthest(shape, Vector(placement.a.transpose() * -out));
      const Vector seen = placement.b.transpose() * (lowest - placement.offset);
      const Scalar gap = side * seen[axis] - box.half[axis];
      is_apart = !(gap <= margin);
      if (is_apart) return std::nullopt;
      const int u = (axis + 1) % 3;
      const int v = (axis + 2) % 3;
      const bool is_over =
          (std::abs(seen[u]) <= box.half[u] && std::abs(seen[v]) <= box.half[v]) ||
          (gap > -margin * kShallow && is_level_over(shape, box, placement, out, gap, margin));
      // A face on the far side is not what is touched.
      if (is_over && gap > (best ? best->gap : -margin)) best = Nearest{out, lowest, lowest - out * gap, gap};
    }
  }
  return best;
}

// Likewise of a polyhedron: of the face above which the shape is highest.
std::optional<Nearest> over_a_face(const Part& shape, const collision::Polyhedron<Scalar>& polyhedron,
                                   const Placement<Scalar>& placement, Scalar margin, bool& is_apart) {
  Nearest best;
  best.gap = -margin * kShallow;
  bool is_any = false;
  for (const collision::HalfSpace<Scalar>& plane : polyhedron.planes) {
    const Vector out = placement.b * plane.normal;
    const Vector lowest = placement.a * farthest(shape, Vector(placement.a.transpose() * -out));
    const Scalar gap = out.dot(lowest - placement.offset) - plane.offset;
    is_apart = !(gap <= margin);
    if (is_apart) return std::nullopt;
    if (gap <= best.gap) continue;
    best = Nearest{out, lowest, lowest - out * gap, gap};
    is_any = true;
  }
  if (!is_any || !is_level_over(shape, polyhedron, placement, best.normal, best.gap, margin))
    return std::nullopt;
  return best;
}

// The ends of a line that lies on a plane of the other, `is_a`: the line is that of a.
void lay_on_plane(const Line& line, const Vector& origin, const Vector& plane_normal, const Vector& normal,
                  bool is_a, Points& points) {
  const Scalar slope = plane_normal.dot(normal);
  if (slope == 0) return;
  std::uint32_t feature = 0;
  for (const Vector& end : {line.from, line.to}) {
    const Vector on_plane = end - normal * (plane_normal.dot(end - origin) / slope);
    const Vector& on_a = is_a ? end : on_plane;
    const Vector& on_b = is_a ? on_plane : end;
    points.push_back({on_a, on_b, (on_a - on_b).dot(normal), feature++});
  }
}

// The points of a line that lies on a face of the other, `is_a`: the line is that of a.
void lay_on_face(const Line& line, const Face<Scalar>& face, const Vector& normal, bool is_a,
                 Points& points) {
  if (const std::optional<Line> over = clipped(line, face))
    lay_on_plane(*over, face.vertex[0], face.normal, normal, is_a, points);
}

// The ends of where two lines lie along each other.
void lay_along(const Line& a, const Line& b, const Vector& normal, Points& points) {
  const Vector way_a = a.to - a.from;
  const Vector way_b = b.to - b.from;
  const Scalar length_a = way_a.norm();
  const Scalar length_b = way_b.norm();
  if (!(way_a.cross(way_b).norm() <= kParallel * length_a * length_b)) return;
  const Vector along = way_a / length_a;
  const auto place = [&](const Vector& p) { return along.dot(p - a.from); };
  const Scalar b_from = place(b.from);
  const Scalar b_to = place(b.to);
  const Scalar low = std::max(Scalar(0), std::min(b_from, b_to));
  const Scalar high = std::min(length_a, std::max(b_from, b_to));
  if (!(low < high) || b_from == b_to) return;
  std::uint32_t feature = 0;
  for (const Scalar at : {low, high}) {
    const Vector on_a = a.from + along * at;
    const Vector on_b = b.from + way_b * ((at - b_from) / (b_to - b_from));
    points.push_back({on_a, on_b, (on_a - on_b).dot(normal), feature++});
  }
}

bool is_faceted(const Part& part) { return part.kind == Part::Kind::kBox || part.polyhedron; }

// Whether a part without faces other than caps may have more than one point in a direction, of length 1.
bool may_lie(const Part& part, const Matrix& rotation, const Vector& direction) {
  if (part.kind != Part::Kind::kCapsule && !is_cylinder(part)) return false;
  const Scalar along = std::abs(rotation.col(2).dot(direction));
  const bool is_level = along * along < 1 - kLiesCosine * kLiesCosine;
  return is_level || (is_cylinder(part) && along > kLiesCosine);
}

Manifold<Scalar> at_one_point(const Nearest& found) {
  Manifold<Scalar> manifold;
  manifold.normal = found.normal;
  manifold.count = 1;
  manifold.point[0] = {found.on_a, found.on_b, found.gap, kNearest};
  return manifold;
}

// Those within the margin, and the nearest ones if these are deeper.
Manifold<Scalar> with_nearest(Points& points, const Nearest& found, Scalar margin) {
  points.erase(std::remove_if(points.begin(), points.end(), [&](const Point& p) { return p.gap > margin; }),
               points.end());
  Scalar least = std::numeric_limits<Scalar>::max();
  for (const Point& point : points) least = std::min(least, point.gap);
  if (found.gap < least - kDeeper * margin) points.push_back({found.on_a, found.on_b, found.gap, kNearest});
  Manifold<Scalar> manifold;
  manifold.normal = found.normal;
  collision::reduce(std::span<const Point>(points), manifold);
  return manifold;
}

// The line along the side of a capsule or cylinder that looks along `direction`, of length 1; none of one
// whose cap does.
std::optional<Line> line_of(const Part& part, const Matrix& rotation, const Vector& centre,
                            const Vector& direction) {
  const Vector axis = rotation.col(2);
  const Scalar along = axis.dot(direction);
  if (std::abs(along) > kLiesCosine) return std::nullopt;
  const Scalar radius = part.kind == Part::Kind::kCapsule ? part.capsule.radius : part.core.half.x();
  const Vector middle = centre + (direction - along * axis).normalized() * radius;
  return Line{middle - axis * part.core.half.z(), middle + axis * part.core.half.z()};
}

// Two of capsules and cylinders that may lie on each other, but not cap on cap: the lines along their sides
// are where they are by the axes. False if both are caps.
bool lay_sides(const Part& a, const Part& b, const Placement<Scalar>& placement, const Vector& normal,
               Points& points) {
  const std::optional<Line> line_a = line_of(a, placement.a, Vector::Zero(), Vector(-normal));
  const std::optional<Line> line_b = line_of(b, placement.b, placement.offset, normal);
  if (!line_a && !line_b) return false;
  if (line_a && line_b) {
    lay_along(*line_a, *line_b, normal, points);
    return true;
  }
  const Part& flat = line_a ? b : a;
  const Vector axis = line_a ? placement.b.col(2) : placement.a.col(2);
  const Vector towards = line_a ? normal : Vector(-normal);
  const Vector out = axis.dot(towards) < 0 ? Vector(-axis) : axis;
  const Vector centre = (line_a ? placement.offset : Vector(Vector::Zero())) + out * flat.core.half.z();
  const Line& line = line_a ? *line_a : *line_b;
  if (const std::optional<Line> over = clipped(line, centre, out, flat.core.half.x()))
    lay_on_plane(*over, centre, out, normal, line_a.has_value(), points);
  return true;
}

// The points of two features that look at each other along the normal, and the nearest ones if those are
// deeper.
Manifold<Scalar> between(const Feature& a, const Feature& b, const Nearest& found, Scalar margin) {
  Points points;
  if (a.face && b.face) {
    const Manifold<Scalar> covered = collision::clip_faces(*a.face, *b.face, found.normal, margin);
    points.assign(covered.point, covered.point + covered.count);
  } else if (a.line && b.face) {
    lay_on_face(*a.line, *b.face, found.normal, /*is_a=*/true, points);
  } else if (a.face && b.line) {
    lay_on_face(*b.line, *a.face, found.normal, /*is_a=*/false, points);
  } else if (a.line && b.line) {
    lay_along(*a.line, *b.line, found.normal, points);
  }
  return with_nearest(points, found, margin);
}

// A shape above the face of a triangle.
class AboveFace {
 public:
  // `up`: the triangle's normal on the side where the shape is kept.
  AboveFace(const Part& a, const MeshTriangle<Scalar>& b, const Placement<Scalar>& placement,
            const Vector& up)
      : a_(a), b_(b), placement_(placement) {
    lowest_.normal = up;
    lowest_.on_a = lowest_along(up);
    lowest_.gap = up.dot(lowest_.on_a - (placement.b * b.vertex[0] + placement.offset));
    lowest_.on_b = lowest_.on_a - up * lowest_.gap;
  }

  Scalar gap() const { return lowest_.gap; }

  // The points where what is lowest of the shape, also if it is a whole line or a face, is above the
  // triangle: its gap is then the distance. None where it is not.
  Manifold<Scalar> touch_level(Scalar margin) const {
    Manifold<Scalar> manifold = touch(std::numeric_limits<Scalar>::lowest(), margin);
    if (is_above(lowest_.on_a)) return manifold;
    Scalar least = std::numeric_limits<Scalar>::max();
    for (int n = 0; n < manifold.count; ++n) least = std::min(least, manifold.point[n].gap);
    if (least > gap() + kDeeper * margin) manifold.count = 0;
    return manifold;
  }

  // Whether what GJK found belongs to a neighbour: the normal leans over an edge farther than the neighbour's
  // own; or it does not lean, but what is lowest of the shape is beyond an edge where the neighbour is level
  // or rises; or what is lowest of the shape is above the neighbour, and hardly deeper there. `normal` in the
  // frame of the triangle, whose front is on the side where the shape is kept, or mirrored to it: `side` is
  // -1.
  bool belongs_to_neighbour(const Vector& normal, Scalar found_gap, Scalar side, Scalar margin) const {
    constexpr Scalar kLean = Scalar(1e-3);
    constexpr Scalar kNoise = Scalar(0.1);      // of what GJK finds on a large triangle
    constexpr Scalar kRounding = Scalar(1e-4);  // of the shape's diagonal
    for (int edge = 0; edge < 3; ++edge) {
      if (!b_.has_neighbour[edge]) continue;
      const Vector& other = b_.neighbour_normal[edge];
      const Vector along = (b_.vertex[(edge + 1) % 3] - b_.vertex[edge]).normalized();
      const Vector out = along.cross(b_.normal);
      const Scalar lean = normal.dot(out);
      const Scalar allowed = std::max(Scalar(0), other.dot(out));
      if (lean > allowed + kLean) return true;
      if (allowed <= kLean && lean > -kNoise && out.dot(foot(lowest_.on_a) - b_.vertex[edge]) > 0)
        return true;
      const Vector lowest = foot(lowest_along(placement_.b * other * side)) - b_.vertex[edge];
      const Scalar slack = (a_.bounds.high - a_.bounds.low).norm() * kRounding;
      const bool is_above_other = along.cross(other).dot(lowest) >= -slack;
      if (is_above_other && other.dot(lowest) * side > found_gap - margin) return true;
    }
    return false;
  }

  // The points along the normal, no deeper than `least`.
  Manifold<Scalar> touch(Scalar least, Scalar margin) const {
    const Vector& up = lowest_.normal;
    Nearest lowest = lowest_;
    // A shape that is deep in a surface of small triangles is above the one that its centre is above.
    if (!is_above(lowest_.on_a) && !is_above(placement_.a * middle_of(a_)))
      lowest.gap = std::numeric_limits<Scalar>::max();
    Feature face;
    face.face = collision::supporting_face(b_, Vector(placement_.b.transpose() * up));
    Manifold<Scalar> manifold =
        between(placed(feature_of(a_, placement_.a.transpose() * -up), placement_.a, Vector::Zero()),
                placed(face, placement_.b, placement_.offset), lowest, margin);
    for (int n = 0; n < manifold.count; ++n) {
      Point& point = manifold.point[n];
      point.gap = std::max(point.gap, least);
      point.on_a = point.on_b + point.gap * up;
    }
    return manifold;
  }

 private:
  Vector lowest_along(const Vector& up) const {
    return placement_.a * farthest(a_, Vector(placement_.a.transpose() * -up));
  }
  // In the frame of the triangle.
  Vector foot(const Vector& point) const { return placement_.b.transpose() * (point - placement_.offset); }

  bool is_above(const Vector& point) const {
    for (int edge = 0; edge < 3; ++edge) {
      const Vector along = b_.vertex[(edge + 1) % 3] - b_.vertex[edge];
      if (along.cross(b_.normal).dot(foot(point) - b_.vertex[edge]) > 0) return false;
    }
    return true;
  }

  const Part& a_;
  const MeshTriangle<Scalar>& b_;
  const Placement<Scalar>& placement_;
  Nearest lowest_;
};

// A point of a that is the lowest over a face of b, which looks along a direction from b to a: see
// over_a_face(). The face in the frame of b.
std::optional<Nearest> over_near_face(const Part& a, const Part& b, const std::optional<Face<Scalar>>& face,
                                      const Placement<Scalar>& placement, const Vector& direction) {
  if (!face) return std::nullopt;
  const Vector out = placement.b * face->normal;
  if (1 - out.dot(direction) > kFaceDirection) return std::nullopt;
  const Vector lowest = placement.a * farthest(a, Vector(placement.a.transpose() * -out));
  const Vector seen = placement.b.transpose() * (lowest - placement.offset);
  if (is_cylinder(b)) {
    if (seen.head<2>().squaredNorm() > face->vertex[0].head<2>().squaredNorm()) return std::nullopt;
  } else {
    for (int n = 0; n < face->count; ++n) {
      const Vector along = face->vertex[n + 1 < face->count ? n + 1 : 0] - face->vertex[n];
      if (along.cross(face->normal).dot(seen - face->vertex[n]) > 0) return std::nullopt;
    }
  }
  const Scalar gap = face->normal.dot(seen - face->vertex[0]);
  return Nearest{out, lowest, lowest - out * gap, gap};
}

}  // namespace

Manifold<Scalar> collide_round(const Part& a, const Part& b, const Placement<Scalar>& placement,
                               Scalar margin, const Vector& before) {
  std::optional<Nearest> found;
  bool is_apart = false;
  if (b.kind == Part::Kind::kBox) {
    found = over_a_face(a, b.cuboid, placement, margin, is_apart);
  } else if (b.kind == Part::Kind::kPolyhedron) {
    found = over_a_face(a, *b.polyhedron, placement, margin, is_apart);
  } else if (a.kind == Part::Kind::kBox || a.kind == Part::Kind::kPolyhedron) {
    found = a.kind == Part::Kind::kBox ? over_a_face(b, a.cuboid, placement.swapped(), margin, is_apart)
                                       : over_a_face(b, *a.polyhedron, placement.swapped(), margin, is_apart);
    if (found) found = swapped(*found, placement.offset);
  }
  if (is_apart) return {};
  const bool is_over_face = found.has_value();
  if (!found) found = nearest(a, b, placement, margin, before);
  if (!found) return {};
  if (!is_faceted(a) && !is_faceted(b)) {
    if (!may_lie(a, placement.a, found->normal) || !may_lie(b, placement.b, found->normal))
      return at_one_point(*found);
    Points points;
    if (lay_sides(a, b, placement, found->normal, points)) return with_nearest(points, *found, margin);
  }
  const Feature feature_a = feature_of(a, placement.a.transpose() * -found->normal);
  const Feature feature_b = feature_of(b, placement.b.transpose() * found->normal);
  if (!is_over_face) {
    if (std::optional<Nearest> over = over_near_face(a, b, feature_b.face, placement, found->normal)) {
      found = over;
    } else if ((over = over_near_face(b, a, feature_a.face, placement.swapped(), -found->normal))) {
      found = swapped(*over, placement.offset);
    }
    if (!(found->gap <= margin)) return {};
  }
  return between(placed(feature_a, placement.a, Vector::Zero()),
                 placed(feature_b, placement.b, placement.offset), *found, margin);
}

Manifold<Scalar> collide_round(const Part& a, const MeshTriangle<Scalar>& b,
                               const Placement<Scalar>& placement, Scalar margin) {
  const Vector centre = placement.b.transpose() * (placement.a * middle_of(a) - placement.offset);
  const Scalar side = collision::is_kept_behind(b, centre) ? Scalar(-1) : Scalar(1);
  const AboveFace above(a, b, placement, placement.b * b.normal * side);
  if (above.gap() > margin) return {};
  // GJK has trouble with a small shape on a large triangle, and its normals lean a little.
  Manifold<Scalar> level = above.touch_level(margin);
  if (level.count > 0) return level;
  const std::optional<Nearest> found = nearest(a, b, placement, margin);
  if (!found) return {};
  const Vector local = placement.b.transpose() * found->normal * side;
  if (local.dot(b.normal) <= 0 || above.belongs_to_neighbour(local, found->gap, side, margin))
    return above.touch(found->gap, margin);
  const Feature feature_a = feature_of(a, placement.a.transpose() * -found->normal);
  Feature feature_b;
  // An edge that two triangles share is touched, not a face that the normal grazes.
  if (local.dot(b.normal) > kLiesFrom)
    feature_b.face = collision::supporting_face(b, Vector(placement.b.transpose() * found->normal));
  return between(placed(feature_a, placement.a, Vector::Zero()),
                 placed(feature_b, placement.b, placement.offset), *found, margin);
}

Manifold<Scalar> collide_plane(const Part& a, const Vector& normal, const Placement<Scalar>& placement,
                               Scalar margin) {
  const Vector up = placement.b * normal;
  Points points;
  const auto add = [&](const Vector& on_a, std::uint32_t feature) {
    const Scalar gap = up.dot(on_a - placement.offset);
    if (gap <= margin) points.push_back({on_a, on_a - up * gap, gap, feature});
  };
  const Vector down = placement.a.transpose() * -up;
  if (a.kind == Part::Kind::kBox) {
    for (std::uint32_t n = 0; n < 8; ++n) {
      const Vector sign(n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1);
      add(placement.a * a.cuboid.half.cwiseProduct(sign), n);
    }
  } else if (a.kind == Part::Kind::kPolyhedron) {
    for (std::uint32_t n = 0; n < a.polyhedron->vertices.size(); ++n)
      add(placement.a * a.polyhedron->vertices[n], n);
  } else {
    const Feature feature = feature_of(a, down);
    if (feature.face) {
      for (int n = 0; n < feature.face->count; ++n)
        add(placement.a * feature.face->vertex[n], feature.face->vertex_id[n]);
    } else if (feature.line) {
      add(placement.a * feature.line->from, 0);
      add(placement.a * feature.line->to, 1);
    }
    Scalar least = std::numeric_limits<Scalar>::max();
    for (const Point& point : points) least = std::min(least, point.gap);
    const Vector lowest = placement.a * farthest(a, down);
    if (up.dot(lowest - placement.offset) < least - kDeeper * margin) add(lowest, kNearest);
  }
  Manifold<Scalar> manifold;
  manifold.normal = up;
  collision::reduce(std::span<const Point>(points), manifold);
  return manifold;
}

namespace {

template <typename Other>
Scalar distance_of(const Part& a, const Frame& at_a, const Other& b, const Frame& at_b, Scalar reach) {
  const Placement<Scalar> placement{at_a.rotation, at_b.rotation, at_b.position - at_a.position};
  const std::optional<Nearest> found = nearest(a, b, placement, reach);
  return found ? found->gap : std::numeric_limits<Scalar>::max();
}

}  // namespace

Scalar distance(const Part& a, const Frame& at_a, const Part& b, const Frame& at_b, Scalar reach) {
  return distance_of(a, at_a, b, at_b, reach);
}

Scalar distance(const Part& a, const Frame& at_a, const MeshTriangle<Scalar>& b, const Frame& at_b,
                Scalar reach) {
  return distance_of(a, at_a, b, at_b, reach);
}

}  // namespace tessera::native
