// Boxes and sweeps.

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>

#include "lpss/bullet/nearest_hits.h"
#include "lpss/native/combine.h"
#include "lpss/native/native_world.h"

namespace tessera::native {
namespace {

// A body as Bullet's queries want it.
class Target {
 public:
  Target(const Body& body, const Frame& at) {
    object_.setCollisionShape(body.solid->bullet());
    object_.setWorldTransform(bt(at));
  }
  btCollisionObject& object() { return object_; }

  // Calls `act` with the whole shape of the body, where it is, and nullptr; or, with `by_parts`, with those
  // of the parts for which `is_wanted`, and the part.
  template <typename IsWanted, typename Act>
  void for_each_shape(bool by_parts, const Body& body, const IsWanted& is_wanted, const Act& act) const {
    const btCollisionShape& root = *object_.getCollisionShape();
    const btTransform& place = object_.getWorldTransform();
    const auto* const compound = root.isCompound() ? static_cast<const btCompoundShape*>(&root) : nullptr;
    if (!by_parts) return act(root, place, nullptr);
    for (std::size_t n = 0; n < body.solid->parts().size(); ++n) {
      const Part& part = body.solid->parts()[n];
      if (!is_wanted(part)) continue;
      if (!compound) return act(root, place, &part);
      const int child = static_cast<int>(n);
      act(*compound->getChildShape(child), place * compound->getChildTransform(child), &part);
    }
  }

 private:
  btCollisionObject object_;
};

Bounds bounds_of(const Eigen::AlignedBox3d& bounds) {
  return {Eigen::Vector3d(bounds.min()).cast<Scalar>(), Eigen::Vector3d(bounds.max()).cast<Scalar>()};
}

// Those of the bodies found that are wanted, in the order of ids.
template <typename IsWanted>
std::vector<BodySlot> sorted(std::vector<BodySlot> found, const NativeWorld& world,
                             const IsWanted& is_wanted) {
  std::erase_if(found, [&](BodySlot slot) { return !is_wanted(world.body(slot)); });
  std::sort(found.begin(), found.end(),
            [&](BodySlot a, BodySlot b) { return world.body(a).id < world.body(b).id; });
  return found;
}

}  // namespace

namespace {

// A ball on its way, in the frame of a surface.
struct FlyingBall {
  Vector from;
  Vector way;
  Scalar radius;
};

// Where, as a share of its way, a ball meets the face of a triangle: none if it does not, or meets an edge.
// `normal` on the side that it comes from.
std::optional<Scalar> meets_face(const FlyingBall& ball, const MeshTriangle<Scalar>& triangle,
                                 Vector& normal) {
  const Scalar height = triangle.normal.dot(ball.from - triangle.vertex[0]);
  normal = height < 0 ? Vector(-triangle.normal) : triangle.normal;
  const Scalar fall = -normal.dot(ball.way);
  if (!(fall > 0) || std::abs(height) - fall > ball.radius) return std::nullopt;
  const Scalar fraction = std::max(Scalar(0), (std::abs(height) - ball.radius) / fall);
  const Vector at = ball.from + ball.way * fraction;
  for (int k = 0; k < 3; ++k) {
    const Vector along = triangle.vertex[(k + 1) % 3] - triangle.vertex[k];
    if (along.cross(triangle.normal).dot(at - triangle.vertex[k]) > 0) return std::nullopt;
  }
  return fraction;
}

}  // namespace

// Replaces `hit` where a ball meets a face of a surface before. Bullet's cast misses large triangles with
// small balls in float.
void NativeWorld::meet_faces(const Part& part, const Frame& at, const SweptBall& ball, SweepHit hit_at_end,
                             std::optional<SweepHit>& hit) {
  const FlyingBall flying{at.inverse(ball.centre), at.rotation.transpose() * hit_at_end.way, ball.radius};
  const Vector end = flying.from + flying.way;
  Terrain::List triangles;
  part.terrain->near(Bounds{flying.from.cwiseMin(end), flying.from.cwiseMax(end)}.grown(ball.radius),
                     triangles);
  for (const Terrain::Found& found : triangles) {
    Vector normal;
    const std::optional<Scalar> fraction = meets_face(flying, found.triangle, normal);
    if (!fraction || (hit && *fraction >= hit->fraction)) continue;
    hit = hit_at_end;
    hit->fraction = *fraction;
    hit->normal = at.rotation * normal;
  }
}

// Two that move are swept in the frame of the other one.
Vector NativeWorld::way_in_tick(const Body& body) const {
  if (!body.is_awake() || body.motion == Motion::kStatic) return Vector::Zero();
  if (body.is_dynamic()) return body.next.position - body.start;
  return body.linear * Scalar(settings_.time_step);
}

std::optional<NativeWorld::SweepHit> NativeWorld::sweep(BodySlot slot, bool without_clones) const {
  const Body& swept = body(slot);
  const Vector way = swept.next.position - swept.start;
  const Bounds bounds =
      Bounds{swept.start.cwiseMin(swept.next.position), swept.start.cwiseMax(swept.next.position)}.grown(
          swept.solid->radius());
  std::vector<BodySlot> near;
  broad_phase_.for_each_in(bounds, [&](BodySlot other) {
    if (other != slot && bounds.overlaps(body(other).bounds)) near.push_back(other);
  });
  const std::vector<BodySlot> candidates = sorted(std::move(near), *this, [&](const Body& other) {
    return is_wanted(swept, other) && !(without_clones && other.role == Role::kClone);
  });
  std::optional<SweepHit> hit;
  for (const BodySlot other : candidates) {
    sweep(swept, way - way_in_tick(body(other)), other, hit);
  }
  if (!hit || !(hit->fraction < 1)) return std::nullopt;
  return hit;
}

namespace {

// Where, as shares of its way, a ball can meet what is in a box: from `first` to `last`.
struct Stretch {
  double first = 0;
  double last = 1;
};

// None if it cannot. In double precision: of a long way, a float's last digit is longer than a bullet.
std::optional<Stretch> stretch_along(const Vector& from, const Vector& way, const Bounds& bounds,
                                     Scalar radius) {
  Stretch stretch;
  for (int k = 0; k < 3; ++k) {
    const double low = double(bounds.low[k]) - double(radius) - double(from[k]);
    const double high = double(bounds.high[k]) + double(radius) - double(from[k]);
    const double step = double(way[k]);
    if (step == 0) {
      if (low > 0 || high < 0) return std::nullopt;
      continue;
    }
    stretch.first = std::max(stretch.first, (step > 0 ? low : high) / step);
    stretch.last = std::min(stretch.last, (step > 0 ? high : low) / step);
  }
  if (stretch.first >= stretch.last) return std::nullopt;
  return stretch;
}

}  // namespace

// Replaces `hit` where the body, on this way, meets the other one before. Bullet casts over no more of the
// way than is near the other, and around the other's place: over a long one, in float, it misses, or finds a
// normal that throws the body aside.
void NativeWorld::sweep(const Body& swept, const Vector& way, BodySlot other,
                        std::optional<SweepHit>& hit) const {
  const Body& at = body(other);
  const bool is_filtered = swept.solid->has_materials() || at.solid->has_materials();
  // From a ball that touches the other, a cast finds no good normal; and Bullet takes a millimetre for a
  // touch.
  constexpr Scalar kRunUp = 4;                // of the radius
  constexpr Scalar kRunUpMin = Scalar(0.05);  // m
  const Vector origin = at.is_dynamic() ? at.start : at.pose.position;
  Target target(at, {at.pose.rotation, Vector::Zero()});
  btVector3 low, high;
  target.object().getCollisionShape()->getAabb(target.object().getWorldTransform(), low, high);
  const Bounds bounds{vector(low), vector(high)};
  for (const SweptBall& from : swept.solid->swept_balls()) {
    const Vector arm = swept.pose.rotation * from.centre;
    const Vector start = swept.start - origin + arm;
    const std::optional<Stretch> near =
        stretch_along(start, way, bounds, std::max(from.radius * kRunUp, kRunUpMin));
    if (!near || (hit && near->first >= double(hit->fraction))) continue;
    const double length = near->last - near->first;
    bullet::NearestHit nearest(bt(way));
    if (hit) nearest.m_closestHitFraction = btScalar((double(hit->fraction) - near->first) / length);
    const auto at_share = [&](double share) {
      // The ball does not rotate: the cast is then a pure translation.
      const Eigen::Vector3d place = start.cast<double>() + way.cast<double>() * share;
      return btTransform(btMatrix3x3::getIdentity(), bt(Vector(place.cast<Scalar>())));
    };
    const btSphereShape ball(from.radius);
    const Part* met = nullptr;
    const auto cast = [&](const btCollisionShape& shape, const btTransform& place, const Part* part) {
      const btScalar before = nearest.m_closestHitFraction;
      btCollisionWorld::objectQuerySingle(&ball, at_share(near->first), at_share(near->last),
                                          &target.object(), &shape, place, nearest, /*allowedPenetration=*/0);
      if (nearest.m_closestHitFraction < before) met = part;
    };
    const auto may_meet = [&](const Part& part) {
      return !is_filtered || may_touch(swept, swept.solid->parts()[from.part], at, part);
    };
    target.for_each_shape(is_filtered, at, may_meet, cast);
    if (nearest.object) {
      const double share = near->first + double(nearest.m_closestHitFraction) * length;
      hit = SweepHit{other, Scalar(share), way, arm, vector(nearest.normal), from.part, met};
    }
    for (const Part& part : at.solid->parts()) {
      if (!part.terrain || !may_meet(part)) continue;
      const Frame surface = part.is_placed ? at.pose * part.frame : at.pose;
      meet_faces(part, surface, {swept.start + arm, from.radius},
                 {other, 1, way, arm, Vector::Zero(), from.part, is_filtered ? &part : nullptr}, hit);
    }
  }
}

// A predicted contact: the solver lets two bodies approach as far as the hit, and no farther, in this step.
void NativeWorld::predict_contacts(std::span<BodySlot> fast, const ParallelFor& parallel) {
  if (fast.empty()) return;
  std::sort(fast.begin(), fast.end(), [&](BodySlot a, BodySlot b) { return body(a).id < body(b).id; });
  std::vector<std::optional<SweepHit>> hits(fast.size());
  run_parallel(parallel, fast.size(),
               [&](std::size_t n) { hits[n] = sweep(fast[n], /*without_clones=*/false); });
  for (std::size_t n = 0; n < fast.size(); ++n) {
    if (hits[n]) predict_contact(fast[n], *hits[n]);
  }
}

void NativeWorld::predict_contact(BodySlot slot, const SweepHit& hit) {
  const Body& swept = body(slot);
  const Body& other = body(hit.other);
  const bool is_a = swept.id < other.id;
  Candidate& candidate = is_a ? candidate_of(slot, hit.other) : candidate_of(hit.other, slot);
  if (candidate.contact == Candidate::kNone) {
    candidate.contact = keep_contact(is_a ? blank_contact(swept, other) : blank_contact(other, swept));
  }
  Contact& contact = contacts_[static_cast<std::size_t>(candidate.contact)];
  // Two fast bodies that hit each other are both swept.
  if (!contact.patches.empty() && contact.patches.back().is_predicted) return;
  ContactPatch& patch = contact.patches.emplace_back();
  patch.is_predicted = true;
  patch.parts = ~std::uint64_t{0};
  patch.normal = is_a ? hit.normal : Vector(-hit.normal);
  patch.count = 1;
  ContactPoint& point = patch.point[0];
  const Vector to_hit = hit.way * hit.fraction;
  const Vector on_swept = swept.pose.rotation.transpose() * hit.arm;
  const Vector on_other = other.pose.inverse(swept.start + hit.arm + to_hit);
  point.on_a = is_a ? on_swept : on_other;
  point.on_b = is_a ? on_other : on_swept;
  point.gap = -to_hit.dot(hit.normal);
  if (!hit.met) return;
  const Part* const own = &swept.solid->parts()[hit.part];
  add_predicted_material(is_a ? combined(swept, own, other, hit.met) : combined(other, hit.met, swept, own),
                         contact);
}

void NativeWorld::refresh_bounds(const ParallelFor& parallel) const {
  if (!bounds_are_old_) return;
  const Pieces pieces = pieces_of_bodies();
  run_parallel(parallel, pieces.count(), [&](std::size_t n) {
    BodiesPiece& piece = bodies_pieces_[n];
    piece.left.clear();
    piece.homes = {};
    for (std::size_t place = pieces.begin(n); place < pieces.end(n); ++place) {
      Body& body = bodies_[place];
      if (!body.leaf) continue;
      if (body.is_awake() && set_bounds(body) && !body.enlarged.contains(body.bounds))
        piece.left.push_back(static_cast<BodySlot>(place));
      note_home(body, piece.homes);
    }
  });
  homes_ = {};
  for (const BodiesPiece& piece : std::span(bodies_pieces_).first(pieces.count())) {
    homes_.bounds.extend(piece.homes.bounds);
    homes_.way = std::max(homes_.way, piece.homes.way);
    for (const BodySlot slot : piece.left)
      broad_phase_.update(bodies_[static_cast<std::size_t>(slot)], slot, Scalar(settings_.time_step));
  }
  bounds_are_old_ = false;
}

// What the box of a body that is awake sweeps in a tick, with its turn if that is foreseen.
Bounds NativeWorld::bounds_on_way(const Body& body, bool turns) const {
  const auto dt = Scalar(settings_.time_step);
  if (turns) return swept(body, body.bounds, dt);
  Bounds bounds = body.bounds;
  bounds.extend(bounds.moved(body.linear * dt));
  return bounds;
}

void NativeWorld::note_home(const Body& body, Homes& homes) const {
  if (!body.lives_here()) return;
  if (!body.is_awake()) return homes.bounds.extend(body.bounds);
  const auto dt = Scalar(settings_.time_step);
  const bool turns = is_foreseen(body, dt);
  homes.bounds.extend(bounds_on_way(body, turns));
  const Scalar way = body.linear.norm() * dt;
  homes.way = std::max(homes.way, turns ? way + bend(body, dt) : way);
}

// m, how far a point of the body gets beside what its velocity says: by its turn, which also turns the
// velocity of what joints hold, and by its surge. Bounded: what is fast and spins must not be looked for in
// all sectors around its way.
Scalar NativeWorld::bend(const Body& body, Scalar dt) const {
  const Scalar turn = std::min(body.angular.norm() * dt, Scalar(2));
  const Scalar aside = body.jointed ? std::min(turn * body.linear.norm() * dt, Scalar(kSurgeMax)) : Scalar(0);
  return turn * body.solid->radius() + aside + body.surge;
}

Bounds NativeWorld::swept(const Body& body, const Bounds& bounds, Scalar dt) const {
  Bounds swept = bounds;
  swept.extend(bounds.moved(body.linear * dt).grown(bend(body, dt)));
  return swept;
}

Eigen::AlignedBox3d NativeWorld::swept_box(BodySlot slot, double dt) const {
  const Body& b = body(slot);
  Bounds bounds = b.bounds_at(b.pose);
  if (b.motion != Motion::kStatic) bounds = swept(b, bounds, Scalar(dt));
  return {bounds.low.cast<double>(), bounds.high.cast<double>()};
}

void NativeWorld::append_outside(const Eigen::AlignedBox3d& inside, double dt,
                                 std::vector<BodyOutside>& outside, const ParallelFor& parallel) const {
  refresh_bounds(parallel);
  const Pieces pieces = pieces_of_bodies();
  run_parallel(parallel, pieces.count(), [&](std::size_t n) {
    std::vector<BodyOutside>& found = bodies_pieces_[n].outside;
    found.clear();
    for (std::size_t place = pieces.begin(n); place < pieces.end(n); ++place) {
      const Body& body = bodies_[place];
      if (!body.leaf || !body.lives_here() || !body.is_awake()) continue;
      const Bounds way = swept(body, body.bounds, Scalar(dt));
      const Eigen::AlignedBox3d bounds(way.low.cast<double>(), way.high.cast<double>());
      if (!inside.contains(bounds)) found.push_back({static_cast<BodySlot>(place), bounds});
    }
  });
  for (const BodiesPiece& piece : std::span(bodies_pieces_).first(pieces.count()))
    outside.insert(outside.end(), piece.outside.begin(), piece.outside.end());
}

bool NativeWorld::reaches_home_body(const Eigen::AlignedBox3d& bounds, BodySlot& hint) const {
  refresh_bounds();
  const Bounds wanted = bounds_of(bounds);
  if (!sensors_.empty() && reaches_sensor_of_home(wanted)) return true;
  if (!wanted.overlaps(homes_.bounds)) return false;
  const auto is_reached = [&](BodySlot slot) {
    const Body& other = body(slot);
    if (!other.lives_here() || !other.is_awake()) return other.lives_here() && wanted.overlaps(other.bounds);
    return wanted.overlaps(bounds_on_way(other, is_foreseen(other, Scalar(settings_.time_step))));
  };
  if (hint != kNoSlot && is_there(hint) && is_reached(hint)) return true;
  hint = kNoSlot;
  broad_phase_.for_each_in(wanted.grown(homes_.way), [&](BodySlot slot) {
    if (hint == kNoSlot && is_reached(slot)) hint = slot;
  });
  return hint != kNoSlot;
}

std::vector<NearBody> NativeWorld::near(const Geometry& geometry, const Pose& pose, double reach,
                                        const QueryFilter& filter) const {
  refresh_bounds();
  const Frame at = frame(pose);
  // A query asks all worlds around, most of which have nothing there: for these, no hull is made. Twice the
  // radius is more than the bounds of the probe, with their margins.
  const Bounds centre{at.position, at.position};
  bool has_any = false;
  broad_phase_.for_each_in(centre.grown(Scalar(2 * bounding_radius(geometry) + reach)), [&](BodySlot slot) {
    const Body& other = body(slot);
    has_any |= other.role != Role::kClone && filter.wants(other.id, other.category);
  });
  if (!has_any) return {};
  const Solid probe(Shape{{ShapePart{geometry, {}}}}, Pose{}, /*is_static=*/false);
  const Bounds around = probe.bounds_at(at).grown(Scalar(reach));
  std::vector<BodySlot> candidates;
  broad_phase_.for_each_in(around, [&](BodySlot slot) { candidates.push_back(slot); });
  std::vector<NearBody> found;
  for (const BodySlot slot : sorted(std::move(candidates), *this, [&](const Body& other) {
         return other.role != Role::kClone && filter.wants(other.id, other.category);
       })) {
    const Body& other = body(slot);
    const Scalar distance = NarrowPhase::distance(probe, at, *other.solid, other.pose, Scalar(reach));
    if (distance <= Scalar(reach)) found.push_back({other.id, std::max<double>(0, distance)});
  }
  return found;
}

}  // namespace tessera::native
