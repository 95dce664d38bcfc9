#include "lpss/bullet/bullet_world.h"

#include <utility>

#include "lpss/bullet/conversions.h"

namespace tessera::bullet {

BulletWorld::BulletWorld(BulletEngine& engine) : engine_(engine), settings_(engine.settings()) {}

BulletWorld::~BulletWorld() {
  release(predictive_);
  space_.reset();  // before its bodies
}

CollisionSpace& BulletWorld::space() const {
  if (space_) return *space_;
  space_ = std::make_unique<CollisionSpace>(engine_);
  for (const std::unique_ptr<Body>& only : bodies_) {
    if (only) space_->add(*only, lone_bounds_);
  }
  return *space_;
}

// A lone body needs no space.
void BulletWorld::leave_space() {
  if (!space_ || slots_.size() > 1) return;
  for (const std::unique_ptr<Body>& only : bodies_) {
    if (only) lone_bounds_ = CollisionSpace::bounds_of(*only);
  }
  space_.reset();
}

BodySlot BulletWorld::add(const BodyRecord& record, Role role) {
  return add(std::make_unique<Body>(record, role, engine_.shape_of(record.properties), settings_));
}

BodySlot BulletWorld::add_static(BodyId id, const BodyProperties& properties, const Shape& part,
                                 const Pose& pose) {
  BodyRecord record{id, {}, properties, {}};
  record.properties.motion = Motion::kStatic;
  record.state.position = {pose.position.x(), pose.position.y(), pose.position.z()};
  record.state.rotation = rotation_of(pose.orientation);
  record.state.activity = Activity::kAsleep;
  auto shape = std::make_shared<CollisionShape>(part, Pose{}, /*is_static=*/true);
  return add(std::make_unique<Body>(record, Role::kStatic, std::move(shape), settings_));
}

BodySlot BulletWorld::add(std::unique_ptr<Body> added) {
  require(added->id.value > 0 && added->id.value <= kBulletBodyIdMax,
          "a body's id must be 1 to kBulletBodyIdMax");
  const bool is_new = slots_.emplace(added->id.value, 0).second;
  require(is_new, "a body may be in a world once");
  if (slots_.size() > 1) space();
  BodySlot slot = static_cast<BodySlot>(bodies_.size());
  if (free_slots_.empty()) {
    bodies_.push_back(nullptr);
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  added->slot = slot;
  slots_[added->id.value] = slot;
  Body& body = *added;
  bodies_[static_cast<std::size_t>(slot)] = std::move(added);
  if (space_) space_->add(body, {});
  set_bounds_to_pose(body);
  return slot;
}

void BulletWorld::remove(BodySlot slot) {
  Body& gone = body(slot);
  release_of(gone, predictive_);
  if (space_) space_->remove(gone);
  slots_.erase(gone.id.value);
  bodies_[static_cast<std::size_t>(slot)] = nullptr;
  free_slots_.push_back(slot);
  is_gathered_ = false;
}

void BulletWorld::set_state(BodySlot slot, const BodyState& state) {
  body(slot).set_state(state);
  set_bounds_to_pose(body(slot));
}

Eigen::Vector3d BulletWorld::position(BodySlot slot) const {
  const Body& b = body(slot);
  if (b.motion == Motion::kStatic) return Eigen::Map<const Eigen::Vector3d>(b.static_state.position.data());
  return b.fine ? b.fine->position : to_eigen(b.rigid.getWorldTransform().getOrigin());
}

Eigen::Vector3d BulletWorld::linear_velocity(BodySlot slot) const {
  const Body& b = body(slot);
  return b.fine ? b.fine->velocity : to_eigen(b.rigid.getLinearVelocity());
}

void BulletWorld::set_velocity(BodySlot slot, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
  Body& changed = body(slot);
  changed.fine.reset();
  changed.rigid.setLinearVelocity(to_bullet(linear));
  changed.rigid.setAngularVelocity(to_bullet(angular));
}

void BulletWorld::apply_impulse(BodySlot slot, const Eigen::Vector3d& impulse, const Eigen::Vector3d& lever) {
  body(slot).fine.reset();
  body(slot).rigid.applyImpulse(to_bullet(impulse), to_bullet(lever));
}

void BulletWorld::add_wrench(BodySlot slot, const Wrench& wrench) {
  body(slot).rigid.applyCentralForce(to_bullet(wrench.force));
  body(slot).rigid.applyTorque(to_bullet(wrench.torque));
}

void BulletWorld::set_gravity(BodySlot slot, const Eigen::Vector3d& acceleration) {
  if (body(slot).feels_gravity) body(slot).rigid.setGravity(to_bullet(acceleration));
}

void BulletWorld::sleep(BodySlot slot) {
  Body& sleeper = body(slot);
  if (sleeper.motion == Motion::kStatic) return;
  sleeper.fine.reset();
  sleeper.rigid.setLinearVelocity(btVector3(0, 0, 0));
  sleeper.rigid.setAngularVelocity(btVector3(0, 0, 0));
  sleeper.rigid.setInterpolationWorldTransform(sleeper.rigid.getWorldTransform());
  sleeper.rigid.forceActivationState(ISLAND_SLEEPING);
  set_bounds_to_pose(sleeper);
}

void BulletWorld::wake(BodySlot slot) {
  if (body(slot).motion == Motion::kStatic) return;
  body(slot).rigid.forceActivationState(ACTIVE_TAG);
  body(slot).rigid.setDeactivationTime(0);
}

Wrench BulletWorld::total_wrench(BodySlot slot) const {
  return {to_array(body(slot).rigid.getTotalForce()), to_array(body(slot).rigid.getTotalTorque())};
}

void BulletWorld::set_total_wrench(BodySlot slot, const Wrench& wrench) {
  body(slot).rigid.clearForces();
  add_wrench(slot, wrench);
}

}  // namespace tessera::bullet
