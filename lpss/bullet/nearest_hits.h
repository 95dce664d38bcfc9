// The nearest hits of Bullet's casts, over one body after the other.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

namespace tessera::bullet {

// Of a swept shape: the nearest hit that it moves towards.
struct NearestHit final : btCollisionWorld::ConvexResultCallback {
  explicit NearestHit(const btVector3& m) : motion(m) {}
  btScalar addSingleResult(btCollisionWorld::LocalConvexResult& result, bool is_world_normal) override {
    const btVector3 n = is_world_normal ? result.m_hitNormalLocal
                                        : result.m_hitCollisionObject->getWorldTransform().getBasis() *
                                              result.m_hitNormalLocal;
    if (!(n.dot(motion) < 0)) return 1;
    m_closestHitFraction = result.m_hitFraction;
    normal = n;
    object = result.m_hitCollisionObject;
    return result.m_hitFraction;
  }
  const btVector3 motion;
  btVector3 normal{0, 0, 1};                  // on the object, world axes
  const btCollisionObject* object = nullptr;  // that is hit
};

struct NearestRayHit final : btCollisionWorld::RayResultCallback {
  btScalar addSingleResult(btCollisionWorld::LocalRayResult& result, bool is_world_normal) override {
    m_closestHitFraction = result.m_hitFraction;
    m_collisionObject = result.m_collisionObject;
    normal = is_world_normal ? result.m_hitNormalLocal
                             : m_collisionObject->getWorldTransform().getBasis() * result.m_hitNormalLocal;
    return result.m_hitFraction;
  }
  btVector3 normal{0, 0, 1};
};

}  // namespace tessera::bullet
