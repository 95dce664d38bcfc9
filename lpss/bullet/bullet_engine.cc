#include "lpss/bullet/bullet_engine.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "lpss/bullet/bullet_solver.h"
#include "lpss/bullet/bullet_world.h"

namespace tessera::bullet {

#ifdef BT_USE_DOUBLE_PRECISION
constexpr Precision kPrecision = Precision::kFloat64;
#else
constexpr Precision kPrecision = Precision::kFloat32;
#endif

void require(bool holds, const char* rule) {
  if (holds) return;
  std::fprintf(stderr, "tessera engine: %s\n", rule);
  std::abort();
}

void BulletEngine::add_shape(ShapeId id, const Shape& shape) {
  const std::lock_guard lock(mutex_);
  shapes_.emplace(id, shape);
}

std::unique_ptr<SectorWorld> BulletEngine::make_world() { return std::make_unique<BulletWorld>(*this); }

std::unique_ptr<IslandSolver> BulletEngine::make_solver() {
  return std::make_unique<BulletSolver>(settings_);
}

void BulletEngine::set_apart(BodyId a, BodyId b, bool apart) {
  const std::uint64_t key = pair_key(a, b);
  if (apart) {
    ++apart_[key];
  } else if (const auto entry = apart_.find(key); entry != apart_.end() && --entry->second == 0) {
    apart_.erase(entry);
  }
}

CollisionShapeRef BulletEngine::shape_of(const BodyProperties& properties) {
  const bool is_static = properties.motion == Motion::kStatic;
  const ShapeKey key{properties.shape, properties.centre, properties.principal_axes, is_static};
  const std::lock_guard lock(mutex_);
  CollisionShapeRef& built = built_[key];
  if (!built) {
    const auto shape = shapes_.find(properties.shape);
    require(shape != shapes_.end(), "a body's shape must be added before the body");
    built = std::make_shared<CollisionShape>(shape->second, centre_frame(properties), is_static);
  }
  return built;
}

}  // namespace tessera::bullet

// The only symbol of the module: creates the engine in this module's precision, owned by the caller; null if
// the settings specify another precision.
extern "C" __attribute__((visibility("default"))) tessera::Engine* tessera_make_engine(
    const tessera::EngineSettings* settings) {
  if (settings->precision != tessera::bullet::kPrecision) return nullptr;
  gCalculateCombinedFrictionCallback = &tessera::bullet::smaller_friction;
  return std::make_unique<tessera::bullet::BulletEngine>(*settings).release();
}
