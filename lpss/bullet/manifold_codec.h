// Contact points as bytes: what a manifold needs to go on elsewhere as if nothing had happened.
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
  bool is_predictive = false;  // of a sweep: lives for one step
  bool is_swapped = false;     // Bullet's first body is the one with the higher id
  std::vector<btManifoldPoint> points;
};

// Equal manifolds give equal bytes: fields, not memory with its gaps.
std::string encode_manifolds(const std::vector<ManifoldRecord>& manifolds);

// False where the bytes are not what encode_manifolds() makes in this precision.
bool decode_manifolds(std::string_view bytes, std::vector<ManifoldRecord>& manifolds);

}  // namespace tessera::bullet
