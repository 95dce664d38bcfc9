#include "lpss/bullet/bullet_world.h"

#include <utility>

#include "lpss/bullet/conversions.h"

namespace tessera::bullet {
namespace {

// Pools that cost a world little; what does not fit comes from the heap.
constexpr int kPoolSize = 8;

constexpr int kTilts = 3;

btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = kPoolSize;
  info.m_defaultMaxCollisionAlgorithmPoolSize = kPoolSize;
  info.m_customCollisionAlgorithmMaxElementSize = sizeof(CompoundAlgorithm);
  return info;
}

}  // namespace

bool BulletWorld::PairFilter::needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const {
  return is_wanted_pair(Body::of(static_cast<btCollisionObject*>(a->m_clientObject)),
                        Body::of(static_cast<btCollisionObject*>(b->m_clientObject)), clone_contacts);
}

BulletWorld::BulletWorld(BulletEngine& engine)
    : engine_(engine),
      settings_(engine.settings()),
      configuration_(small_pools()),
      flat_face_algorithms_(&penetration_),
      dispatcher_(&configuration_, engine_),
      filter_(settings_.clone_contacts),
      world_(&dispatcher_, &broadphase_, &configuration_) {
  for (int type = 0; type < MAX_BROADPHASE_COLLISION_TYPES; ++type) {
    dispatcher_.registerCollisionCreateFunc(COMPOUND_SHAPE_PROXYTYPE, type, &compound_algorithms_);
    dispatcher_.registerCollisionCreateFunc(type, COMPOUND_SHAPE_PROXYTYPE, &compound_algorithms_);
  }
  // Bullet finds one point a step for all but two boxes, and a small body falls through its own corner before
  // there are three; tilting the pair a little finds more at once. Not for round shapes, which would not
  // roll.
  flat_face_algorithms_.m_numPerturbationIterations = kTilts;
  flat_face_algorithms_.m_minimumPointsPerturbationThreshold = kTilts;
  for (int type : {BOX_SHAPE_PROXYTYPE, TRIANGLE_SHAPE_PROXYTYPE, CONVEX_HULL_SHAPE_PROXYTYPE}) {
    dispatcher_.registerCollisionCreateFunc(CONVEX_HULL_SHAPE_PROXYTYPE, type, &flat_face_algorithms_);
    dispatcher_.registerCollisionCreateFunc(type, CONVEX_HULL_SHAPE_PROXYTYPE, &flat_face_algorithms_);
  }
  dispatcher_.registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, TRIANGLE_SHAPE_PROXYTYPE,
                                          &flat_face_algorithms_);
  dispatcher_.setNearCallback(&BulletWorld::detect_pair);
  broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&filter_);
  world_.setForceUpdateAllAabbs(false);
  world_.getDispatchInfo().m_useContinuous = settings_.continuous_collision;
}

BulletWorld::~BulletWorld() {
  release(predictive_);
  release(adopted_);
  // All pairs first: taking them out body by body would walk all pairs for each.
  btOverlappingPairCache& cache = *broadphase_.getOverlappingPairCache();
  while (cache.getNumOverlappingPairs() > 0) {
    const btBroadphasePair& last = cache.getOverlappingPairArray()[cache.getNumOverlappingPairs() - 1];
    cache.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, &dispatcher_);
  }
  for (const std::unique_ptr<Body>& body : bodies_) {
    if (body) world_.removeCollisionObject(&body->rigid);
  }
}

BodySlot BulletWorld::add(const BodyRecord& record, Role role) {
  return add(std::make_unique<Body>(record, role, engine_.shape_of(record.properties)));
}

BodySlot BulletWorld::add_static(BodyId id, const BodyProperties& properties, const Shape& part,
                                 const Pose& pose) {
  BodyRecord record{id, {}, properties, {}};
  record.properties.motion = Motion::kStatic;
  record.state.position = {pose.position.x(), pose.position.y(), pose.position.z()};
  record.state.rotation = rotation_of(pose.orientation);
  record.state.activity = Activity::kAsleep;
  auto shape = std::make_shared<CollisionShape>(part, Pose{}, /*is_static=*/true);
  return add(std::make_unique<Body>(record, Role::kStatic, std::move(shape)));
}

BodySlot BulletWorld::add(std::unique_ptr<Body> added) {
  require(added->id.value > 0 && added->id.value <= kBodyIdMax, "a body's id must be 1 to kBodyIdMax");
  const bool is_new = slots_.emplace(added->id.value, 0).second;
  require(is_new, "a body may be in a world once");
  BodySlot slot = static_cast<BodySlot>(bodies_.size());
  if (free_slots_.empty()) {
    bodies_.push_back(nullptr);
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  added->slot = slot;
  slots_[added->id.value] = slot;
  Body& body = *added;
  bodies_[static_cast<std::size_t>(slot)] = std::move(added);
  // The next proxy takes the next number, so this names it by its body.
  broadphase_.m_gid = static_cast<int>(body.id.value) - 1;
  world_.addCollisionObject(&body.rigid);
  set_box_to_pose(body);
  return slot;
}

void BulletWorld::remove(BodySlot slot) {
  Body& gone = body(slot);
  release_of(gone, predictive_);
  release_of(gone, adopted_);
  world_.removeCollisionObject(&gone.rigid);
  slots_.erase(gone.id.value);
  bodies_[static_cast<std::size_t>(slot)] = nullptr;
  free_slots_.push_back(slot);
  is_gathered_ = false;
}

void BulletWorld::set_state(BodySlot slot, const BodyState& state) {
  body(slot).set_state(state);
  set_box_to_pose(body(slot));
}

Eigen::Vector3d BulletWorld::position(BodySlot slot) const {
  const Body& b = body(slot);
  if (b.motion == Motion::kStatic) return Eigen::Map<const Eigen::Vector3d>(b.static_state.position.data());
  return to_eigen(b.rigid.getWorldTransform().getOrigin());
}

Eigen::Vector3d BulletWorld::linear_velocity(BodySlot slot) const {
  return to_eigen(body(slot).rigid.getLinearVelocity());
}

void BulletWorld::set_velocity(BodySlot slot, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
  body(slot).rigid.setLinearVelocity(to_bullet(linear));
  body(slot).rigid.setAngularVelocity(to_bullet(angular));
}

void BulletWorld::apply_impulse(BodySlot slot, const Eigen::Vector3d& impulse, const Eigen::Vector3d& lever) {
  body(slot).rigid.applyImpulse(to_bullet(impulse), to_bullet(lever));
}

void BulletWorld::add_wrench(BodySlot slot, const Wrench& wrench) {
  body(slot).rigid.applyCentralForce(to_bullet(wrench.force));
  body(slot).rigid.applyTorque(to_bullet(wrench.torque));
}

void BulletWorld::set_gravity(BodySlot slot, const Eigen::Vector3d& acceleration) {
  if (body(slot).feels_gravity) body(slot).rigid.setGravity(to_bullet(acceleration));
}

void BulletWorld::sleep(BodySlot slot) {
  Body& sleeper = body(slot);
  if (sleeper.motion == Motion::kStatic) return;
  sleeper.rigid.setLinearVelocity(btVector3(0, 0, 0));
  sleeper.rigid.setAngularVelocity(btVector3(0, 0, 0));
  sleeper.rigid.setInterpolationWorldTransform(sleeper.rigid.getWorldTransform());
  sleeper.rigid.forceActivationState(ISLAND_SLEEPING);
  set_box_to_pose(sleeper);
}

void BulletWorld::wake(BodySlot slot) {
  if (body(slot).motion == Motion::kStatic) return;
  body(slot).rigid.forceActivationState(ACTIVE_TAG);
  body(slot).rigid.setDeactivationTime(0);
}

Wrench BulletWorld::total_wrench(BodySlot slot) const {
  return {to_array(body(slot).rigid.getTotalForce()), to_array(body(slot).rigid.getTotalTorque())};
}

void BulletWorld::set_total_wrench(BodySlot slot, const Wrench& wrench) {
  body(slot).rigid.clearForces();
  add_wrench(slot, wrench);
}

}  // namespace tessera::bullet
