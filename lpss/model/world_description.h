// A world as data: what a file says, what a client loads, what a cluster starts from.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/body.h"
#include "lpss/model/joint.h"
#include "lpss/model/precision.h"
#include "lpss/model/seam_policy.h"
#include "lpss/model/shape.h"

namespace tessera {

// The same acceleration everywhere, in m/s^2.
struct UniformGravity {
  Eigen::Vector3d acceleration{0, 0, -9.81};
};

// A planet: `surface` m/s^2 towards `centre` at `radius` metres from it, falling off with the square of the
// distance outside and linearly to zero inside.
struct CentralGravity {
  WorldPosition centre;
  double surface = 9.81;
  double radius = 6.371e6;
};

using Gravity = std::variant<UniformGravity, CentralGravity>;

// The knobs of a world. Defaults are a good start for bodies of 0.1 to 10 m.
struct WorldSettings {
  Precision precision = Precision::kFloat32;
  double sector_size = 128;     // L, m. Bounded by the precision: see precision_limit().
  double time_step = 1.0 / 60;  // dt, s, 1e-5 to 0.1
  SeamPolicy seams = SeamPolicy::kIsland;
  int clone_depth = 1;  // policy clone: how far into a pile clones reach, 1 to 8; 1 is the paper, 0 is
                        // no clones at all, for comparison
  std::uint32_t island_cap = 4096;  // policy island: islands across seams of more bodies than this are
                                    // coupled pass by pass instead of being solved whole
  std::uint64_t shuffle = 0;  // not 0: a seed; sectors change servers, and islands their solvers, at random
  Gravity gravity;
  int solver_iterations = 12;  // passes over the rows of an island, 1 to 1000
  int substeps = 4;   // small steps of a tick that these passes are divided among, two each at least, 1 to
                      // 64; 1 is Bullet's own solver. Contacts are found once a tick
  bool adapt = true;  // fewer small steps where an island carries little, more where it carries much;
                      // `substeps` and `solver_iterations` are what is in between
  double warm_starting = 0.85;  // of Bullet's own solver: share of the last impulses to start from, 0 to 1
  double split_from = 0.04;  // of Bullet's own solver, m: deeper overlaps are pushed apart without a lasting
                             // velocity, 0 or more
  bool friction_in_two_directions = true;  // costs about 1.3 times the solver's time; a stack drifts far less
  bool continuous_collision = true;        // sweep bodies that move farther in a tick than they are thick
  double sleep_linear_speed = 0.05;        // m/s; a body slower than both speeds ...
  double sleep_angular_speed = 0.1;        // rad/s
  double sleep_after = 1.0;                // s; ... for this long may sleep. 0: nothing ever sleeps
};

// One body of the world's start. Velocities are those of the centre of mass, in the world's axes.
struct BodyDescription {
  std::string name;  // unique in the world: "model::link"
  BodyProperties properties;
  WorldPose pose;  // of the body frame
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
};

// One joint of the world's start. Its bodies are named by their places in WorldDescription::bodies plus one,
// and its frames are given in their body frames.
struct JointDescription {
  std::string name;  // unique in the world: "model::joint"
  JointProperties properties;
  JointDrives drives;
};

struct WorldDescription {
  std::string name;
  WorldSettings settings;
  SectorIndex anchor;         // the sector of the file's origin: moving the world moves this
  std::vector<Shape> shapes;  // BodyProperties::shape is a place in here
  std::vector<BodyDescription> bodies;
  std::vector<JointDescription> joints;
};

// Moves the whole world, a planet included, by whole sectors. OUT_OF_RANGE, naming the body or joint, where
// something would leave the 64-bit range; the world is then unchanged.
absl::Status move_by(WorldDescription& world, const SectorOffset& offset);

}  // namespace tessera
