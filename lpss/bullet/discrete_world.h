// Bullet as its users have it: one btDiscreteDynamicsWorld, with its own collision algorithms, step, sleep
// and constraints.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btDefaultCollisionConfiguration.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include <map>
#include <memory>
#include <vector>

#include "lpss/bullet/bullet_body.h"
#include "lpss/bullet/bullet_engine.h"
#include "lpss/bullet/bullet_joints.h"
#include "lpss/engine/whole_world.h"

namespace tessera::bullet {

// Of the settings, these count: the number of passes, friction in two directions, sweeps of fast bodies,
// uniform gravity, and whether bodies sleep at all; then they do by Bullet's own limits. All else is Bullet's
// default.
class DiscreteWorld final : public WholeWorld {
 public:
  explicit DiscreteWorld(BulletEngine& engine);
  ~DiscreteWorld() override;

  BodySlot add(const BodyRecord& record) override;
  void set_joint(const JointRecord& joint, BodySlot child, BodySlot parent, const Pose& in_parent) override;
  void set_gravity(BodySlot slot, const Eigen::Vector3d& acceleration) override;
  void step(double dt) override;
  BodyState state(BodySlot slot) const override;

 private:
  Body& body(BodySlot slot) { return *bodies_[static_cast<std::size_t>(slot)]; }

  BulletEngine& engine_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  PairFilter filter_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  std::vector<std::unique_ptr<Body>> bodies_;  // by slot
  std::map<JointId, std::unique_ptr<btTypedConstraint>> joints_;
};

}  // namespace tessera::bullet
