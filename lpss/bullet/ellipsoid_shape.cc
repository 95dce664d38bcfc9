#include "lpss/bullet/ellipsoid_shape.h"

#include <algorithm>
#include <cmath>

namespace tessera::bullet {

EllipsoidShape::EllipsoidShape(const btVector3& radii) : radii_(radii) {
  m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
  const btScalar least = std::min({radii.x(), radii.y(), radii.z()});
  const btScalar largest = std::max({radii.x(), radii.y(), radii.z()});
  // A ball of this radius fits the surface from inside even where it is most curved.
  m_collisionMargin = std::min(
      {btScalar(CONVEX_DISTANCE_MARGIN), least * btScalar(0.1), btScalar(0.5) * least * least / largest});
}

btVector3 EllipsoidShape::localGetSupportingVertex(const btVector3& direction) const {
  const btVector3 stretched = direction * radii_;
  const btScalar length = stretched.length();
  if (!(length > 0)) return {radii_.x(), 0, 0};
  return stretched * radii_ / length;
}

btVector3 EllipsoidShape::localGetSupportingVertexWithoutMargin(const btVector3& direction) const {
  const btScalar length = direction.length();
  if (!(length > 0)) return {radii_.x() - m_collisionMargin, 0, 0};
  return localGetSupportingVertex(direction) - direction * (m_collisionMargin / length);
}

void EllipsoidShape::batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions,
                                                                       btVector3* points, int count) const {
  for (int i = 0; i < count; ++i) points[i] = localGetSupportingVertexWithoutMargin(directions[i]);
}

void EllipsoidShape::getAabb(const btTransform& pose, btVector3& low, btVector3& high) const {
  const btMatrix3x3& basis = pose.getBasis();
  const btVector3 reach((basis[0] * radii_).length(), (basis[1] * radii_).length(),
                        (basis[2] * radii_).length());
  low = pose.getOrigin() - reach;
  high = pose.getOrigin() + reach;
}

void EllipsoidShape::calculateLocalInertia(btScalar mass, btVector3& inertia) const {
  const btVector3 squared = radii_ * radii_;
  inertia = btVector3(squared.y() + squared.z(), squared.x() + squared.z(), squared.x() + squared.y()) *
            (mass * btScalar(0.2));
}

}  // namespace tessera::bullet
