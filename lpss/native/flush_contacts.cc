#include "lpss/native/flush_contacts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <ranges>

namespace tessera::native {
namespace {

using collision::Manifold;
using Kind = Part::Kind;

// What stands out by less than this share of the distance at which contacts are found is flush: 0.1 mm, and
// less for bodies that are thinner than 0.1 m. Edges of real tiles are less even, and numbers more so.
constexpr Scalar kFlushShare = Scalar(1) / 200;
// How far above the bearing plane the side is looked for, times that.
constexpr Scalar kLift = 3;
// Points that are closer to each other than this share of the body's diagonal are one.
constexpr Scalar kOnePoint = Scalar(1e-3);
// Points of one plane that are looked at together.
constexpr std::size_t kPlanePointsMax = 64;
// Normals whose angle has a smaller sine are the same.
constexpr Scalar kLean = Scalar(1e-3);
// A ball this much larger than a body is a plane to it, and numbers are too coarse to say where it is.
constexpr Scalar kPlanet = 1024;

bool is_within(const collision::Polyhedron<Scalar>& polyhedron, const Vector& at, Scalar tolerance) {
  return std::ranges::all_of(polyhedron.planes, [&](const collision::HalfSpace<Scalar>& plane) {
    return plane.normal.dot(at) - plane.offset <= tolerance;
  });
}

// Whether a convex part or a plane, grown by `tolerance`, holds a point of its frame.
bool is_within(const Part& part, const Vector& at, Scalar tolerance) {
  switch (part.kind) {
    case Kind::kBall:
      return at.norm() <= part.ball.radius + tolerance;
    case Kind::kCapsule: {
      const Scalar half = part.capsule.half_length;
      const Vector on_core(0, 0, std::clamp(at.z(), -half, half));
      return (at - on_core).norm() <= part.capsule.radius + tolerance;
    }
    case Kind::kBox:
      return (at.cwiseAbs() - part.cuboid.half).maxCoeff() <= tolerance;
    case Kind::kPlane:
      return part.normal.dot(at) <= tolerance;
    default:
      break;
  }
  if (part.polyhedron) return is_within(*part.polyhedron, at, tolerance);
  const Vector& half = part.bounds.high;
  if (is_cylinder(part)) {
    return std::abs(at.z()) <= half.z() + tolerance && at.head<2>().norm() <= half.x() + tolerance;
  }
  if (part.convex->getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE) return true;  // whose faces are not known
  return at.cwiseQuotient(half + Vector::Constant(tolerance)).squaredNorm() <= 1;
}

// Whether a ball, capsule or cylinder is lowest along `down` where a point is, both in its frame. Where a
// wheel is deep in two surfaces, GJK finds the edge of the second one inside of it as low as the wheel
// itself.
bool is_lowest(const Part& part, const Vector& at, const Vector& down) {
  constexpr Scalar kLowest = 1 - Scalar(5e-6);  // of the radius: within 3 mrad
  Vector from_core = at;
  Scalar most = 0;
  if (part.kind == Kind::kCapsule) {
    from_core.z() -= std::clamp(at.z(), -part.capsule.half_length, part.capsule.half_length);
    most = part.capsule.radius;
  } else if (is_cylinder(part)) {
    // A face that is lowest is lowest everywhere.
    if (std::abs(down.z()) > Scalar(std::numbers::sqrt2 / 2)) return true;
    from_core.z() = 0;
    most = part.bounds.high.x() * down.head<2>().norm();
  } else {
    return true;
  }
  return from_core.dot(down) >= kLowest * most;
}

// The point of a convex part, or one close to it, where another one is said to touch it: GJK rounds edges.
Vector brought_within(const Part& part, const Vector& at) {
  if (part.kind == Kind::kBox) return at.cwiseMax(-part.cuboid.half).cwiseMin(part.cuboid.half);
  Vector within = at;
  if (part.polyhedron) {
    for (const collision::HalfSpace<Scalar>& plane : part.polyhedron->planes)
      within -= plane.normal * std::max(Scalar(0), plane.normal.dot(within) - plane.offset);
  } else if (is_cylinder(part)) {
    const Vector& half = part.bounds.high;
    within.head<2>() *= std::min(Scalar(1), half.x() / std::max(at.head<2>().norm(), half.x()));
    within.z() = std::clamp(at.z(), -half.z(), half.z());
  }
  return within;
}

// Whether a point is on a surface, or less than `depth` below it, as seen from `eye`. In its frame.
bool is_within(const Terrain& terrain, const Vector& at, const Vector& eye, Scalar tolerance, Scalar depth) {
  Terrain::List triangles;
  terrain.near(Bounds{at, at}.grown(depth), triangles);
  return std::ranges::any_of(triangles, [&](const Terrain::Found& found) {
    const MeshTriangle<Scalar>& triangle = found.triangle;
    const bool is_seen_from_behind = triangle.kept_on == collision::KeptOn::kSideOfCentre &&
                                     triangle.normal.dot(eye - triangle.vertex[0]) < 0;
    const Scalar height = triangle.normal.dot(at - triangle.vertex[0]) * (is_seen_from_behind ? -1 : 1);
    if (height > tolerance || height < -depth) return false;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector along = triangle.vertex[(k + 1) % 3] - triangle.vertex[k];
      const Vector out = along.cross(triangle.normal);
      if (out.dot(at - triangle.vertex[k]) > tolerance * along.norm()) return false;
    }
    return true;
  });
}

}  // namespace

Scalar FlushContacts::Touch::height(const Vector& at) const {
  int nearest = 0;
  Scalar least = std::numeric_limits<Scalar>::max();
  for (int n = 0; n < count; ++n) {
    const Scalar distance = (on_body[n] - at).squaredNorm();
    if (distance >= least) continue;
    least = distance;
    nearest = n;
  }
  return normal.dot(at) - level[nearest];
}

void FlushContacts::join(std::span<const FixedContact> contacts) {
  touches_.clear();
  for (const FixedContact& contact : contacts) look_at(contact);
  find_sides(0);
  find_planes();
  remove();
}

void FlushContacts::join(std::span<const FixedContact> contacts, std::span<const FixedMeeting> meetings,
                         Scalar dt) {
  touches_.clear();
  for (const FixedContact& contact : contacts) look_at(contact);
  const std::size_t first = touches_.size();
  for (const FixedMeeting& meeting : meetings) {
    const Frame at{meeting.at.rotation, meeting.at.position - meeting.body->pose.position};
    look_at(*meeting.body, *meeting.fixed, *meeting.seen, at);
  }
  find_sides(first);
  find_borne(first);
  for (Touch& touch : touches_) touch.is_side = false;
  for (const auto& [side, bearing] : sides_) {
    if (!touches_[side].is_side && !comes_down(touches_[bearing], dt)) touches_[side].is_side = true;
  }
  remove();
}

void FlushContacts::look_at(const FixedContact& contact) {
  look_at(*contact.body, *contact.fixed, *contact.contact, {contact.body->pose.rotation, Vector::Zero()});
}

void FlushContacts::look_at(const Body& body, const Body& fixed, Contact& contact, const Frame& at) {
  const bool is_a = body.id < fixed.id;
  const Vector offset = fixed.pose.position - body.pose.position;
  for (std::size_t n = 0; n < contact.patches.size(); ++n) {
    const ContactPatch& patch = contact.patches[n];
    const auto first = static_cast<std::uint32_t>(patch.parts >> 32);
    const auto second = static_cast<std::uint32_t>(patch.parts);
    Touch& touch = touches_.emplace_back();
    touch.body = &body;
    touch.fixed = &fixed;
    touch.contact = &contact;
    touch.body_at = at;
    touch.patch = n;
    touch.part = &fixed.solid->parts()[is_a ? second : first];
    touch.part_of_body = &body.solid->parts()[is_a ? first : second];
    touch.normal = is_a ? patch.normal : Vector(-patch.normal);
    touch.tolerance = body.solid->margin() * kFlushShare + fixed.rounding;
    touch.least_gap = std::numeric_limits<Scalar>::max();
    touch.count = patch.count;
    touch.is_side = false;
    touch.plane = touches_.size() - 1;
    const Part& of_body = *touch.part_of_body;
    const Vector down = of_body.frame.rotation.transpose() * (at.rotation.transpose() * -touch.normal);
    for (int k = 0; k < patch.count; ++k) {
      const ContactPoint& point = patch.point[k];
      const Vector& point_of_body = is_a ? point.on_a : point.on_b;
      touch.on_body[k] = at * point_of_body;
      touch.on_fixed[k] = fixed.pose.rotation * (is_a ? point.on_b : point.on_a) + offset;
      // By the point of the body, which is exact also where the fixed one is as large as a planet.
      touch.level[k] = touch.normal.dot(touch.on_body[k]) - point.gap;
      touch.gap[k] = point.gap;
      touch.is_kept[k] = true;
      touch.is_lowest[k] = is_lowest(of_body, of_body.frame.inverse(point_of_body), down);
      touch.least_gap = std::min(touch.least_gap, point.gap);
    }
  }
}

// Of the touches from `first` on.
void FlushContacts::find_sides(std::size_t first) {
  sides_.clear();
  for (std::size_t side = first; side < touches_.size(); ++side) {
    for (std::size_t bearing = 0; bearing < touches_.size(); ++bearing) {
      if (side == bearing || !is_flush_side(touches_[side], touches_[bearing])) continue;
      touches_[side].is_side = true;
      sides_.emplace_back(side, bearing);
    }
  }
  // What is itself a side bears nothing.
  std::erase_if(sides_, [&](const auto& pair) { return touches_[pair.second].is_side; });
  for (Touch& touch : touches_) touch.is_side = false;
  for (const auto& [side, bearing] : sides_) touches_[side].is_side = true;
}

// Of the touches from `first` on, those in the planes of touches before: these bear the body there, too.
void FlushContacts::find_borne(std::size_t first) {
  for (std::size_t n = first; n < touches_.size(); ++n) {
    Touch& touch = touches_[n];
    for (std::size_t bearing = 0; bearing < first && !touch.is_side; ++bearing) {
      if (!is_in_plane(touch, touches_[bearing])) continue;
      touch.is_side = true;
      sides_.emplace_back(n, bearing);
    }
  }
}

// Whether the body gets below the plane within the tick, by its velocities, farther than it sinks where the
// plane bears it. Round ones turn on the spot.
bool FlushContacts::comes_down(const Touch& bearing, Scalar dt) {
  constexpr int kLooks = 4;
  constexpr Scalar kDeepest = Scalar(0.5);  // of the distance at which contacts are found
  const Body& body = *bearing.body;
  const Vector& up = bearing.normal;
  Scalar sinks = 0;  // m
  for (int n = 0; n < bearing.count; ++n) {
    const Vector arm = bearing.on_body[n] - bearing.body_at.position;
    sinks = std::max(sinks, -up.dot(body.linear + body.angular.cross(arm)) * dt);
  }
  const Scalar level = bearing.level[0] + std::min(Scalar(0), bearing.least_gap) - sinks;
  const Scalar deepest = kDeepest * body.solid->margin();
  for (int n = 1; n <= kLooks; ++n) {
    const Scalar time = dt * Scalar(n) / kLooks;
    const Frame at{turned(body.pose.rotation, body.angular * time), body.linear * time};
    for (const Part& part : body.solid->parts()) {
      if (!part.convex) continue;
      const Vector down = part.frame.rotation.transpose() * (at.rotation.transpose() * -up);
      if (up.dot(at * (part.frame * farthest(part, down))) < level - deepest) return true;
    }
  }
  return false;
}

// Whether the body is above the plane of the bearing touch, and the other surface nowhere stands out from it
// where it touches the body.
bool FlushContacts::is_flush_side(const Touch& side, const Touch& bearing) {
  if ((side.normal - bearing.normal).squaredNorm() < kLean * kLean) return false;
  // Along the side, out of the plane: as steep as its square.
  const Vector& up = bearing.normal;
  const Vector along = up - side.normal * up.dot(side.normal);
  const Scalar rise = along.squaredNorm();
  if (!(rise > kLean * kLean)) return false;
  const Body& body = *side.body;
  const Body& fixed = *side.fixed;
  // What the body is deep in bears less than what it just touches.
  if (bearing.least_gap < std::min(side.least_gap, -body.solid->margin())) return false;
  if (side.part->kind == Kind::kBall && side.part->ball.radius > kPlanet * body.solid->radius()) return false;
  const Scalar tolerance = side.tolerance + bearing.fixed->rounding;
  const Part& of_body = *side.part_of_body;
  const Frame from_body{
      of_body.is_placed ? Matrix(side.body_at.rotation * of_body.frame.rotation) : side.body_at.rotation,
      side.body_at * of_body.frame.position};
  // What it sinks by its course, what bears it does not let it sink.
  const Scalar lowest =
      std::min(Scalar(0), bearing.least_gap) + std::min(Scalar(0), up.dot(side.body_at.position));
  const Frame part_at = side.part->is_placed ? fixed.pose * side.part->frame : fixed.pose;
  const Frame from_part{part_at.rotation, part_at.position - body.pose.position};
  for (int n = 0; n < side.count; ++n) {
    const Vector at = from_part * brought_within(*side.part, from_part.inverse(side.on_fixed[n]));
    const Scalar height = bearing.height(at);
    if (height > tolerance) return false;
    const Vector on_body = from_body * brought_within(of_body, from_body.inverse(side.on_body[n]));
    if (bearing.height(on_body) < lowest - tolerance) return false;
    const Vector above = at + along * ((kLift * tolerance - height) / rise);
    if (side.part->terrain) {
      const Scalar depth = (above - at).norm() + tolerance;
      if (is_within(*side.part->terrain, from_part.inverse(above), from_part.inverse(Vector::Zero()),
                    tolerance, depth))
        return false;
    } else if (is_within(*side.part, from_part.inverse(above - side.normal * tolerance), tolerance)) {
      return false;
    }
  }
  return true;
}

void FlushContacts::find_planes() {
  for (std::size_t n = 1; n < touches_.size(); ++n) {
    if (touches_[n].is_side) continue;
    for (std::size_t k = 0; k < n; ++k) {
      if (touches_[k].is_side || touches_[n].part_of_body != touches_[k].part_of_body ||
          !is_in_plane(touches_[n], touches_[k]))
        continue;
      touches_[n].plane = touches_[k].plane;
      break;
    }
  }
  for (std::size_t n = 0; n < touches_.size(); ++n) {
    if (touches_[n].plane == n && !touches_[n].is_side) share_points(n);
  }
}

bool FlushContacts::is_in_plane(const Touch& touch, const Touch& bearing) {
  if (!((touch.normal - bearing.normal).squaredNorm() < kLean * kLean)) return false;
  const Scalar tolerance = touch.tolerance + bearing.fixed->rounding;
  return std::all_of(touch.on_fixed, touch.on_fixed + touch.count,
                     [&](const Vector& at) { return std::abs(bearing.height(at)) <= tolerance; });
}

// Keeps of the points in one plane those that one patch would have.
void FlushContacts::share_points(std::size_t plane) {
  const auto is_in = [&](const Touch& touch) { return touch.plane == plane && !touch.is_side; };
  if (std::ranges::count_if(touches_, is_in) < 2) return;
  const Bounds& bounds = touches_[plane].body->solid->bounds();
  const Scalar apart = (bounds.high - bounds.low).norm() * kOnePoint;
  Points points;
  Manifold<Scalar> shared;
  shared.normal = touches_[plane].normal;
  const auto reduce = [&] {
    shared.count = 0;
    collision::reduce(std::span<const collision::ContactPoint<Scalar>>(points), shared);
    points.assign(shared.point, shared.point + shared.count);
  };
  const bool has_lowest = std::ranges::any_of(touches_, [&](const Touch& touch) {
    return is_in(touch) && std::any_of(touch.is_lowest, touch.is_lowest + touch.count, std::identity());
  });
  for (std::size_t n = plane; n < touches_.size(); ++n) {
    Touch& touch = touches_[n];
    if (!is_in(touch)) continue;
    if (points.size() + kPatchPointsMax > kPlanePointsMax) reduce();
    for (int k = 0; k < touch.count; ++k) {
      touch.is_kept[k] = false;
      if (has_lowest && !touch.is_lowest[k]) continue;
      const bool is_known = std::ranges::any_of(points, [&](const auto& known) {
        return (known.on_b - touch.on_fixed[k]).squaredNorm() < apart * apart;
      });
      if (is_known) continue;
      const auto feature = static_cast<std::uint32_t>(n * kPatchPointsMax) + static_cast<std::uint32_t>(k);
      points.push_back({touch.on_body[k], touch.on_fixed[k], touch.gap[k], feature});
    }
  }
  reduce();
  for (const collision::ContactPoint<Scalar>& point : points)
    touches_[point.feature / kPatchPointsMax].is_kept[point.feature % kPatchPointsMax] = true;
}

// A contact of which something is removed is looked for again in the next tick: as the body moves on, a side
// becomes a top.
void FlushContacts::remove() {
  // From the last patch of each contact to the first one.
  for (const Touch& touch : touches_ | std::views::reverse) {
    Contact& contact = *touch.contact;
    ContactPatch& patch = contact.patches[touch.patch];
    if (touch.is_side) patch.count = 0;
    std::uint8_t kept = 0;
    for (std::uint8_t n = 0; n < patch.count; ++n) {
      if (touch.is_kept[n]) patch.point[kept++] = patch.point[n];
    }
    if (kept == touch.count) continue;
    patch.count = kept;
    if (kept == 0) contact.patches.erase(contact.patches.begin() + static_cast<std::ptrdiff_t>(touch.patch));
    contact.is_found = false;
    contact.found_at = {};
  }
}

}  // namespace tessera::native
