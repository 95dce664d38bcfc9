// Bullet's shapes for the shapes of a world.
//
// Shapes have their exact size: margins, which Bullet's distance algorithms need, are inside the shape, and
// small enough that even a body of a millimetre keeps a core.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <LinearMath/btTransform.h>

#include <memory>
#include <vector>

#include "lpss/model/shape.h"

namespace tessera::bullet {

// A shape in Bullet's form; immutable, so worlds and threads share it.
class CollisionShape {
 public:
  // What the shape is for. Contacts with a surface need to know which of its triangles are neighbours, and
  // are found by Bullet's own tree; casts take a TriangleTree.
  enum class Use { kContacts, kCastsAlone };

  // `centre` is the centre frame in the body frame. Moving bodies get their parts posed in the centre frame.
  // A static body of one part (`is_static`) gets the bare part and the pose of it in `offset`, to be applied
  // to the body's own pose: large terrain is then searched without an intermediate compound.
  CollisionShape(const Shape& shape, const Pose& centre, bool is_static, Use use = Use::kContacts);

  // Bullet takes non-constant pointers to shapes, but does not change them.
  btCollisionShape* root() const { return root_; }
  const btTransform& offset() const { return offset_; }

  // The scale for sweeps, in metres; 0 for shapes that are not swept: compounds (a ring's centre is outside
  // of it, and only a ball at the centre is swept) and surfaces.
  btScalar swept_extent() const { return swept_extent_; }

 private:
  btCollisionShape* build_part(const Geometry& geometry, btTransform& pose, Use use);

  std::vector<std::shared_ptr<void>> data_;  // arrays that shapes refer to; outlive the shapes
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  btCollisionShape* root_ = nullptr;
  btTransform offset_ = btTransform::getIdentity();
  btScalar swept_extent_ = 0;
};

}  // namespace tessera::bullet
