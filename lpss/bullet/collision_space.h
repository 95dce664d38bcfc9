// Bullet's data for finding the pairs of one world and their contacts. It takes ten times the memory of a
// body, so a world has one only while it has two bodies or more: a lone body touches nothing.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>

#include "lpss/bullet/bullet_body.h"
#include "lpss/bullet/bullet_engine.h"
#include "lpss/bullet/compound_algorithm.h"
#include "lpss/bullet/flat_faces.h"

namespace tessera::bullet {

// The friction of a contact is the smaller one of its two bodies, as in Gazebo.
btScalar smaller_friction(const btCollisionObject* a, const btCollisionObject* b);

class CollisionSpace {
 public:
  explicit CollisionSpace(const BulletEngine& engine);
  ~CollisionSpace();
  CollisionSpace(const CollisionSpace&) = delete;
  CollisionSpace& operator=(const CollisionSpace&) = delete;

  // `bounds` is used for finding pairs until it is set again. Bodies must outlive the space or be removed.
  void add(Body& body, const Bounds& bounds);
  void remove(Body& body);

  static Bounds bounds_of(const Body& body);
  void set_bounds(const Body& body, const Bounds& bounds);

  // Updates the contacts of all pairs whose boxes overlap.
  void detect(double dt);

  // The space's entry of a pair; it is created if missing.
  btBroadphasePair& pair_of(Body& a, Body& b);

  btCollisionWorld& world() { return world_; }
  btDbvtBroadphase& broadphase() { return broadphase_; }

  // Bullet creates no manifolds for two sleeping bodies, but imported pairs need one.
  struct Dispatcher final : btCollisionDispatcher {
    Dispatcher(btCollisionConfiguration* configuration, const BulletEngine& e)
        : btCollisionDispatcher(configuration), engine(e) {}
    bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
      return is_importing || a->isActive() || b->isActive();
    }
    const BulletEngine& engine;
    bool is_importing = false;
  };
  Dispatcher& dispatcher() { return dispatcher_; }

 private:
  static void detect_pair(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                          const btDispatcherInfo& info);

  btDefaultCollisionConfiguration configuration_;
  CompoundAlgorithm::CreateFunc compound_algorithms_;
  btGjkEpaPenetrationDepthSolver penetration_;
  FlatFaceAlgorithms flat_face_algorithms_;
  FlatFaceOnPlaneAlgorithms flat_face_on_plane_algorithms_;
  Dispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  PairFilter filter_;
  btCollisionWorld world_;
};

}  // namespace tessera::bullet
