#include "lpss/bullet/collision_shape.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>
#include <cmath>

#include "lpss/base/invariant.h"
#include "lpss/bullet/conversions.h"
#include "lpss/bullet/ellipsoid_shape.h"
#include "lpss/bullet/smooth_edges.h"
#include "lpss/bullet/triangle_tree.h"

namespace tessera::bullet {
namespace {

using Data = std::vector<std::shared_ptr<void>>;

btScalar safe_margin(double smallest_extent) {
  return btScalar(std::min<double>(CONVEX_DISTANCE_MARGIN, 0.05 * smallest_extent));
}

std::unique_ptr<btCollisionShape> make_hull(const ConvexHull& hull) {
  // Three doubles per point, packed.
  btConvexHullComputer computer;
  const btScalar margin = safe_margin(smallest_extent(Shape{{{hull, {}}}}));
  const double* points = hull.points.front().data();
  const int count = static_cast<int>(hull.points.size());
  btScalar shrunk = computer.compute(points, 3 * sizeof(double), count, margin, btScalar(0.5));
  if (shrunk < 0 || computer.vertices.size() < 4) {
    // Too thin for a core: use the points themselves, with a tiny margin.
    shrunk = margin * btScalar(0.01);
    auto shape = std::make_unique<btConvexHullShape>();
    for (const Eigen::Vector3d& p : hull.points) shape->addPoint(to_bullet(p), false);
    shape->recalcLocalAabb();
    shape->setMargin(shrunk);
    return shape;
  }
  auto shape = std::make_unique<btConvexHullShape>();
  for (int i = 0; i < computer.vertices.size(); ++i) shape->addPoint(computer.vertices[i], false);
  shape->setMargin(shrunk);
  shape->recalcLocalAabb();
  return shape;
}

void add_edges(btCollisionShape& shape, Data& data) {
  const int type = shape.getShapeType();
  if (type != TRIANGLE_MESH_SHAPE_PROXYTYPE && type != TERRAIN_SHAPE_PROXYTYPE) return;
  auto edges = std::make_shared<TriangleEdges>();
  find_edges(static_cast<btConcaveShape&>(shape), *edges);
  data.push_back(std::move(edges));
}

std::unique_ptr<btCollisionShape> make_mesh(const TriangleMesh& mesh, CollisionShape::Use use, Data& data) {
  struct Arrays {
    std::vector<btVector3> vertices;
    std::vector<int> indices;
    btTriangleIndexVertexArray view;
  };
  auto arrays = std::make_shared<Arrays>();
  for (const Eigen::Vector3d& v : mesh.vertices) arrays->vertices.push_back(to_bullet(v));
  arrays->indices.assign(mesh.indices.begin(), mesh.indices.end());
  btIndexedMesh part;
  part.m_numTriangles = static_cast<int>(arrays->indices.size() / 3);
  part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(arrays->indices.data());
  part.m_triangleIndexStride = 3 * sizeof(int);
  part.m_numVertices = static_cast<int>(arrays->vertices.size());
  part.m_vertexBase = reinterpret_cast<const unsigned char*>(arrays->vertices.data());
  part.m_vertexStride = sizeof(btVector3);
  arrays->view.addIndexedMesh(part, PHY_INTEGER);
  data.push_back(arrays);
  if (use == CollisionShape::Use::kContacts)
    return std::make_unique<btBvhTriangleMeshShape>(&arrays->view, /*useQuantizedAabbCompression=*/true);
  const auto tree = std::make_shared<TriangleTree>(arrays->vertices, arrays->indices);
  data.push_back(tree);
  arrays->view.setPremadeAabb(tree->low(), tree->high());
  auto shape = std::make_unique<btBvhTriangleMeshShape>(&arrays->view, /*useQuantizedAabbCompression=*/true,
                                                        /*buildBvh=*/false);
  shape->setOptimizedBvh(tree.get());
  return shape;
}

// Bullet puts the middle of the heights at the shape's origin; `pose` is moved to compensate.
std::unique_ptr<btCollisionShape> make_height_field(const HeightField& field, btTransform& pose, Data& data) {
  auto heights = std::make_shared<std::vector<btScalar>>(field.heights.begin(), field.heights.end());
  const auto [low, high] = std::minmax_element(heights->begin(), heights->end());
  auto shape = std::make_unique<btHeightfieldTerrainShape>(
      static_cast<int>(field.columns), static_cast<int>(field.rows), heights->data(), *low, *high,
      /*upAxis=*/2, /*flipQuadEdges=*/false);
  shape->setLocalScaling({btScalar(field.spacing.x()), btScalar(field.spacing.y()), 1});
  pose.setOrigin(pose * btVector3(0, 0, (*low + *high) / 2));
  data.push_back(std::move(heights));
  return shape;
}

struct MakePart {
  btTransform& pose;
  CollisionShape::Use use;
  Data& data;

  std::unique_ptr<btCollisionShape> operator()(const tessera::Box& box) const {
    return std::make_unique<btBoxShape>(to_bullet(Eigen::Vector3d(box.size / 2)));
  }
  std::unique_ptr<btCollisionShape> operator()(const Sphere& sphere) const {
    return std::make_unique<btSphereShape>(btScalar(sphere.radius));
  }
  std::unique_ptr<btCollisionShape> operator()(const Capsule& capsule) const {
    return std::make_unique<btCapsuleShapeZ>(btScalar(capsule.radius), btScalar(capsule.length));
  }
  std::unique_ptr<btCollisionShape> operator()(const Cylinder& cylinder) const {
    const btScalar radius(cylinder.radius);
    return std::make_unique<btCylinderShapeZ>(btVector3(radius, radius, btScalar(cylinder.length / 2)));
  }
  std::unique_ptr<btCollisionShape> operator()(const Ellipsoid& ellipsoid) const {
    return std::make_unique<EllipsoidShape>(to_bullet(ellipsoid.radii));
  }
  std::unique_ptr<btCollisionShape> operator()(const Plane& plane) const {
    return std::make_unique<btStaticPlaneShape>(to_bullet(plane.normal), btScalar(0));
  }
  std::unique_ptr<btCollisionShape> operator()(const ConvexHull& hull) const { return make_hull(hull); }
  std::unique_ptr<btCollisionShape> operator()(const TriangleMesh& mesh) const {
    return make_mesh(mesh, use, data);
  }
  std::unique_ptr<btCollisionShape> operator()(const HeightField& field) const {
    return make_height_field(field, pose, data);
  }
  std::unique_ptr<btCollisionShape> operator()(const Ground&) const {
    invariant(false, "an engine gets parts of ground as triangles");
    return nullptr;
  }
};

// Puts the pose of a lone hull into its points, so that its bodies need no compound.
ConvexHull baked(const ConvexHull& hull, const Pose& pose) {
  ConvexHull result = hull;
  for (Eigen::Vector3d& p : result.points) p = pose * p;
  return result;
}

}  // namespace

CollisionShape::CollisionShape(const Shape& shape, const Pose& centre, bool is_static, Use use) {
  const bool is_centred = centre.is_identity();  // keeps part poses free of rounding
  std::vector<std::pair<btTransform, btCollisionShape*>> children;
  for (const ShapePart& part : shape.parts) {
    const Pose placed = is_centred ? part.pose : centre.inverse() * part.pose;
    const auto* lone_hull = shape.parts.size() == 1 ? std::get_if<ConvexHull>(&part.geometry) : nullptr;
    const bool is_unmoved = lone_hull || placed.is_identity();
    btTransform pose = is_unmoved ? btTransform::getIdentity() : to_bullet(placed);
    btCollisionShape* child =
        lone_hull ? build_part(baked(*lone_hull, placed), pose, use) : build_part(part.geometry, pose, use);
    if (use == Use::kContacts) add_edges(*child, data_);
    children.emplace_back(pose, child);
  }
  if (children.size() == 1 && (is_static || children[0].first == btTransform::getIdentity())) {
    offset_ = children[0].first;
    root_ = children[0].second;
    if (root_->isConvex()) swept_extent_ = btScalar(smallest_extent(shape));
    return;
  }
  auto compound =
      std::make_unique<btCompoundShape>(/*enableDynamicAabbTree=*/true, static_cast<int>(children.size()));
  for (const auto& [pose, child] : children) compound->addChildShape(pose, child);
  root_ = compound.get();
  shapes_.push_back(std::move(compound));
}

btCollisionShape* CollisionShape::build_part(const Geometry& geometry, btTransform& pose, Use use) {
  shapes_.push_back(std::visit(MakePart{pose, use, data_}, geometry));
  return shapes_.back().get();
}

}  // namespace tessera::bullet
