// An ellipsoid for Bullet, which has none.
#pragma once

#include <BulletCollision/CollisionShapes/btConvexInternalShape.h>

namespace tessera::bullet {

// Centred on its origin, with its axes along x, y and z. Exact: the core that Bullet's distance algorithm
// sees is the ellipsoid with a ball of the margin's radius rolled off its inside, and the margin is chosen
// such that rolling it back on gives the ellipsoid again.
class EllipsoidShape final : public btConvexInternalShape {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  explicit EllipsoidShape(const btVector3& radii);

  btVector3 localGetSupportingVertex(const btVector3& direction) const override;
  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override;
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* points,
                                                         int count) const override;
  void getAabb(const btTransform& pose, btVector3& low, btVector3& high) const override;
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
  void setMargin(btScalar) override {}  // follows from the radii
  const char* getName() const override { return "Ellipsoid"; }

 private:
  btVector3 radii_;
};

}  // namespace tessera::bullet
