// The two halves of a step.

#include <LinearMath/btAabbUtil2.h>

#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/conversions.h"

namespace tessera::bullet {

void BulletWorld::detect(double dt) {
  release(predictive_);
  predict(dt);
  world_.updateAabbs();
  boxes_are_old_ = false;
  btDispatcherInfo& info = world_.getDispatchInfo();
  info.m_timeStep = btScalar(dt);
  info.m_stepCount = 0;
  if (settings_.continuous_collision) make_predictive_contacts();
  world_.computeOverlappingPairs();
  dispatcher_.dispatchAllCollisionPairs(broadphase_.getOverlappingPairCache(), info, &dispatcher_);
  is_gathered_ = false;
}

// Forces and damping, and where bodies would be after the step if nothing stopped them. Clones are damped,
// too, since they are swept like their originals.
void BulletWorld::predict(double dt) {
  const auto step = btScalar(dt);
  for (const std::unique_ptr<Body>& slot : bodies_) {
    if (!slot || !slot->is_dynamic() || !slot->is_awake()) continue;
    btRigidBody& rigid = slot->rigid;
    if (slot->feels_gravity && (slot->role == Role::kHome || settings_.clones_are_solved))
      rigid.applyGravity();
    if (slot->is_damped) rigid.applyDamping(step);
    rigid.predictIntegratedTransform(step, rigid.getInterpolationWorldTransform());
  }
}

// The broadphase goes on noting pairs that joints keep apart: they meet again when the joints are gone.
void BulletWorld::detect_pair(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                              const btDispatcherInfo& info) {
  const btBroadphaseProxy& a = *pair.m_pProxy0;
  const btBroadphaseProxy& b = *pair.m_pProxy1;
  const BodyId id_a = Body::of(static_cast<const btCollisionObject*>(a.m_clientObject)).id;
  const BodyId id_b = Body::of(static_cast<const btCollisionObject*>(b.m_clientObject)).id;
  if (TestAabbAgainstAabb2(a.m_aabbMin, a.m_aabbMax, b.m_aabbMin, b.m_aabbMax) &&
      !static_cast<const Dispatcher&>(dispatcher).engine.are_apart(id_a, id_b)) {
    btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
  } else if (pair.m_algorithm) {
    pair.m_algorithm->~btCollisionAlgorithm();
    dispatcher.freeCollisionAlgorithm(pair.m_algorithm);
    pair.m_algorithm = nullptr;
  }
}

void BulletWorld::make_predictive_contacts() {
  for (const std::unique_ptr<Body>& slot : bodies_) {
    if (!slot || slot->swept_beyond <= 0 || !slot->is_awake()) continue;
    btRigidBody& rigid = slot->rigid;
    const btTransform& to = rigid.getInterpolationWorldTransform();
    const btVector3 motion = to.getOrigin() - rigid.getWorldTransform().getOrigin();
    if (!(motion.length2() > slot->swept_beyond * slot->swept_beyond)) continue;
    if (const std::optional<SweepHit> hit = sweep(*slot, to)) make_predictive_contact(*slot, *hit, motion);
  }
}

// A contact ahead: the solver lets the body come as far as the hit, and no farther, in this step.
void BulletWorld::make_predictive_contact(Body& swept, const SweepHit& hit, const btVector3& motion) {
  const btVector3 to_hit = motion * hit.fraction;
  const btVector3 start = swept.rigid.getWorldTransform().getOrigin();
  const btVector3 on_other = start + to_hit;
  btPersistentManifold* manifold = dispatcher_.getNewManifold(&swept.rigid, &hit.other->rigid);
  mark_predictive(*manifold, swept.id < hit.other->id);
  btManifoldPoint point(btVector3(0, 0, 0), hit.other->rigid.getWorldTransform().invXform(on_other),
                        hit.normal, to_hit.dot(-hit.normal));
  point.m_combinedFriction = swept.rigid.getFriction() * hit.other->rigid.getFriction();
  point.m_positionWorldOnA = start;
  point.m_positionWorldOnB = on_other;
  manifold->addManifoldPoint(point, /*isPredictive=*/true);
  predictive_.push_back(manifold);
}

void BulletWorld::integrate(double dt) {
  const auto step = btScalar(dt);
  std::vector<Body*> fast;
  for (const std::unique_ptr<Body>& slot : bodies_) {
    if (!slot || !slot->is_dynamic() || slot->role != Role::kHome || !slot->is_awake()) continue;
    btRigidBody& rigid = slot->rigid;
    rigid.predictIntegratedTransform(step, slot->next);
    const btVector3 motion = slot->next.getOrigin() - rigid.getWorldTransform().getOrigin();
    if (settings_.continuous_collision && slot->swept_beyond > 0 &&
        motion.length2() > slot->swept_beyond * slot->swept_beyond) {
      fast.push_back(slot.get());
    }
  }
  if (!fast.empty()) {
    // From here on, boxes contain all poses that the solver has corrected.
    set_boxes_to_poses();
    for (Body* swept : fast) {
      if (const std::optional<SweepHit> hit = sweep(*swept, swept->next)) {
        swept->rigid.predictIntegratedTransform(step * hit->fraction, swept->next);
      }
    }
  }
  for (const std::unique_ptr<Body>& slot : bodies_) {
    if (!slot || !slot->is_dynamic()) continue;
    slot->rigid.clearForces();
    if (slot->role != Role::kHome || !slot->is_awake()) continue;
    slot->rigid.proceedToTransform(slot->next);
    keep_still_clock(*slot, dt);
  }
  boxes_are_old_ = true;
}

void BulletWorld::keep_still_clock(Body& kept, double dt) {
  btRigidBody& rigid = kept.rigid;
  const auto linear = btScalar(settings_.sleep_linear_speed);
  const auto angular = btScalar(settings_.sleep_angular_speed);
  const bool is_still = rigid.getLinearVelocity().length2() < linear * linear &&
                        rigid.getAngularVelocity().length2() < angular * angular;
  rigid.setDeactivationTime(is_still ? rigid.getDeactivationTime() + btScalar(dt) : btScalar(0));
  const bool wants_sleep =
      is_still && settings_.sleep_after > 0 && rigid.getDeactivationTime() >= btScalar(settings_.sleep_after);
  rigid.forceActivationState(wants_sleep ? WANTS_DEACTIVATION : ACTIVE_TAG);
}

}  // namespace tessera::bullet
