// Contacts of shapes with flat faces. Except for two boxes, Bullet's algorithms find one point per step, and
// a small body sinks in at a corner before there are three; tilting the pair a little finds more points at
// once. Bullet can do so, too, but turns by the C library's sin and cos, whose last bits depend on the
// processor. Not for round shapes, which would not roll.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/NarrowPhaseCollision/btConvexPenetrationDepthSolver.h>

namespace tessera::bullet {

// For two convex shapes. `penetration` must outlive the algorithms.
class FlatFaceAlgorithms final : public btCollisionAlgorithmCreateFunc {
 public:
  explicit FlatFaceAlgorithms(btConvexPenetrationDepthSolver* penetration) : penetration_(penetration) {}
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* first,
                                                 const btCollisionObjectWrapper* second) override;

 private:
  btConvexPenetrationDepthSolver* const penetration_;
};

// For a convex shape and a plane, in either order.
class FlatFaceOnPlaneAlgorithms final : public btCollisionAlgorithmCreateFunc {
 public:
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* first,
                                                 const btCollisionObjectWrapper* second) override;
};

}  // namespace tessera::bullet
