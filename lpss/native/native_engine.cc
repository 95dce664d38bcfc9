#include "lpss/native/native_engine.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <variant>

#include "lpss/bullet/bullet_engine.h"
#include "lpss/bullet/collision_space.h"
#include "lpss/native/contact.h"
#include "lpss/native/native_solver.h"
#include "lpss/native/native_world.h"

namespace tessera::native {

Substepping substepping_of(const WorldSettings& settings) {
  static_assert(ContactNeeds::kSubstepsOfMany == kSubstepsMax);
  const auto* const uniform = std::get_if<UniformGravity>(&settings.gravity);
  return {.adapts = settings.adapt,
          .usual = settings.substeps,
          .gravity = uniform != nullptr ? uniform->acceleration.norm()
                                        : std::get<CentralGravity>(settings.gravity).surface,
          .time_step = settings.time_step};
}

std::unique_ptr<SectorWorld> NativeEngine::make_world() { return std::make_unique<NativeWorld>(*this); }

std::unique_ptr<IslandSolver> NativeEngine::make_solver() {
  return std::make_unique<NativeSolver>(settings_, needs_);
}

std::unique_ptr<StagedSolver> NativeEngine::make_staged_solver() {
  return std::make_unique<NativeSolver>(settings_, needs_);
}

bool NativeEngine::can_read(const ManifoldState& manifold) const {
  Contact contact;
  return decode(manifold.points, contact);
}

ManifoldState NativeEngine::turned(const ManifoldState& manifold, const Eigen::Matrix3d& turn) const {
  Contact contact;
  require(decode(manifold.points, contact), "contact points must come from an engine of the same precision");
  turn_contact(turn.cast<Scalar>(), contact);
  return {manifold.a, manifold.b, encode(contact)};
}

}  // namespace tessera::native

// The two symbols of the module. The first tells which classes of the engine it was built with.
extern "C" __attribute__((visibility("default"))) const char* tessera_engine_interface() {
  return TESSERA_ENGINE_INTERFACE;
}

// Creates the engine in this module's precision, owned by the caller; null if
// the settings specify another precision.
extern "C" __attribute__((visibility("default"))) tessera::Engine* tessera_make_engine(
    const tessera::EngineSettings* settings) {
  constexpr tessera::Precision kPrecision =
      sizeof(btScalar) == sizeof(float) ? tessera::Precision::kFloat32 : tessera::Precision::kFloat64;
  if (settings->precision != kPrecision) return nullptr;
  if (!settings->plain_bullet) return std::make_unique<tessera::native::NativeEngine>(*settings).release();
  gCalculateCombinedFrictionCallback = &tessera::bullet::smaller_friction;
  return std::make_unique<tessera::bullet::BulletEngine>(*settings).release();
}
