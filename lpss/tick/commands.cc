#include "lpss/tick/commands.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <concepts>
#include <optional>
#include <type_traits>

#include "lpss/base/rotation.h"
#include "lpss/partition/bodies.h"
#include "lpss/partition/joints.h"
#include "lpss/partition/packing.h"
#include "lpss/partition/properties.h"
#include "lpss/partition/replicas.h"
#include "lpss/partition/sectors.h"
#include "lpss/partition/statics.h"
#include "lpss/programs/registry.h"
#include "lpss/tick/frames.h"
#include "lpss/tick/landings.h"
#include "lpss/tick/radial_impulse.h"

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
  goal.activity = Activity::kAwake;  // until it stands still again, of which others are told
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

// It runs at the end of this tick. What is out of bounds, as another program may have it, changes nothing.
void tell(ProgramRecord& record, const TellProgram& told) {
  const Program* const program = find_program(record.kind);
  if (program == nullptr || !record.fault.empty()) return;
  complete(record);
  const auto set = [](std::vector<double>& numbers, std::span<const std::pair<std::uint32_t, double>> some,
                      std::span<const NumberSpec> table) {
    for (const auto& [place, value] : some) {
      if (place < table.size() && check_number(table[place], value).ok()) numbers[place] = value;
    }
  };
  set(record.inputs, told.inputs, program->inputs());
  set(record.parameters, told.parameters, program->parameters());
  record.wake_at = 1;
}

// The commands of a tick, one after the other.
class Commands {
 public:
  Commands(Partition& partition, std::vector<Stopped>& stopped) : partition_(partition), stopped_(stopped) {}

  void apply(const Command& command) {
    bring_back_named(partition_, command);
    std::visit([this](const auto& c) { carry_out(c); }, command);
  }

  std::vector<HomeChange> end(std::vector<Exchange>& outbox) {
    push_lasting();
    return landings_.carry_out_all(partition_, outbox);
  }

 private:
  // The rotation in the middle of the tick, by rows: a force that turns with its body acts along the mean of
  // its directions.
  std::array<double, 9> halfway(const BodyState& state) const {
    using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Eigen::Matrix3d axes = Eigen::Map<const Rotation>(state.rotation.data());
    std::array<double, 9> rows;
    Eigen::Map<Rotation>(rows.data()) =
        turned<double>(axes, partition_.dt() / 2 * vector(state.angular_velocity));
    return rows;
  }

  // By the forces that last. What is pushed may be near a border, and its replicas must know how far it may
  // go.
  void push_lasting() {
    for (const Sector* sector : partition_.active) {
      for (HomeBody* body : sector->pushed) {
        SectorWorld& world = *sector->world;
        if (world.activity(body->slot) == Activity::kAsleep) continue;
        world.add_wrench(body->slot, wrench_at(body->properties, halfway(world.state(body->slot))));
        note_if_stopped(partition_, *body, stopped_);
        mark_dirty(*body);
      }
    }
  }

  void carry_out(const SpawnBody& c) { add_body(partition_, c.record); }
  void carry_out(const RemoveBody& c) {
    halt_carried(partition_, c.id);
    remove_body(partition_, c.id);
    if (c.last_of) forget_shape(partition_, *c.last_of);
    landings_.forget(c.id);
  }
  void carry_out(const SetVelocity& c) {
    change(c.id, [&](SectorWorld& world, HomeBody& body) {
      world.set_velocity(body.slot, vector(c.linear), vector(c.angular));
      body.kinematic_target.reset();
    });
  }
  void carry_out(const ApplyImpulse& c) {
    change(c.id, [&](SectorWorld& world, HomeBody& body) {
      world.apply_impulse(body.slot, vector(c.impulse), vector(c.lever));
    });
  }
  void carry_out(const ApplyForce& c) {
    change(c.id, [&](SectorWorld& world, HomeBody& body) { world.add_wrench(body.slot, c.wrench); });
  }
  // As a lasting force does, it lets a body fall asleep.
  void carry_out(const PushBody& c) {
    const auto found = partition_.bodies.find(c.id);
    if (found == partition_.bodies.end()) return;
    HomeBody& body = *found->second;
    SectorWorld& world = *body.sector->world;
    if (body.properties.motion != Motion::kDynamic || world.activity(body.slot) == Activity::kAsleep) return;
    world.add_wrench(body.slot, c.wrench);
    note_if_stopped(partition_, body, stopped_);
    mark_dirty(body);
  }
  void carry_out(const TellProgram& c) {
    const auto found = partition_.bodies.find(c.id);
    if (found == partition_.bodies.end() || found->second->programs.empty()) return;
    HomeBody& body = *found->second;
    for (std::size_t place = 0; place < body.programs.size(); ++place) {
      if (c.program == kAllPrograms || c.program == place) tell(body.programs[place], c);
    }
    activate(partition_, *body.sector);
  }
  void carry_out(const SetForce& c) {
    if (const auto replica = partition_.replicas.find(c.id); replica != partition_.replicas.end())
      replica->second->properties.lasting = c.force;
    change(c.id, [&](SectorWorld&, HomeBody& body) { set_lasting_force(body, c.force); });
  }
  void carry_out(const Teleport& c) {
    landings_.add(partition_, c);
    // A velocity that it keeps may be too much with the one that it gets.
    if (const auto found = partition_.bodies.find(c.id); found != partition_.bodies.end())
      note_if_stopped(partition_, *found->second, stopped_);
  }
  void carry_out(const KinematicTarget& c) { set_target(partition_, c, landings_, stopped_); }
  void carry_out(const AddJoint& c) { add_joint(partition_, c.record, c.leaders); }
  void carry_out(const RemoveJoint& c) { remove_joint(partition_, c.id); }
  void carry_out(const SetDrives& c) { set_drives(partition_, c.id, c.drives, c.axes); }
  void carry_out(const SetSurfaceMotion& c) { set_surface_motion(partition_, c); }
  void carry_out(const SetProperties& c) {
    set_properties(partition_, c.id, c.properties);
    // What pushes it may be too much for its new mass.
    if (const auto found = partition_.bodies.find(c.id); found != partition_.bodies.end())
      note_if_stopped(partition_, *found->second, stopped_);
  }
  void carry_out(const ApplyRadialImpulse& c) {
    for (const auto& [body, impulse] : pushes_of(partition_, c, landings_)) {
      change(*body, [&](SectorWorld& world, HomeBody& pushed) {
        world.apply_impulse(pushed.slot, impulse, Eigen::Vector3d::Zero());
      });
    }
  }

  template <typename Change>
  void change(BodyId id, const Change& make) {
    const auto found = partition_.bodies.find(id);
    if (found != partition_.bodies.end()) change(*found->second, make);
  }
  template <typename Change>
  void change(HomeBody& body, const Change& make) {
    SectorWorld& world = *body.sector->world;
    world.wake(body.slot);
    make(world, body);
    note_if_stopped(partition_, body, stopped_);
    mark_dirty(body);
    activate(partition_, *body.sector);
  }

  Partition& partition_;
  std::vector<Stopped>& stopped_;
  Landings landings_;
};

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
                                       std::vector<Exchange>& outbox, std::vector<Stopped>& stopped) {
  const double radius_max = partition.radius_max;
  halt_led(partition);
  Commands applied(partition, stopped);
  for (const Command& command : commands) applied.apply(command);
  if (partition.radius_max > radius_max) mark_all_dirty(partition);
  return applied.end(outbox);
}

}  // namespace tessera
