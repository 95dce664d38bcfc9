// The two halves of a step.
#include <algorithm>
#include <optional>
#include <vector>

#include "lpss/base/portable_math.h"
#include "lpss/bullet/bullet_world.h"
#include "lpss/bullet/conversions.h"
#include "lpss/bullet/free_motion.h"
#include "lpss/engine/still_clock.h"
#include "lpss/model/divergence.h"

namespace tessera::bullet {
namespace {

// As btRigidBody::applyDamping().
void damp(btRigidBody& rigid, double dt) {
  const auto left = [dt](btScalar damping) { return btScalar(portable::pow(1 - double(damping), dt)); };
  rigid.setLinearVelocity(rigid.getLinearVelocity() * left(rigid.getLinearDamping()));
  rigid.setAngularVelocity(rigid.getAngularVelocity() * left(rigid.getAngularDamping()));
}

bool is_finite(const btTransform& pose) {
  return to_eigen(pose.getOrigin()).allFinite() && to_eigen(pose.getBasis()).allFinite();
}

std::optional<DivergenceKind> divergence_of(const Body& body) {
  return tessera::divergence_of(to_eigen(body.rigid.getLinearVelocity()),
                                to_eigen(body.rigid.getAngularVelocity()), double(body.radius));
}

// At rest where it is.
void stop(Body& body) {
  BodyState state = body.state();
  Eigen::Map<Eigen::Vector3d>(state.position.data()) = to_eigen(body.rigid.getWorldTransform().getOrigin());
  state.linear_velocity = {};
  state.angular_velocity = {};
  state.still_for = 0;
  state.activity = Activity::kAwake;
  body.set_state(state);
  body.next = body.rigid.getWorldTransform();
  body.coasts = false;
}

}  // namespace

void BulletWorld::detect(double dt, const ParallelFor& /*parallel*/) {
  release(predictive_);
  leave_space();
  predict(dt);
  set_bounds_to_predictions();
  is_gathered_ = false;
  if (!space_) return;
  if (settings_.continuous_collision) make_predictive_contacts();
  space_->detect(dt);
}

// Forces and damping, and the poses of bodies after the step without contacts. Clones are damped, too, since
// they are swept like their originals.
void BulletWorld::predict(double dt) {
  const auto step = btScalar(dt);
  for (const std::unique_ptr<Body>& slot : bodies_) {
    if (!slot || !slot->is_dynamic() || !slot->is_awake()) continue;
    btRigidBody& rigid = slot->rigid;
    if (slot->feels_gravity) rigid.applyGravity();
    if (slot->is_damped) damp(rigid, dt);
    rigid.setInterpolationWorldTransform(after(rigid, step));
  }
}

// As Bullet's updateAabbs(): a body whose box is not finite, or far too large, is removed.
void BulletWorld::set_bounds_to_predictions() {
  for (const std::unique_ptr<Body>& slot : bodies_) {
    if (!slot || !slot->is_awake()) continue;
    btRigidBody& rigid = slot->rigid;
    Bounds bounds = bounds_at(*slot, rigid.getWorldTransform());
    if (settings_.continuous_collision && slot->is_dynamic()) {
      const Bounds predicted = bounds_at(*slot, rigid.getInterpolationWorldTransform());
      bounds.low.setMin(predicted.low);
      bounds.high.setMax(predicted.high);
    }
    if (is_sensible(bounds)) {
      set_bounds(*slot, bounds);
    } else {
      rigid.setActivationState(DISABLE_SIMULATION);
    }
  }
  bounds_are_old_ = false;
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

// A predicted contact: the solver lets the body move as far as the hit, and no farther, in this step.
void BulletWorld::make_predictive_contact(Body& swept, const SweepHit& hit, const btVector3& motion) {
  const btVector3 to_hit = motion * hit.fraction;
  const btVector3 start = swept.rigid.getWorldTransform().getOrigin();
  const btVector3 on_other = start + to_hit;
  btPersistentManifold* manifold = space_->dispatcher().getNewManifold(&swept.rigid, &hit.other->rigid);
  mark_predictive(*manifold, swept.id < hit.other->id);
  btManifoldPoint point(btVector3(0, 0, 0), hit.other->rigid.getWorldTransform().invXform(on_other),
                        hit.normal, to_hit.dot(-hit.normal));
  point.m_combinedFriction = smaller_friction(&swept.rigid, &hit.other->rigid);
  point.m_positionWorldOnA = start;
  point.m_positionWorldOnB = on_other;
  manifold->addManifoldPoint(point, /*isPredictive=*/true);
  predictive_.push_back(manifold);
}

// The same bits as Bullet's solver for a body without rows: it adds the changes of rows, none here, before
// those of forces.
void BulletWorld::fly(BodySlot slot, double dt) {
  Body& flier = body(slot);
  btRigidBody& rigid = flier.rigid;
  const auto step = btScalar(dt);
  const btVector3 rows(0, 0, 0);
  btVector3 turned = rigid.getTotalTorque() * rigid.getInvInertiaTensorWorld() * step;
  turned += rigid.computeGyroscopicImpulseImplicit_Body(step);
  rigid.setAngularVelocity(rigid.getAngularVelocity() + rows + turned);
  if (!flier.flies_fine) {
    const btVector3 pushed = rigid.getTotalForce() * rigid.getInvMass() * step;
    rigid.setLinearVelocity(rigid.getLinearVelocity() + rows + pushed);
    return;
  }
  if (!flier.fine) flier.fine = flier.rounded();
  flier.fine->velocity += to_eigen(rigid.getTotalForce()) * double(rigid.getInvMass()) * dt;
  rigid.setLinearVelocity(to_bullet(flier.fine->velocity));
  flier.coasts = true;
}

std::vector<StoppedBody> BulletWorld::integrate(double dt, const ParallelFor& /*parallel*/) {
  const auto step = btScalar(dt);
  std::vector<Body*> fast;
  std::vector<StoppedBody> stopped;
  for (const std::unique_ptr<Body>& slot : bodies_) {
    if (!slot || !slot->is_dynamic() || slot->role != Role::kHome || !slot->is_awake()) continue;
    btRigidBody& rigid = slot->rigid;
    if (const std::optional<DivergenceKind> kind = divergence_of(*slot)) {
      stop(*slot);
      stopped.push_back({slot->slot, *kind});
      continue;
    }
    slot->next = after(rigid, step);
    if (!slot->coasts) {
      slot->fine.reset();
    } else {
      slot->fine->position += slot->fine->velocity * dt;
      slot->next.setOrigin(to_bullet(slot->fine->position));
      slot->coasts = false;
    }
    if (!is_finite(slot->next)) {
      stop(*slot);
      stopped.push_back({slot->slot, DivergenceKind::kPosition});
      continue;
    }
    const btVector3 motion = slot->next.getOrigin() - rigid.getWorldTransform().getOrigin();
    if (settings_.continuous_collision && slot->swept_beyond > 0 && !slot->jointed &&
        motion.length2() > slot->swept_beyond * slot->swept_beyond) {
      fast.push_back(slot.get());
    }
  }
  if (space_ && !fast.empty()) {
    // From here on, boxes contain all poses that the solver has corrected.
    set_bounds_to_poses();
    for (Body* swept : fast) {
      if (const std::optional<SweepHit> hit = sweep(*swept, swept->next)) {
        swept->next = after(swept->rigid, step * hit->fraction);
        swept->fine.reset();
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
  bounds_are_old_ = true;
  return stopped;
}

void BulletWorld::keep_still_clock(Body& kept, double dt) {
  btRigidBody& rigid = kept.rigid;
  const StillLimits<btScalar> limits{btScalar(settings_.sleep_linear_speed),
                                     btScalar(settings_.sleep_angular_speed)};
  const StillClock<btScalar> clock =
      still_clock<btScalar>(rigid.getDeactivationTime(), rigid.getLinearVelocity().length2(),
                            rigid.getAngularVelocity().length2(), limits, settings_.sleep_after, dt);
  rigid.setDeactivationTime(clock.still_for);
  rigid.forceActivationState(clock.wants_sleep ? WANTS_DEACTIVATION : ACTIVE_TAG);
}

}  // namespace tessera::bullet
