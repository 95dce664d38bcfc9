// One body of an engine world.
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include "lpss/bullet/bullet_engine.h"
#include "lpss/engine/engine.h"

namespace tessera::bullet {

struct Body {
  Body(const BodyRecord& record, Role role, CollisionShapeRef shape);

  static Body& of(const btCollisionObject* object) { return *static_cast<Body*>(object->getUserPointer()); }

  bool is_dynamic() const { return motion == Motion::kDynamic; }
  bool is_awake() const { return rigid.isActive(); }
  bool lives_here() const { return role == Role::kHome && motion != Motion::kStatic; }

  BodyState state() const;
  void set_state(const BodyState& state);
  Activity activity() const;

  const BodyId id;
  const Role role;
  const Motion motion;
  const std::uint32_t category;
  const std::uint32_t mask;
  const std::uint64_t assembly;
  const bool feels_gravity;
  const bool is_damped;
  const CollisionShapeRef shape;
  BodySlot slot = -1;
  BodyState static_state;     // of static bodies, whose Bullet pose includes the offset of their shape
  btScalar swept_beyond = 0;  // m a step; 0: never swept
  btScalar swept_radius = 0;
  btTransform next;  // where integrate() moves the body
  btRigidBody rigid;
};

// Whether contacts of the pair are looked for, as far as properties and roles decide it.
bool is_wanted_pair(const Body& a, const Body& b, CloneContacts clone_contacts);

}  // namespace tessera::bullet
