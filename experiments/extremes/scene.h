// A scene of the experiment: a world at the edge of what can be asked for, and the one figure that is
// measured of it.
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

// The bodies that can move, between two ticks. Frames are those of the centres of mass, axes those of the
// world.
struct Moment {
  WorldSettings settings;  // of the world
  Tick tick = 0;
  double time = 0;                         // s
  std::vector<BodyRecord> bodies;          // in the order of their ids
  std::vector<Eigen::Vector3d> positions;  // m, of the same bodies, from the centre of the anchor's sector
  std::uint64_t stopped = 0;   // how often a body was stopped since the start: TickCounts::bodies_stopped
  std::size_t heap_bytes = 0;  // that this process holds

  Eigen::Vector3d velocity(std::size_t body) const {  // m/s
    return Eigen::Vector3d(bodies[body].state.linear_velocity.data());
  }
  Eigen::Vector3d spin(std::size_t body) const {  // rad/s
    return Eigen::Vector3d(bodies[body].state.angular_velocity.data());
  }
};

// What a scene has come to `now`; not finite where a number was lost.
using Figure = std::function<double(const Moment& start, const Moment& now)>;

using Build = std::function<WorldDescription(const WorldSettings& settings)>;

struct Scene {
  std::string group;
  std::string name;  // unique in its group
  Build world;       // its settings say the precision
  Tick warm_up = 0;  // ticks before the start that the figure compares with
  Tick ticks = 0;    // from there on
  Tick quick_ticks = 0;
  Tick sample_every = 1;  // ticks; the largest figure of all samples counts. 0: only that of the end
  Figure figure;
  std::string unit;
  double bound = 0;   // what physics or common sense allow: the figure is to be this or less
  std::string holds;  // what happened where it is; one sentence, like `fails`
  std::string fails;
  bool may_be_refused = false;    // to refuse the world with a message is as good as to run it
  std::vector<Command> commands;  // of the first tick
};

// All of them, group by group.
std::vector<Scene> all_scenes();

std::vector<Scene> place_scenes();   // far away, the last sector, planets
std::vector<Scene> body_scenes();    // ratios of masses, sizes
std::vector<Scene> motion_scenes();  // speeds, orbits, spins, bounces
std::vector<Scene> pile_scenes();    // time steps, gravity, heights, overlaps, crowds
std::vector<Scene> input_scenes();   // numbers at the ends of their range
std::vector<Scene> long_scenes();    // very many ticks

}  // namespace tessera::extremes
