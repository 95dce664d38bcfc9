#include "lpss/bullet/collision_space.h"

#include <LinearMath/btAabbUtil2.h>

#include <algorithm>

namespace tessera::bullet {
namespace {

// Small pools; the rest comes from the heap.
constexpr int kPoolSize = 8;

btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = kPoolSize;
  info.m_defaultMaxCollisionAlgorithmPoolSize = kPoolSize;
  info.m_customCollisionAlgorithmMaxElementSize = sizeof(CompoundAlgorithm);
  return info;
}

}  // namespace

btScalar smaller_friction(const btCollisionObject* a, const btCollisionObject* b) {
  return std::min(a->getFriction(), b->getFriction());
}

CollisionSpace::CollisionSpace(const BulletEngine& engine)
    : configuration_(small_pools()),
      flat_face_algorithms_(&penetration_),
      dispatcher_(&configuration_, engine),
      world_(&dispatcher_, &broadphase_, &configuration_) {
  for (int type = 0; type < MAX_BROADPHASE_COLLISION_TYPES; ++type) {
    dispatcher_.registerCollisionCreateFunc(COMPOUND_SHAPE_PROXYTYPE, type, &compound_algorithms_);
    dispatcher_.registerCollisionCreateFunc(type, COMPOUND_SHAPE_PROXYTYPE, &compound_algorithms_);
  }
  for (int type : {BOX_SHAPE_PROXYTYPE, TRIANGLE_SHAPE_PROXYTYPE, CONVEX_HULL_SHAPE_PROXYTYPE}) {
    dispatcher_.registerCollisionCreateFunc(CONVEX_HULL_SHAPE_PROXYTYPE, type, &flat_face_algorithms_);
    dispatcher_.registerCollisionCreateFunc(type, CONVEX_HULL_SHAPE_PROXYTYPE, &flat_face_algorithms_);
  }
  dispatcher_.registerCollisionCreateFunc(BOX_SHAPE_PROXYTYPE, TRIANGLE_SHAPE_PROXYTYPE,
                                          &flat_face_algorithms_);
  for (int type : {BOX_SHAPE_PROXYTYPE, CONVEX_HULL_SHAPE_PROXYTYPE}) {
    dispatcher_.registerCollisionCreateFunc(type, STATIC_PLANE_PROXYTYPE, &flat_face_on_plane_algorithms_);
    dispatcher_.registerCollisionCreateFunc(STATIC_PLANE_PROXYTYPE, type, &flat_face_on_plane_algorithms_);
  }
  dispatcher_.setNearCallback(&CollisionSpace::detect_pair);
  broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&filter_);
  world_.getDispatchInfo().m_useContinuous = engine.settings().continuous_collision;
}

CollisionSpace::~CollisionSpace() {
  // Remove all pairs first: removing them body by body would iterate over all pairs for each.
  btOverlappingPairCache& cache = *broadphase_.getOverlappingPairCache();
  while (cache.getNumOverlappingPairs() > 0) {
    const btBroadphasePair& last = cache.getOverlappingPairArray()[cache.getNumOverlappingPairs() - 1];
    cache.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, &dispatcher_);
  }
  while (world_.getNumCollisionObjects() > 0) {
    world_.removeCollisionObject(world_.getCollisionObjectArray()[world_.getNumCollisionObjects() - 1]);
  }
}

void CollisionSpace::add(Body& body, const Bounds& bounds) {
  // The next proxy takes the next number, so this makes it the body's id.
  broadphase_.m_gid = static_cast<int>(body.id.value) - 1;
  world_.addCollisionObject(&body.rigid);
  set_bounds(body, bounds);
}

void CollisionSpace::remove(Body& body) { world_.removeCollisionObject(&body.rigid); }

Bounds CollisionSpace::bounds_of(const Body& body) {
  const btBroadphaseProxy& proxy = *body.rigid.getBroadphaseHandle();
  return {proxy.m_aabbMin, proxy.m_aabbMax};
}

void CollisionSpace::set_bounds(const Body& body, const Bounds& bounds) {
  auto* proxy = const_cast<btBroadphaseProxy*>(body.rigid.getBroadphaseHandle());
  broadphase_.setAabb(proxy, bounds.low, bounds.high, &dispatcher_);
}

void CollisionSpace::detect(double dt) {
  btDispatcherInfo& info = world_.getDispatchInfo();
  info.m_timeStep = btScalar(dt);
  info.m_stepCount = 0;
  world_.computeOverlappingPairs();
  dispatcher_.dispatchAllCollisionPairs(broadphase_.getOverlappingPairCache(), info, &dispatcher_);
}

// The broadphase keeps pairs that joints exclude: they collide again once the joints are removed.
void CollisionSpace::detect_pair(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
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

// The broadphase may lack a pair whose bodies have only come closer by their prediction: the pair is added
// now, and the next detection decides.
btBroadphasePair& CollisionSpace::pair_of(Body& a, Body& b) {
  btOverlappingPairCache& cache = *broadphase_.getOverlappingPairCache();
  btBroadphaseProxy* proxy_a = a.rigid.getBroadphaseHandle();
  btBroadphaseProxy* proxy_b = b.rigid.getBroadphaseHandle();
  btBroadphasePair* pair = cache.findPair(proxy_a, proxy_b);
  if (!pair) pair = cache.addOverlappingPair(proxy_a, proxy_b);
  return *pair;
}

}  // namespace tessera::bullet
