#include "lpss/tick/integrate.h"

#include <utility>

#include "lpss/base/rotation.h"
#include "lpss/partition/bodies.h"

namespace tessera {
namespace {

// `state` after `dt` seconds at its velocities.
BodyState coasted(BodyState state, double dt) {
  Eigen::Map<Eigen::Vector3d>(state.position.data()) += Eigen::Vector3d(state.linear_velocity.data()) * dt;
  const Eigen::Vector3d spin(state.angular_velocity.data());
  if (spin != Eigen::Vector3d::Zero())
    state.rotation = rotation_of(rotation_by(spin * dt) * quaternion_of(state));
  return state;
}

bool at_rest(const BodyState& state) {
  return state.linear_velocity == std::array<double, 3>{} &&
         state.angular_velocity == std::array<double, 3>{};
}

// Kinematic bodies go where they were told, and have the velocity that took them there until the next tick
// begins; one that stands still sleeps, so that it keeps nothing awake.
void move_kinematics(Sector& sector, double dt) {
  for (HomeBody* body : sector.kinematics) {
    SectorWorld& world = *sector.world;
    if (world.activity(body->slot) == Activity::kAsleep) continue;
    BodyState state = world.state(body->slot);
    state.velocities_before.reset();
    if (body->kinematic_target) {
      BodyState goal = *body->kinematic_target;
      goal.linear_velocity = state.linear_velocity;
      goal.angular_velocity = state.angular_velocity;
      world.set_state(body->slot, goal);
      continue;
    }
    if (at_rest(state)) {
      world.sleep(body->slot);
      mark_dirty(*body);
    } else {
      world.set_state(body->slot, coasted(state, dt));
    }
  }
}

void fly(Sector& sector, double dt, const ParallelFor& parallel) {
  const std::vector<BodySlot>& fliers = sector.in_free_flight;
  run_in_pieces(parallel, fliers.size(), kBodiesInPiece,
                [&](std::size_t n) { sector.world->fly(fliers[n], dt); });
  sector.in_free_flight.clear();
}

// Around a planet, bodies in free flight are pulled half by where they were, and half by where they are now.
// In a frame that turns, by where they were.
void end_flights(const Partition& partition, Sector& sector, const ParallelFor& parallel) {
  const Felt& felt = partition.felt_in(sector.index);
  if (!std::holds_alternative<CentralGravity>(partition.settings.gravity) || felt.turns()) return;
  run_in_pieces(parallel, sector.homes.size(), kBodiesInPiece, [&](std::size_t n) {
    const HomeBody& body = *sector.homes[n];
    if (!sector.world->flew(body.slot)) return;
    sector.world->end_flight(
        body.slot, felt.at(sector.index, sector.world->position(body.slot), body.properties.gravity),
        partition.dt());
  });
}

}  // namespace

std::vector<Stopped> integrate(Partition& partition, const std::vector<Sector*>& stepped,
                               const ParallelFor& parallel) {
  const double dt = partition.dt();
  std::vector<std::vector<StoppedBody>> stopped(stepped.size());
  run_parallel(parallel, stepped.size(), [&](std::size_t i) {
    Sector& sector = *stepped[i];
    fly(sector, dt, parallel);
    stopped[i] = sector.world->integrate(dt, parallel);
    end_flights(partition, sector, parallel);
    move_kinematics(sector, dt);
  });
  std::vector<Stopped> all;
  for (std::size_t i = 0; i < stepped.size(); ++i) {
    for (const StoppedBody& body : stopped[i]) {
      const HomeBody& home = *stepped[i]->by_slot[static_cast<std::size_t>(body.slot)];
      all.push_back({home.id, body.kind});
    }
  }
  return all;
}

}  // namespace tessera
