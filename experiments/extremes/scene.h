// A scene of the experiment: a world at a limit of the input range, and the one figure measured in it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"

namespace tessera::extremes {

// The movable bodies, between two ticks. Frames are at the centres of mass, axes are those of the world.
struct Moment {
  WorldSettings settings;  // of the world
  Tick tick = 0;
  double time = 0;                         // s
  std::vector<BodyRecord> bodies;          // ascending by id
  std::vector<Eigen::Vector3d> positions;  // m, of the same bodies, from the centre of the anchor's sector
  std::uint64_t stopped = 0;               // bodies stopped since the start: TickCounts::diverged
  std::size_t heap_bytes = 0;              // of this process

  Eigen::Vector3d velocity(std::size_t body) const {  // m/s
    return Eigen::Vector3d(bodies[body].state.linear_velocity.data());
  }
  Eigen::Vector3d spin(std::size_t body) const {  // rad/s
    return Eigen::Vector3d(bodies[body].state.angular_velocity.data());
  }
};

// The figure of a scene `now`; not finite if a number was lost.
using Figure = std::function<double(const Moment& start, const Moment& now)>;

using Build = std::function<WorldDescription(const WorldSettings& settings)>;

// Ticks.
struct Span {
  Tick ticks = 0;  // after the start state
  Tick quick_ticks = 0;
  Tick sample_every = 1;  // the largest figure of all samples counts. 0: only the one at the end
  Tick warm_up = 0;       // before the start state
};

struct Question {
  Figure figure;
  std::string unit;
  double bound = 0;   // allowed by physics or common sense: the figure must not exceed it
  std::string holds;  // what happened if it does not; one sentence, like `fails`
  std::string fails;
};

struct Scene {
  std::string group;
  std::string name;  // unique in its group
  Build world;       // its settings contain the precision
  Span lasts;
  Question asks;
  // What is added to the bound because the numbers of a precision cannot tell, and why; from the arithmetic,
  // not from results.
  std::function<double(Precision)> rounding;
  std::string rounding_reason;
  bool may_be_refused = false;    // refusing the world with a message also counts as success
  std::vector<Command> commands;  // in the first tick
};

// All scenes, by group.
std::vector<Scene> all_scenes();

std::vector<Scene> place_scenes();    // far away, the last sector, planets
std::vector<Scene> body_scenes();     // ratios of masses, sizes
std::vector<Scene> terrain_scenes();  // drops on meshes and height fields
std::vector<Scene> motion_scenes();   // speeds, orbits, spins, bounces
std::vector<Scene> pile_scenes();     // time steps, gravity, heights, overlaps, crowds
std::vector<Scene> input_scenes();    // numbers at the limits of their range
std::vector<Scene> long_scenes();     // very many ticks

}  // namespace tessera::extremes
