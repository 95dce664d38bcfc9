// One body of an engine world.
#pragma once

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <optional>

#include "lpss/bullet/bullet_engine.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

// An axis-aligned bounding box in the sector's frame, with the distance at which contacts are found.
struct Bounds {
  btVector3 low{0, 0, 0};
  btVector3 high{0, 0, 0};
};

// The state of a body in free flight, finer than the engine's numbers (EngineSettings::fine_flight), which
// are this state rounded.
struct FineFlight {
  Eigen::Vector3d position;
  Eigen::Vector3d velocity;
};

struct Body {
  Body(const BodyRecord& record, Role role, CollisionShapeRef shape, const EngineSettings& settings);

  static Body& of(const btCollisionObject* object) { return *static_cast<Body*>(object->getUserPointer()); }

  bool is_dynamic() const { return motion == Motion::kDynamic; }
  bool is_awake() const { return rigid.isActive(); }
  bool lives_here() const { return role == Role::kHome && motion != Motion::kStatic; }

  BodyState state() const;
  void set_state(const BodyState& state);
  Activity activity() const;
  FineFlight rounded() const;

  const BodyId id;
  const Role role;
  const Motion motion;
  const std::uint32_t category;
  const std::uint32_t mask;
  const std::uint64_t assembly;
  const bool feels_gravity;
  const bool is_damped;
  const bool flies_fine;
  const CollisionShapeRef shape;
  BodySlot slot = -1;
  BodyState static_state;     // of static bodies, whose Bullet pose includes the offset of their shape
  btScalar swept_beyond = 0;  // m per step; 0: never swept
  btScalar swept_radius = 0;
  btScalar radius = 0;             // m, of dynamic bodies: a ball around the centre holds the shape
  std::optional<FineFlight> fine;  // none if the engine's numbers are the exact state
  bool jointed = false;
  bool coasts = false;  // until integrate()
  btTransform next;     // where integrate() moves the body
  btRigidBody rigid;
};

Bounds bounds_at(const Body& body, const btTransform& pose);

// Whether the box is finite and of a reasonable size.
bool is_sensible(const Bounds& bounds);

// Whether contacts of the pair are detected, as far as properties decide.
bool is_wanted_pair(const Body& a, const Body& b);

// Has a broadphase keep such pairs alone.
struct PairFilter final : btOverlapFilterCallback {
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override;
};

}  // namespace tessera::bullet
