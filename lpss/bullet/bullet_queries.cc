// Boxes, sweeps and rays.

#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <LinearMath/btAabbUtil2.h>
#include <LinearMath/btTransformUtil.h>

#include <algorithm>

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

std::optional<RayHit> BulletWorld::raycast(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                           std::uint32_t mask) const {
  if (bounds_are_old_) set_bounds_to_poses();
  const btVector3 start = to_bullet(from);
  const btVector3 end = to_bullet(to);
  const auto is_wanted = [&](const Body& other, const btBroadphaseProxy&) {
    return other.role != Role::kClone && (other.category & mask) != 0;
  };
  Collector<btBroadphaseRayCallback, decltype(is_wanted)> candidates(is_wanted);
  const btVector3 ray = end - start;
  const btScalar length = ray.length();
  if (!(length > 0)) return std::nullopt;
  for (int axis = 0; axis < 3; ++axis) {
    const btScalar slope = ray[axis] / length;
    candidates.m_rayDirectionInverse[axis] = slope == 0 ? btScalar(BT_LARGE_FLOAT) : 1 / slope;
    candidates.m_signs[axis] = candidates.m_rayDirectionInverse[axis] < 0;
  }
  candidates.m_lambda_max = length;
  space().broadphase().rayTest(start, end, candidates);
  NearestRayHit nearest;
  const btTransform ray_from(btMatrix3x3::getIdentity(), start);
  const btTransform ray_to(btMatrix3x3::getIdentity(), end);
  for (Body* other : candidates.sorted()) {
    btCollisionWorld::rayTestSingle(ray_from, ray_to, &other->rigid, other->shape->root(),
                                    other->rigid.getWorldTransform(), nearest);
  }
  if (!nearest.hasHit()) return std::nullopt;
  return RayHit{Body::of(nearest.m_collisionObject).id, nearest.m_closestHitFraction,
                to_eigen(nearest.normal).normalized()};
}

std::vector<NearBody> BulletWorld::near(const Geometry& geometry, const Pose& pose, double reach,
                                        std::uint32_t mask) {
  if (bounds_are_old_) set_bounds_to_poses();
  const CollisionShape shape(Shape{{ShapePart{geometry, {}}}}, Pose{}, /*is_static=*/false);
  btCollisionObject probe;
  probe.setCollisionShape(shape.root());
  probe.setWorldTransform(to_bullet(pose));
  btVector3 low;
  btVector3 high;
  shape.root()->getAabb(probe.getWorldTransform(), low, high);
  const btVector3 around = btVector3(1, 1, 1) * btScalar(reach);
  const auto is_wanted_here = [&](const Body& other, const btBroadphaseProxy&) {
    return other.role != Role::kClone && (other.category & mask) != 0;
  };
  Collector<btBroadphaseAabbCallback, decltype(is_wanted_here)> candidates(is_wanted_here);
  space().broadphase().aabbTest(low - around, high + around, candidates);
  std::vector<NearBody> found;
  for (Body* other : candidates.sorted()) {
    SmallestDistance smallest{btScalar(reach)};
    space().world().contactPairTest(&probe, &other->rigid, smallest);
    if (smallest.distance <= btScalar(reach))
      found.push_back({other->id, std::max<double>(0, smallest.distance)});
  }
  return found;
}

}  // namespace tessera::bullet
