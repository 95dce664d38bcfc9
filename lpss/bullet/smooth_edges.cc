#include "lpss/bullet/smooth_edges.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cmath>

#include "lpss/bullet/conversions.h"

namespace tessera::bullet {
namespace {

using Eigen::Vector3d;

// Beyond this tilt (its cosine) a contact is with an edge that the neighbouring triangle covers.
constexpr btScalar kCovered(0.9999);

bool is_round(const btCollisionShape& shape) {
  return shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE || shape.getShapeType() == CAPSULE_SHAPE_PROXYTYPE;
}

// A contact farther than this from an edge has nothing to do with it.
constexpr double kEdgeReach = 0.1;  // m

// Neighbours whose normals lean out by less lie in one plane. (Its sine.)
constexpr double kFlat = 1e-4;

std::uint64_t key_of(int part, int index) {
  return std::uint64_t{static_cast<std::uint32_t>(part)} << 32 | static_cast<std::uint32_t>(index);
}

// The corner that an edge begins at, its unit direction and its length.
struct Edge {
  Edge(const TriangleEdges::Corners& corners, int n)
      : start(corners[n]),
        direction((corners[(n + 1) % 3] - start).normalized()),
        length((corners[(n + 1) % 3] - start).norm()) {}

  double distance_to(const Vector3d& point) const {
    const double along = std::clamp((point - start).dot(direction), 0.0, length);
    return (point - start - along * direction).norm();
  }

  const Vector3d start;
  const Vector3d direction;
  const double length;
};

// The triangle of a contact among its neighbours, in the frame of the mesh.
struct MeshTriangle {
  const TriangleEdges& edges;
  std::uint64_t key;
  TriangleEdges::Corners corners;

  // The contact normal that the neighbours leave to the triangle: at a flat or concave edge that of the face,
  // on the side of `found`; at a convex edge one between the normals of the two faces.
  Vector3d normal_at(const Vector3d& point, const Vector3d& found) const {
    const Vector3d winding = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    const double side = winding.dot(found) < 0 ? -1 : 1;
    const int n = nearest_edge(point);
    if (n < 0) return found;
    Vector3d face = side * winding;
    const Vector3d beyond = side * *edges.across(key, n);
    const Vector3d along = Edge(corners, n).direction;
    const Vector3d out = along.cross(winding);
    const double lean = beyond.dot(out);
    if (!(lean > kFlat)) return face;
    // Of the normal found, in the plane across the edge.
    const double outward = found.dot(out);
    const double upward = found.dot(face);
    if (outward <= 0 || beyond.dot(face) * outward <= lean * upward) return found;
    const double across = std::sqrt(outward * outward + upward * upward);
    return (along * along.dot(found) + beyond * across).normalized();
  }

  // Of those with a neighbour; -1 if none is near.
  int nearest_edge(const Vector3d& point) const {
    int nearest = -1;
    double least = kEdgeReach;
    for (int n = 0; n < 3; ++n) {
      const double distance = Edge(corners, n).distance_to(point);
      if (distance >= least || !edges.across(key, n)) continue;
      least = distance;
      nearest = n;
    }
    return nearest;
  }
};

TriangleEdges::Corners corners_of(const btVector3* corners) {
  return {to_eigen(corners[0]), to_eigen(corners[1]), to_eigen(corners[2])};
}

// A triangle handles its own face and outer edges. Towards an inner edge the normal is turned to one that is
// left to the face. But a point that is not reached yet, or on the flank of a ball, belongs to the neighbour:
// a rolling ball meets it from above, and would be thrown up. Such a point is moved out of reach, where the
// algorithm that found it drops it. Bullet's algorithms put the triangle second.
bool correct(btManifoldPoint& point, const btCollisionObjectWrapper* other, int, int,
             const btCollisionObjectWrapper* triangle, int part, int index) {
  const btCollisionObjectWrapper* const mesh = triangle->m_parent;
  if (triangle->getCollisionShape()->getShapeType() != TRIANGLE_SHAPE_PROXYTYPE || !mesh) return true;
  const auto* const edges = static_cast<const TriangleEdges*>(mesh->getCollisionShape()->getUserPointer());
  if (!edges) return true;
  const btTransform& pose = triangle->getWorldTransform();
  const auto& shape = static_cast<const btTriangleShape&>(*triangle->getCollisionShape());
  const btVector3 found = point.m_normalWorldOnB;
  const MeshTriangle posed{*edges, key_of(part, index), corners_of(shape.m_vertices1)};
  const Vector3d local = to_eigen(found * pose.getBasis());
  const Vector3d left = posed.normal_at(to_eigen(pose.invXform(point.m_positionWorldOnB)), local);
  if (left == local) return true;
  const btVector3 normal = pose.getBasis() * to_bullet(left);
  point.m_normalWorldOnB = normal;
  point.m_positionWorldOnB = point.m_positionWorldOnA - normal * point.getDistance();
  point.m_localPointB = pose.invXform(point.m_positionWorldOnB);
  if (normal.dot(found) > kCovered) return true;
  if (point.getDistance() <= 0 && !is_round(*other->getCollisionShape())) return true;
  point.m_localPointB = pose.invXform(point.m_positionWorldOnA - normal);
  return true;
}

}  // namespace

void find_edges(btConcaveShape& shape, TriangleEdges& edges) {
  struct Collector final : btTriangleCallback {
    explicit Collector(TriangleEdges& e) : edges(e) {}
    void processTriangle(btVector3* corners, int part, int index) override {
      edges.add(key_of(part, index), corners_of(corners));
    }
    TriangleEdges& edges;
  };
  btVector3 low;
  btVector3 high;
  shape.getAabb(btTransform::getIdentity(), low, high);
  Collector collector(edges);
  shape.processAllTriangles(&collector, low, high);
  edges.connect();
  shape.setUserPointer(&edges);
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
