#include "lpss/bullet/discrete_world.h"

#include <utility>
#include <variant>

#include "lpss/bullet/conversions.h"

namespace tessera::bullet {

DiscreteWorld::DiscreteWorld(BulletEngine& engine)
    : engine_(engine),
      dispatcher_(&configuration_),
      world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
  const EngineSettings& settings = engine.settings();
  broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&filter_);
  btContactSolverInfo& info = world_.getSolverInfo();
  info.m_numIterations = settings.solver_iterations;
  if (settings.friction_in_two_directions) info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  const auto* uniform = std::get_if<UniformGravity>(&settings.gravity);
  world_.setGravity(uniform ? to_bullet(uniform->acceleration) : btVector3(0, 0, 0));
}

DiscreteWorld::~DiscreteWorld() {
  for (const auto& [id, joint] : joints_) world_.removeConstraint(joint.get());
  // All pairs first: removed body by body, each would be looked for among all.
  btOverlappingPairCache& pairs = *broadphase_.getOverlappingPairCache();
  while (pairs.getNumOverlappingPairs() > 0) {
    const btBroadphasePair& last = pairs.getOverlappingPairArray()[pairs.getNumOverlappingPairs() - 1];
    pairs.removeOverlappingPair(last.m_pProxy0, last.m_pProxy1, &dispatcher_);
  }
  for (auto body = bodies_.rbegin(); body != bodies_.rend(); ++body) world_.removeRigidBody(&(*body)->rigid);
}

BodySlot DiscreteWorld::add(const BodyRecord& record) {
  const EngineSettings& settings = engine_.settings();
  const auto slot = static_cast<BodySlot>(bodies_.size());
  bodies_.push_back(std::make_unique<Body>(
      record, record.properties.motion == Motion::kStatic ? Role::kStatic : Role::kHome,
      engine_.shape_of(record.properties), settings));
  Body& added = *bodies_.back();
  added.slot = slot;
  if (!added.feels_gravity) added.rigid.setFlags(added.rigid.getFlags() | BT_DISABLE_WORLD_GRAVITY);
  if (settings.continuous_collision) {
    added.rigid.setCcdMotionThreshold(added.swept_beyond);
    added.rigid.setCcdSweptSphereRadius(added.swept_radius);
  }
  world_.addRigidBody(&added.rigid);
  if (settings.sleep_after == 0 && added.motion != Motion::kStatic)
    added.rigid.forceActivationState(DISABLE_DEACTIVATION);
  return slot;
}

void DiscreteWorld::set_joint(const JointRecord& joint, BodySlot child_slot, BodySlot parent_slot,
                              const Pose& in_parent) {
  btRigidBody& child = body(child_slot).rigid;
  btRigidBody& parent = parent_slot == kNoSlot ? btTypedConstraint::getFixedBody() : body(parent_slot).rigid;
  btTransform frame = to_bullet(in_parent);
  if (parent_slot != kNoSlot && body(parent_slot).motion == Motion::kStatic)
    frame = body(parent_slot).shape->offset().inverse() * frame;  // a static body's pose includes it
  std::unique_ptr<btTypedConstraint>& kept = joints_[joint.id];
  if (kept) world_.removeConstraint(kept.get());
  kept = make_joint(joint, parent, frame, child);
  world_.addConstraint(kept.get());
  if (!joint.properties.bodies_collide && parent_slot != kNoSlot) {
    child.setIgnoreCollisionCheck(&parent, true);
    parent.setIgnoreCollisionCheck(&child, true);
  }
  child.activate(true);
}

void DiscreteWorld::set_gravity(BodySlot slot, const Eigen::Vector3d& acceleration) {
  if (body(slot).feels_gravity) body(slot).rigid.setGravity(to_bullet(acceleration));
}

void DiscreteWorld::step(double dt) { world_.stepSimulation(btScalar(dt), /*maxSubSteps=*/0); }

BodyState DiscreteWorld::state(BodySlot slot) const {
  return bodies_[static_cast<std::size_t>(slot)]->state();
}

}  // namespace tessera::bullet
