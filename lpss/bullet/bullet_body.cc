#include "lpss/bullet/bullet_body.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <utility>

#include "lpss/bullet/conversions.h"
#include "lpss/bullet/smooth_edges.h"

namespace tessera::bullet {
namespace {

btRigidBody::btRigidBodyConstructionInfo construction_of(const BodyProperties& properties,
                                                         const CollisionShape& shape) {
  const bool is_dynamic = properties.motion == Motion::kDynamic;
  const btVector3 inertia = is_dynamic ? to_bullet(properties.inertia) : btVector3(0, 0, 0);
  btRigidBody::btRigidBodyConstructionInfo info(is_dynamic ? btScalar(properties.mass) : btScalar(0), nullptr,
                                                shape.root(), inertia);
  info.m_friction = btScalar(properties.friction);
  info.m_restitution = btScalar(properties.restitution);
  info.m_linearDamping = btScalar(properties.linear_damping);
  info.m_angularDamping = btScalar(properties.angular_damping);
  return info;
}

int bullet_activation(Activity activity) {
  switch (activity) {
    case Activity::kAwake:
      return ACTIVE_TAG;
    case Activity::kAsleep:
      return ISLAND_SLEEPING;
    case Activity::kWantsSleep:
      return WANTS_DEACTIVATION;
  }
  return ACTIVE_TAG;
}

}  // namespace

Body::Body(const BodyRecord& record, Role r, CollisionShapeRef s, const EngineSettings& settings)
    : id(record.id),
      role(r),
      motion(record.properties.motion),
      category(record.properties.category),
      mask(record.properties.mask),
      assembly(record.properties.assembly),
      feels_gravity(record.properties.gravity),
      is_damped(record.properties.linear_damping > 0 || record.properties.angular_damping > 0),
      flies_fine(settings.fine_flight && is_dynamic() && !is_damped),
      shape(std::move(s)),
      rigid(construction_of(record.properties, *shape)) {
  rigid.setUserPointer(this);
  if (motion == Motion::kKinematic) {
    rigid.setCollisionFlags((rigid.getCollisionFlags() & ~btCollisionObject::CF_STATIC_OBJECT) |
                            btCollisionObject::CF_KINEMATIC_OBJECT);
  }
  if (shape->root()->isConcave()) smooth_contacts(rigid);
  if (is_dynamic()) {
    swept_beyond = shape->swept_extent() * btScalar(0.5);
    swept_radius = shape->swept_extent() * btScalar(0.4);
    btVector3 centre;
    shape->root()->getBoundingSphere(centre, radius);
    radius += centre.length();
  }
  set_state(record.state);
}

BodyState Body::state() const {
  if (motion == Motion::kStatic) return static_state;
  BodyState state;
  const FineFlight at = fine.value_or(rounded());
  Eigen::Map<Eigen::Vector3d>(state.position.data()) = at.position;
  state.rotation = to_array(rigid.getWorldTransform().getBasis());
  Eigen::Map<Eigen::Vector3d>(state.linear_velocity.data()) = at.velocity;
  state.angular_velocity = to_array(rigid.getAngularVelocity());
  state.still_for = rigid.getDeactivationTime();
  state.activity = activity();
  return state;
}

void Body::set_state(const BodyState& state) {
  btTransform pose(to_bullet(state.rotation), to_bullet(state.position));
  if (motion == Motion::kStatic) {
    static_state = state;
    pose = pose * shape->offset();
  }
  rigid.setWorldTransform(pose);
  rigid.setInterpolationWorldTransform(pose);
  rigid.updateInertiaTensor();
  rigid.setDeactivationTime(btScalar(state.still_for));
  if (motion == Motion::kStatic) {
    rigid.forceActivationState(ISLAND_SLEEPING);
    return;
  }
  fine.reset();
  if (flies_fine) {
    fine = {Eigen::Vector3d(state.position.data()), Eigen::Vector3d(state.linear_velocity.data())};
  }
  rigid.setLinearVelocity(to_bullet(state.linear_velocity));
  rigid.setAngularVelocity(to_bullet(state.angular_velocity));
  rigid.forceActivationState(bullet_activation(state.activity));
}

FineFlight Body::rounded() const {
  return {to_eigen(rigid.getWorldTransform().getOrigin()), to_eigen(rigid.getLinearVelocity())};
}

Activity Body::activity() const {
  switch (rigid.getActivationState()) {
    case ACTIVE_TAG:
      return Activity::kAwake;
    case WANTS_DEACTIVATION:
      return Activity::kWantsSleep;
    default:  // asleep, or removed by Bullet because its box is not finite
      return Activity::kAsleep;
  }
}

Bounds bounds_at(const Body& body, const btTransform& pose) {
  const btVector3 reach(gContactBreakingThreshold, gContactBreakingThreshold, gContactBreakingThreshold);
  Bounds bounds;
  body.shape->root()->getAabb(pose, bounds.low, bounds.high);
  bounds.low -= reach;
  bounds.high += reach;
  return bounds;
}

bool is_sensible(const Bounds& bounds) { return (bounds.high - bounds.low).length2() < btScalar(1e12); }

bool is_wanted_pair(const Body& a, const Body& b) {
  if (!a.is_dynamic() && !b.is_dynamic()) return false;
  if (a.assembly != 0 && a.assembly == b.assembly) return false;
  return (a.category & b.mask) != 0 && (b.category & a.mask) != 0;
}

bool PairFilter::needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const {
  return is_wanted_pair(Body::of(static_cast<btCollisionObject*>(a->m_clientObject)),
                        Body::of(static_cast<btCollisionObject*>(b->m_clientObject)));
}

}  // namespace tessera::bullet
