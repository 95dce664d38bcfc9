#include "lpss/tick/commands.h"

#include <absl/container/btree_map.h>

#include <algorithm>
#include <concepts>
#include <optional>
#include <type_traits>

#include "lpss/base/rotation.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/packing.h"
#include "lpss/partition/replicas.h"
#include "lpss/partition/sectors.h"
#include "lpss/partition/statics.h"

namespace tessera {
namespace {

Eigen::Vector3d vector(const std::array<double, 3>& v) { return Eigen::Vector3d(v.data()); }

// The velocities that carry a body from one state to another in `dt`; positions relative to the same sector.
void set_velocities_between(BodyState& from, const BodyState& to, double dt) {
  Eigen::Map<Eigen::Vector3d>(from.linear_velocity.data()) =
      (vector(to.position) - vector(from.position)) / dt;
  const Eigen::Quaterniond turn = quaternion_of(to) * quaternion_of(from).conjugate();
  Eigen::Map<Eigen::Vector3d>(from.angular_velocity.data()) = rotation_vector(turn) / dt;
}

// Turns a body at `next`, whose position is that of the body frame, as it is turned `now`; the position is
// then that of its centre.
void keep_rotation(const BodyProperties& properties, const BodyState& now, BodyState& next) {
  next.rotation = now.rotation;
  const Pose centre = centre_frame(properties);
  const Eigen::Quaterniond body_frame = quaternion_of(now) * centre.orientation.conjugate();
  Eigen::Map<Eigen::Vector3d>(next.position.data()) += body_frame * centre.position;
}

// Puts a body where a teleport says, and leaves the rest of it as it is.
void carry_out(const Teleport& jump, double sector_size, BodyRecord& record) {
  const BodyState now = record.state;
  record.home = jump.home;
  record.state = jump.state;
  if (jump.keeps_linear_velocity) record.state.linear_velocity = now.linear_velocity;
  if (jump.keeps_angular_velocity) record.state.angular_velocity = now.angular_velocity;
  if (!jump.keeps_rotation) return;
  keep_rotation(record.properties, now, record.state);
  const auto place = canonical(jump.home, vector(record.state.position), sector_size);
  if (!place.ok()) return;  // beyond the last sector: its centre stays outside of that one
  record.home = place->sector;
  Eigen::Map<Eigen::Vector3d>(record.state.position.data()) = place->local;
}

void forget_moves(Partition& partition, BodyId id) {
  std::erase(partition.leaving, id);
  std::erase(partition.moving_replicas, id);
}

void remove_body(Partition& partition, BodyId id) {
  remove_joints_of(partition, id);
  remove_static_body(partition, id);
  lift_clones(partition, id);
  forget_moves(partition, id);
  forget_replica(partition, id);
  const auto body = partition.bodies.find(id);
  if (body == partition.bodies.end()) return;
  wake_touching(partition, *body->second->sector, body->second->slot);
  remove_home(partition, *body->second);
}

// The teleports of a tick, which end it: until then, a body is where it was, with the orientation and the
// velocities that it lands with, so that other commands of the tick find it.
class Landings {
 public:
  void add(Partition& partition, const Teleport& jump) {
    if (partition.statics.find(jump.id)) return move_static(partition, jump);
    jumps_.insert_or_assign(jump.id, jump);
    const auto found = partition.bodies.find(jump.id);
    if (found == partition.bodies.end()) return;
    HomeBody& body = *found->second;
    body.kinematic_target.reset();
    BodyState state = body.sector->world->state(body.slot);
    if (!jump.keeps_rotation) state.rotation = jump.state.rotation;
    if (!jump.keeps_linear_velocity) state.linear_velocity = jump.state.linear_velocity;
    if (!jump.keeps_angular_velocity) state.angular_velocity = jump.state.angular_velocity;
    body.sector->world->set_state(body.slot, state);
  }
  void forget(BodyId id) { jumps_.erase(id); }

  // A body as it is now, or where it will land.
  BodyRecord record(const Partition& partition, const HomeBody& body) const {
    BodyRecord record = record_of(body);
    const auto found = jumps_.find(body.id);
    if (found == jumps_.end()) return record;
    Teleport jump = found->second;
    jump.keeps_linear_velocity = jump.keeps_angular_velocity = true;
    carry_out(jump, partition.sector_size(), record);
    return record;
  }

  std::vector<HomeChange> carry_out_all(Partition& partition) const {
    std::vector<HomeChange> changes;
    for (const auto& [id, jump] : jumps_) {
      lift_clones(partition, id);
      forget_moves(partition, id);
      const auto found = partition.bodies.find(id);
      if (found == partition.bodies.end()) continue;
      HomeBody& body = *found->second;
      wake_touching(partition, *body.sector, body.slot);
      const SectorIndex old_home = body.sector->index;
      const BodyRecord landed = record(partition, body);
      // The state as the engine rounds it: clones have to be where the body will be, to the bit.
      body.sector->world->set_state(body.slot, landed.state);
      Handover handover = taken_out(partition, body);
      handover.record.home = landed.home;
      changes.push_back({handover, old_home});
    }
    return changes;
  }

 private:
  static void move_static(Partition& partition, const Teleport& jump) {
    BodyRecord moved = *partition.statics.find(jump.id);
    carry_out(jump, partition.sector_size(), moved);
    remove_static_body(partition, jump.id);
    add_static_body(partition, moved);
    for (const JointId joint : partition.joints.of(jump.id))
      wake_jointed(partition, *partition.joints.find(joint));
  }

  absl::btree_map<BodyId, Teleport> jumps_;  // the last one of each body
};

void note_if_stopped(Partition& partition, HomeBody& body, std::vector<Stopped>& stopped) {
  if (const std::optional<DivergenceKind> kind = stop_if_diverged(partition, body))
    stopped.push_back({body.id, *kind});
}

void set_target(Partition& partition, const KinematicTarget& target, const Landings& landings,
                std::vector<Stopped>& stopped) {
  const auto found = partition.bodies.find(target.id);
  if (found == partition.bodies.end()) return;
  HomeBody& body = *found->second;
  BodyRecord now = landings.record(partition, body);
  BodyState goal = target.state;
  const Eigen::Vector3d position =
      metres_between(now.home, target.home, partition.sector_size()) + vector(target.state.position);
  Eigen::Map<Eigen::Vector3d>(goal.position.data()) = position;
  if (target.keeps_rotation) keep_rotation(body.properties, now.state, goal);
  set_velocities_between(now.state, goal, partition.dt());
  SectorWorld& world = *body.sector->world;
  world.wake(body.slot);
  world.set_velocity(body.slot, vector(now.state.linear_velocity), vector(now.state.angular_velocity));
  goal.linear_velocity = {};
  goal.angular_velocity = {};
  body.kinematic_target = goal;
  note_if_stopped(partition, body, stopped);
  mark_dirty(body);
  activate(partition, *body.sector);
}

// Whoever detects contacts of the body looks at its replica.
void set_surface_motion(Partition& partition, const SetSurfaceMotion& motion) {
  if (partition.statics.find(motion.id))
    return set_static_surface_motion(partition, motion.id, motion.velocity, motion.running);
  if (const auto found = partition.replicas.find(motion.id); found != partition.replicas.end()) {
    Replica& replica = *found->second;
    set_surface_motion(replica.properties, motion.velocity, motion.running);
    for (const std::unique_ptr<Clone>& clone : replica.clones) {
      if (!clone->is_placed()) continue;
      clone->sector->world->set_surface(clone->slot, *replica.properties.surface);
      wake_touching(partition, *clone->sector, clone->slot);
    }
  }
  const auto found = partition.bodies.find(motion.id);
  if (found == partition.bodies.end()) return;
  HomeBody& body = *found->second;
  SectorWorld& world = *body.sector->world;
  set_surface_motion(body.properties, motion.velocity, motion.running);
  world.set_surface(body.slot, *body.properties.surface);
  world.wake(body.slot);
  wake_touching(partition, *body.sector, body.slot);
  mark_dirty(body);
  activate(partition, *body.sector);
}

// Sectors at rest come back with the bodies that the command names.
void bring_back_named(Partition& partition, const Command& command) {
  std::visit(
      [&](const auto& c) {
        using C = std::decay_t<decltype(c)>;
        if constexpr (std::is_same_v<C, AddJoint>) {
          bring_back_holding(partition, c.record.properties.parent);
          bring_back_holding(partition, c.record.properties.child);
        } else if constexpr (requires {
                               { c.id } -> std::convertible_to<BodyId>;
                             }) {
          bring_back_holding(partition, c.id);
        }
      },
      command);
}

void apply(Partition& partition, const Command& command, Landings& landings, std::vector<Stopped>& stopped) {
  bring_back_named(partition, command);
  const auto with_body = [&](BodyId id, auto&& change) {
    const auto found = partition.bodies.find(id);
    if (found == partition.bodies.end()) return;
    HomeBody& body = *found->second;
    SectorWorld& world = *body.sector->world;
    world.wake(body.slot);
    change(world, body);
    note_if_stopped(partition, body, stopped);
    mark_dirty(body);
    activate(partition, *body.sector);
  };
  std::visit(
      [&](const auto& c) {
        using C = std::decay_t<decltype(c)>;
        if constexpr (std::is_same_v<C, SpawnBody>) {
          add_body(partition, c.record);
        } else if constexpr (std::is_same_v<C, RemoveBody>) {
          remove_body(partition, c.id);
          if (c.last_of) forget_shape(partition, *c.last_of);
          landings.forget(c.id);
        } else if constexpr (std::is_same_v<C, Teleport>) {
          landings.add(partition, c);
        } else if constexpr (std::is_same_v<C, KinematicTarget>) {
          set_target(partition, c, landings, stopped);
        } else if constexpr (std::is_same_v<C, AddJoint>) {
          add_joint(partition, c.record, c.leaders);
        } else if constexpr (std::is_same_v<C, RemoveJoint>) {
          remove_joint(partition, c.id);
        } else if constexpr (std::is_same_v<C, SetDrives>) {
          set_drives(partition, c.id, c.drives);
        } else if constexpr (std::is_same_v<C, SetSurfaceMotion>) {
          set_surface_motion(partition, c);
        } else if constexpr (std::is_same_v<C, SetVelocity>) {
          with_body(c.id, [&](SectorWorld& world, HomeBody& body) {
            world.set_velocity(body.slot, vector(c.linear), vector(c.angular));
            body.kinematic_target.reset();
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

// What was led to a target in the last tick stays there, unless a command of this one leads it on.
void halt_led(Partition& partition) {
  for (const Sector* sector : partition.active) {
    for (HomeBody* body : sector->kinematics) {
      if (!body->kinematic_target) continue;
      body->kinematic_target.reset();
      sector->world->set_velocity(body->slot, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    }
  }
}

// The margins follow from the largest body that the world has ever had, and all servers hear of all bodies:
// where they grow, everyone looks again at what is near a seam.
void mark_all_dirty(Partition& partition) {
  bring_back_near_borders(partition);
  for (auto& [id, body] : partition.bodies) {
    mark_dirty(*body);
    activate(partition, *body->sector);
  }
}

}  // namespace

std::vector<HomeChange> apply_commands(Partition& partition, std::span<const Command> commands,
                                       std::vector<Stopped>& stopped) {
  const double radius_max = partition.radius_max;
  halt_led(partition);
  Landings landings;
  for (const Command& command : commands) apply(partition, command, landings, stopped);
  if (partition.radius_max > radius_max) mark_all_dirty(partition);
  return landings.carry_out_all(partition);
}

}  // namespace tessera
