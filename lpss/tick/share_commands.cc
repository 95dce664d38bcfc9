// What clients asked for. Every share sees every command; the one that hosts the body carries it out, and
// those that know the body as a ghost forget what no longer holds.
#include <algorithm>
#include <type_traits>

#include "lpss/base/invariant.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

Eigen::Vector3d vector(const std::array<double, 3>& v) { return Eigen::Vector3d(v.data()); }

// The velocities that carry a body from one state to another in `dt`; positions relative to the same sector.
void set_velocities_between(BodyState& from, const BodyState& to, double dt) {
  Eigen::Map<Eigen::Vector3d>(from.linear_velocity.data()) =
      (vector(to.position) - vector(from.position)) / dt;
  const Eigen::AngleAxisd turn(quaternion_of(to) * quaternion_of(from).conjugate());
  Eigen::Map<Eigen::Vector3d>(from.angular_velocity.data()) = turn.axis() * (turn.angle() / dt);
}

}  // namespace

// Wakes the body's neighbours on this share and takes its clones out of the engine worlds: it is about to go
// away, or to be somewhere else.
void Share::lift_clones(BodyId id) {
  const auto ghost = ghosts_.find(id);
  if (ghost == ghosts_.end()) return;
  for (const SectorIndex& place : ghost->second->places) {
    Sector& sector = *sectors_.at(place);
    Clone& clone = sector.clones.at(id);
    if (clone.slot == Clone::kNotPlaced) continue;
    wake_touching(sector, clone.slot);
    unplace_clone(sector, clone);
  }
}

void Share::forget_moves(BodyId id) {
  std::erase(leaving_, id);
  std::erase(moving_ghosts_, id);
}

void Share::remove(BodyId id) {
  remove_joints_of(id);
  remove_static(id);
  lift_clones(id);
  forget_moves(id);
  forget_ghost(id);
  const auto body = bodies_.find(id);
  if (body == bodies_.end()) return;
  wake_touching(*body->second->sector, body->second->slot);
  remove_home(*body->second);
}

void Share::teleport(const Teleport& jump) {
  if (const BodyRecord* fixed = statics_.find(jump.id)) {
    BodyRecord moved = *fixed;
    moved.home = jump.home;
    moved.state = jump.state;
    remove_static(jump.id);
    spawn_static(moved);
    for (const JointId joint : joints_.of(jump.id)) wake_jointed(*joints_.find(joint));
    return;
  }
  lift_clones(jump.id);
  forget_moves(jump.id);
  const auto found = bodies_.find(jump.id);
  if (found == bodies_.end()) return;
  HomeBody& body = *found->second;
  wake_touching(*body.sector, body.slot);
  Handover handover;
  handover.targets = body.targets;  // of the old home; move_homes() needs them to tell who had clones
  handover.everywhere = body.everywhere;
  const SectorIndex old_home = body.sector->index;
  handover.record = remove_home(body);
  handover.record.home = jump.home;
  handover.record.state = jump.state;
  jumps_.push_back({std::move(handover), old_home});
}

void Share::set_goal(const KinematicTarget& target) {
  const auto found = bodies_.find(target.id);
  if (found == bodies_.end()) return;
  HomeBody& body = *found->second;
  BodyState now = body.sector->world->state(body.slot);
  BodyState goal = target.state;
  const Eigen::Vector3d position =
      metres_between(body.sector->index, target.home, size()) + vector(target.state.position);
  Eigen::Map<Eigen::Vector3d>(goal.position.data()) = position;
  set_velocities_between(now, goal, dt());
  now.activity = Activity::kAwake;
  body.sector->world->set_state(body.slot, now);
  goal.linear_velocity = {};
  goal.angular_velocity = {};
  body.goal = goal;
  body.news = true;
  activate(*body.sector);
}

void Share::apply(const Command& command) {
  const auto with_body = [&](BodyId id, auto&& change) {
    const auto found = bodies_.find(id);
    if (found == bodies_.end()) return;
    HomeBody& body = *found->second;
    SectorWorld& world = *body.sector->world;
    world.wake(body.slot);
    change(world, body);
    body.news = true;
    activate(*body.sector);
  };
  std::visit(
      [&](const auto& c) {
        using C = std::decay_t<decltype(c)>;
        if constexpr (std::is_same_v<C, SpawnBody>) {
          add_body(c.record);
        } else if constexpr (std::is_same_v<C, RemoveBody>) {
          remove(c.id);
        } else if constexpr (std::is_same_v<C, Teleport>) {
          teleport(c);
        } else if constexpr (std::is_same_v<C, KinematicTarget>) {
          set_goal(c);
        } else if constexpr (std::is_same_v<C, AddJoint>) {
          add_joint(c.record);
        } else if constexpr (std::is_same_v<C, RemoveJoint>) {
          remove_joint(c.id);
        } else if constexpr (std::is_same_v<C, SetDrives>) {
          set_drives(c);
        } else if constexpr (std::is_same_v<C, SetVelocity>) {
          with_body(c.id, [&](SectorWorld& world, HomeBody& body) {
            world.set_velocity(body.slot, vector(c.linear), vector(c.angular));
          });
        } else if constexpr (std::is_same_v<C, ApplyImpulse>) {
          with_body(c.id, [&](SectorWorld& world, HomeBody& body) {
            world.apply_impulse(body.slot, vector(c.impulse), vector(c.lever));
          });
        } else {
          static_assert(std::is_same_v<C, ApplyForce>);
          with_body(c.id, [&](SectorWorld& world, HomeBody& body) { world.add_wrench(body.slot, c.wrench); });
        }
      },
      command);
}

}  // namespace tessera
