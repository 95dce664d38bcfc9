// Surfaces without interior: triangle meshes and height fields.
#pragma once

#include <BulletCollision/BroadphaseCollision/btQuantizedBvh.h>
#include <absl/container/inlined_vector.h>

#include <cstdint>
#include <vector>

#include "lpss/collision/collide.h"
#include "lpss/model/shape.h"
#include "lpss/native/math.h"

namespace tessera::native {

using collision::MeshTriangle;

// In the frame of the geometry; immutable.
class Terrain {
 public:
  struct Found {
    std::uint32_t index;  // of the triangle, for its whole life; of ground, its name
    MeshTriangle<Scalar> triangle;
  };
  using List = absl::InlinedVector<Found, 8>;

  virtual ~Terrain() = default;

  // The triangles whose boxes overlap `bounds`, in the order of the geometry.
  virtual void near(const Bounds& bounds, List& found) const = 0;
};

// `tree` holds the triangles of `mesh` under their places in it, and outlives the terrain.
std::unique_ptr<Terrain> make_terrain(const TriangleMesh& mesh, const btQuantizedBvh& tree);
std::unique_ptr<Terrain> make_terrain(const HeightField& field);

}  // namespace tessera::native
