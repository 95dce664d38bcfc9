// Contact points as bytes, with everything that a manifold needs to continue unchanged in another world.
#pragma once

#include <BulletCollision/NarrowPhaseCollision/btManifoldPoint.h>

#include <string>
#include <string_view>
#include <vector>

#include "lpss/bullet/compound_algorithm.h"

namespace tessera::bullet {

// One of the manifolds of a pair of bodies.
struct ManifoldRecord {
  ChildPair children;
  bool is_predictive = false;  // from a sweep: lives for one step
  bool is_swapped = false;     // Bullet's first body is the one with the higher id
  std::vector<btManifoldPoint> points;
};

// Equal manifolds give equal bytes: fields are written, not memory with padding.
std::string encode_manifolds(const std::vector<ManifoldRecord>& manifolds);

// False if the bytes are not output of encode_manifolds() in this precision.
bool decode_manifolds(std::string_view bytes, std::vector<ManifoldRecord>& manifolds);

}  // namespace tessera::bullet
