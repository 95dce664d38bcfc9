#include "lpss/bullet/smooth_edges.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btInternalEdgeUtility.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace tessera::bullet {
namespace {

// Beyond this tilt (its cosine) a contact is with an edge that the neighbouring triangle covers.
constexpr btScalar kCovered(0.9999);

bool is_round(const btCollisionShape& shape) {
  return shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE || shape.getShapeType() == CAPSULE_SHAPE_PROXYTYPE;
}

btVector3 face_normal(const btCollisionObjectWrapper& triangle) {
  btVector3 normal;
  static_cast<const btTriangleShape*>(triangle.getCollisionShape())->calcNormal(normal);
  return triangle.getWorldTransform().getBasis() * normal;
}

// A triangle handles its own face and outer edges. Towards an inner edge Bullet turns the normal to that of
// the face. But a point that is not reached yet, or on the flank of a ball, belongs to the neighbour: a
// rolling ball meets it from above, and would be thrown up. Such a point is moved out of reach, where the
// algorithm that found it drops it. Bullet's algorithms put the triangle second.
bool correct(btManifoldPoint& point, const btCollisionObjectWrapper* other, int, int,
             const btCollisionObjectWrapper* triangle, int part, int index) {
  if (triangle->getCollisionShape()->getShapeType() != TRIANGLE_SHAPE_PROXYTYPE) return true;
  const btVector3 found = point.m_normalWorldOnB;
  const bool from_behind = face_normal(*triangle).dot(found) < 0;
  btAdjustInternalEdgeContacts(point, triangle, other, part, index,
                               from_behind ? BT_TRIANGLE_CONVEX_BACKFACE_MODE : 0);
  const btVector3& normal = point.m_normalWorldOnB;
  if (normal.dot(found) > kCovered) return true;
  if (point.getDistance() <= 0 && !is_round(*other->getCollisionShape())) return true;
  point.m_localPointB = triangle->getWorldTransform().invXform(point.m_positionWorldOnA - normal);
  return true;
}

}  // namespace

void find_edges(btBvhTriangleMeshShape& shape, btTriangleInfoMap& map) {
  btGenerateInternalEdgeInfo(&shape, &map);
}

void find_edges(btHeightfieldTerrainShape& shape, btTriangleInfoMap& map) {
  btGenerateInternalEdgeInfo(&shape, &map);
}

void smooth_contacts(btRigidBody& body) {
  // One callback for all of Bullet; it is only called for bodies with the flag.
  static const bool is_installed = [] {
    gContactAddedCallback = &correct;
    return true;
  }();
  if (is_installed)
    body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
}

}  // namespace tessera::bullet
