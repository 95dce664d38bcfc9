// Boxes, sweeps and rays.

#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <LinearMath/btAabbUtil2.h>
#include <LinearMath/btTransformUtil.h>

#include <algorithm>
#include <utility>

#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/conversions.h"
#include "lpss/bullet/free_motion.h"
#include "lpss/bullet/nearest_hits.h"

namespace tessera::bullet {
namespace {

// The bodies whose boxes may overlap a box or lie on a ray, and that `is_wanted`, by id.
template <typename Base, typename IsWanted>
struct Collector final : Base {
  explicit Collector(const IsWanted& wanted) : is_wanted(wanted) {}
  bool process(const btBroadphaseProxy* proxy) override {
    Body& body = Body::of(static_cast<const btCollisionObject*>(proxy->m_clientObject));
    if (is_wanted(body, *proxy)) found.push_back(&body);
    return true;
  }
  const std::vector<Body*>& sorted() {
    std::sort(found.begin(), found.end(), [](const Body* a, const Body* b) { return a->id < b->id; });
    return found;
  }
  const IsWanted& is_wanted;
  std::vector<Body*> found;
};

// The smallest distance of the points that a pair of objects is given.
struct SmallestDistance final : btCollisionWorld::ContactResultCallback {
  explicit SmallestDistance(btScalar reach) { m_closestDistanceThreshold = reach; }
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    distance = std::min(distance, point.getDistance());
    return 0;
  }
  btScalar distance = BT_LARGE_FLOAT;
};

// The deepest point of two that overlap.
struct DeepestPoint final : btCollisionWorld::ContactResultCallback {
  static constexpr btScalar kDeep = btScalar(1e-4);  // m: less is a touch
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* first, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    if (point.getDistance() >= distance) return 0;
    distance = point.getDistance();
    normal = point.m_normalWorldOnB;
    probe_is_first = first->getCollisionObject()->getInternalType() == btCollisionObject::CO_COLLISION_OBJECT;
    return 0;
  }
  bool is_deep() const { return distance < -kDeep; }
  btScalar distance = 0;
  btVector3 normal{0, 0, 1};
  bool probe_is_first = true;
};

// What a probe on its way meets of one body.
struct FirstTouch {
  explicit FirstTouch(const btVector3& way) : cast(way) {}

  // The share of the way, and the normal on the body.
  std::optional<std::pair<btScalar, btVector3>> found() const {
    if (overlap.is_deep())
      return std::pair(btScalar(0), overlap.probe_is_first ? overlap.normal : -overlap.normal);
    if (cast.object == nullptr) return std::nullopt;
    return std::pair(cast.m_closestHitFraction, cast.normal);
  }

  DeepestPoint overlap;
  NearestHit cast;
};

void cast_ray(const btVector3& from, const btVector3& to, Body& other, NearestRayHit& nearest) {
  btCollisionWorld::rayTestSingle(btTransform(btMatrix3x3::getIdentity(), from),
                                  btTransform(btMatrix3x3::getIdentity(), to), &other.rigid,
                                  other.shape->root(), other.rigid.getWorldTransform(), nearest);
}

}  // namespace

Bounds BulletWorld::bounds_of(const Body& boxed) const {
  return space_ ? CollisionSpace::bounds_of(boxed) : lone_bounds_;
}

void BulletWorld::set_bounds(const Body& boxed, const Bounds& bounds) const {
  if (space_) {
    space_->set_bounds(boxed, bounds);
  } else {
    lone_bounds_ = bounds;
  }
}

void BulletWorld::set_bounds_to_pose(const Body& boxed) const {
  const Bounds bounds = bounds_at(boxed, boxed.rigid.getWorldTransform());
  // As in Bullet's own update: a body without a valid box keeps its last one.
  if (boxed.motion == Motion::kStatic || is_sensible(bounds)) set_bounds(boxed, bounds);
}

void BulletWorld::set_bounds_to_poses() const {
  for (const std::unique_ptr<Body>& slot : bodies_) {
    if (slot && slot->is_awake()) set_bounds_to_pose(*slot);
  }
  bounds_are_old_ = false;
}

std::optional<BulletWorld::SweepHit> BulletWorld::sweep(Body& swept, const btTransform& to) const {
  if (!space_) return std::nullopt;
  const btTransform& from = swept.rigid.getWorldTransform();
  const btVector3 radius(swept.swept_radius, swept.swept_radius, swept.swept_radius);
  btVector3 low = from.getOrigin();
  btVector3 high = low;
  low.setMin(to.getOrigin());
  high.setMax(to.getOrigin());
  const auto may_hit = [&](const Body& other, const btBroadphaseProxy&) {
    return &other != &swept && is_wanted(swept, other);
  };
  Collector<btBroadphaseAabbCallback, decltype(may_hit)> candidates(may_hit);
  space_->broadphase().aabbTest(low - radius, high + radius, candidates);
  if (candidates.found.empty()) return std::nullopt;

  const btSphereShape ball(swept.swept_radius);
  // The ball does not rotate: the cast is then a pure translation.
  const btTransform ball_to(from.getBasis(), to.getOrigin());
  NearestHit nearest(to.getOrigin() - from.getOrigin());
  for (Body* other : candidates.sorted()) {
    btCollisionWorld::objectQuerySingle(&ball, from, ball_to, &other->rigid, other->shape->root(),
                                        other->rigid.getWorldTransform(), nearest, /*allowedPenetration=*/0);
  }
  if (!nearest.object || !(nearest.m_closestHitFraction < 1)) return std::nullopt;
  return SweepHit{&Body::of(nearest.object), nearest.m_closestHitFraction, nearest.normal};
}

Eigen::AlignedBox3d BulletWorld::swept_box(BodySlot slot, double dt) const {
  const Body& b = body(slot);
  Bounds bounds = bounds_at(b, b.rigid.getWorldTransform());
  if (b.motion != Motion::kStatic) {
    const Bounds at_end = bounds_at(b, after(b.rigid, btScalar(dt)));
    bounds.low.setMin(at_end.low);
    bounds.high.setMax(at_end.high);
  }
  return {to_eigen(bounds.low), to_eigen(bounds.high)};
}

void BulletWorld::append_outside(const Eigen::AlignedBox3d& inside, double dt,
                                 std::vector<BodyOutside>& outside, const ParallelFor&) const {
  for (const std::unique_ptr<Body>& slot : bodies_) {
    if (!slot || !slot->lives_here() || !slot->is_awake()) continue;
    const Eigen::AlignedBox3d swept = swept_box(slot->slot, dt);
    if (!inside.contains(swept)) outside.push_back({slot->slot, swept});
  }
}

bool BulletWorld::reaches_home_body(const Eigen::AlignedBox3d& bounds, BodySlot& /*hint*/) const {
  if (bounds_are_old_) set_bounds_to_poses();
  const btVector3 low = to_bullet(Eigen::Vector3d(bounds.min()));
  const btVector3 high = to_bullet(Eigen::Vector3d(bounds.max()));
  const auto is_reached = [&](const Body& other) {
    const Bounds its = bounds_of(other);
    return other.lives_here() && TestAabbAgainstAabb2(low, high, its.low, its.high);
  };
  if (!space_) {
    return std::any_of(bodies_.begin(), bodies_.end(),
                       [&](const auto& only) { return only && is_reached(*only); });
  }
  const auto is_wanted = [&](const Body& other, const btBroadphaseProxy&) { return is_reached(other); };
  Collector<btBroadphaseAabbCallback, decltype(is_wanted)> candidates(is_wanted);
  space_->broadphase().aabbTest(low, high, candidates);
  return !candidates.found.empty();
}

std::vector<Body*> BulletWorld::bodies_along(const btVector3& from, const btVector3& to,
                                             const QueryFilter& filter) const {
  if (bounds_are_old_) set_bounds_to_poses();
  const auto is_wanted = [&](const Body& other, const btBroadphaseProxy&) {
    return other.role != Role::kClone && filter.wants(other.id, other.category);
  };
  Collector<btBroadphaseRayCallback, decltype(is_wanted)> candidates(is_wanted);
  const btVector3 ray = to - from;
  const btScalar length = ray.length();
  if (!(length > 0)) return {};
  for (int axis = 0; axis < 3; ++axis) {
    const btScalar slope = ray[axis] / length;
    candidates.m_rayDirectionInverse[axis] = slope == 0 ? btScalar(BT_LARGE_FLOAT) : 1 / slope;
    candidates.m_signs[axis] = candidates.m_rayDirectionInverse[axis] < 0;
  }
  candidates.m_lambda_max = length;
  space().broadphase().rayTest(from, to, candidates);
  return candidates.sorted();
}

std::optional<RayHit> BulletWorld::raycast(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                           const QueryFilter& filter) const {
  const btVector3 start = to_bullet(from);
  const btVector3 end = to_bullet(to);
  NearestRayHit nearest;
  for (Body* other : bodies_along(start, end, filter)) cast_ray(start, end, *other, nearest);
  if (!nearest.hasHit()) return std::nullopt;
  return RayHit{Body::of(nearest.m_collisionObject).id, nearest.m_closestHitFraction,
                to_eigen(nearest.normal).normalized()};
}

std::vector<RayHit> BulletWorld::raycast_all(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                             const QueryFilter& filter) const {
  const btVector3 start = to_bullet(from);
  const btVector3 end = to_bullet(to);
  std::vector<RayHit> hits;
  for (Body* other : bodies_along(start, end, filter)) {
    NearestRayHit nearest;
    cast_ray(start, end, *other, nearest);
    if (!nearest.hasHit()) continue;
    hits.push_back({other->id, nearest.m_closestHitFraction, to_eigen(nearest.normal).normalized()});
  }
  return hits;
}

std::vector<Body*> BulletWorld::bodies_in(const btVector3& low, const btVector3& high,
                                          const QueryFilter& filter) const {
  if (bounds_are_old_) set_bounds_to_poses();
  const auto is_wanted_here = [&](const Body& other, const btBroadphaseProxy&) {
    return other.role != Role::kClone && filter.wants(other.id, other.category);
  };
  Collector<btBroadphaseAabbCallback, decltype(is_wanted_here)> candidates(is_wanted_here);
  space().broadphase().aabbTest(low, high, candidates);
  return candidates.sorted();
}

std::vector<NearBody> BulletWorld::near(const Geometry& geometry, const Pose& pose, double reach,
                                        const QueryFilter& filter) const {
  const CollisionShape shape(Shape{{ShapePart{geometry, {}}}}, Pose{}, /*is_static=*/false);
  btCollisionObject probe;
  probe.setCollisionShape(shape.root());
  probe.setWorldTransform(to_bullet(pose));
  btVector3 low;
  btVector3 high;
  shape.root()->getAabb(probe.getWorldTransform(), low, high);
  const btVector3 around = btVector3(1, 1, 1) * btScalar(reach);
  std::vector<NearBody> found;
  for (Body* other : bodies_in(low - around, high + around, filter)) {
    SmallestDistance smallest{btScalar(reach)};
    space().world().contactPairTest(&probe, &other->rigid, smallest);
    if (smallest.distance <= btScalar(reach))
      found.push_back({other->id, std::max<double>(0, smallest.distance)});
  }
  return found;
}

std::optional<ProbeHit> BulletWorld::sweep(const Geometry& geometry, const Pose& pose,
                                           const Eigen::Vector3d& direction, double length,
                                           const QueryFilter& filter) const {
  const CollisionShape shape(Shape{{ShapePart{geometry, {}}}}, Pose{}, /*is_static=*/false);
  if (!shape.root()->isConvex()) return std::nullopt;
  const auto& convex = *static_cast<const btConvexShape*>(shape.root());
  const btTransform from = to_bullet(pose);
  const btVector3 way = to_bullet(Eigen::Vector3d(direction * length));
  const btTransform to(from.getBasis(), from.getOrigin() + way);
  btCollisionObject probe;
  probe.setCollisionShape(shape.root());
  probe.setWorldTransform(from);
  btVector3 low, high, low_at_end, high_at_end;
  convex.getAabb(from, low, high);
  convex.getAabb(to, low_at_end, high_at_end);
  low.setMin(low_at_end);
  high.setMax(high_at_end);
  std::optional<ProbeHit> hit;
  for (Body* other : bodies_in(low, high, filter)) {
    FirstTouch touch(way);
    space().world().contactPairTest(&probe, &other->rigid, touch.overlap);
    if (!touch.overlap.is_deep()) {
      btCollisionWorld::objectQuerySingle(&convex, from, to, &other->rigid, other->shape->root(),
                                          other->rigid.getWorldTransform(), touch.cast,
                                          /*allowedPenetration=*/0);
    }
    const std::optional<std::pair<btScalar, btVector3>> found = touch.found();
    if (!found || (hit && hit->distance <= double(found->first) * length)) continue;
    hit = ProbeHit{other->id, double(found->first) * length, to_eigen(found->second).normalized()};
  }
  return hit;
}

}  // namespace tessera::bullet
