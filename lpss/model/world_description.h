// A world as data: what a file says, what a client loads, what a cluster starts from.
#pragma once

#include <absl/status/status.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/body.h"
#include "lpss/model/joint.h"
#include "lpss/model/settings.h"
#include "lpss/model/shape.h"

namespace tessera {

// One body of the world's start. Velocities are those of the centre of mass, in the world's axes.
struct BodyDescription {
  std::string name;  // unique in the world: "model::link"
  BodyProperties properties;
  WorldPose pose;  // of the body frame
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();
  std::string user_data = {};  // bytes that are kept with the body, and that nothing here looks at
  std::vector<ProgramRecord> programs = {};  // where they start is not looked at
};

// One joint of the world's start. Its bodies are named by their places in WorldDescription::bodies plus one,
// and its frames are given in their body frames.
struct JointDescription {
  std::string name;  // unique in the world: "model::joint"
  JointProperties properties;
  JointDrives drives;
};

// A named frame that is fixed to a body: a <frame> of a model, or a link that a URDF file fixes to another
// one.
struct FrameDescription {
  std::string name;      // unique among bodies and frames: "model::frame"
  std::size_t body = 0;  // its place in WorldDescription::bodies
  Pose pose;             // in the body frame
};

struct WorldDescription {
  std::string name;
  WorldSettings settings;
  SectorIndex anchor;         // the sector of the file's origin: moving the world moves this
  std::vector<Shape> shapes;  // BodyProperties::shape is a place in here
  std::vector<BodyDescription> bodies;
  std::vector<JointDescription> joints;
  std::vector<FrameDescription> frames;
};

// Moves the whole world, a planet included, by whole sectors. OUT_OF_RANGE, naming the body or joint, where
// something would leave the 64-bit range; the world is then unchanged.
absl::Status move_by(WorldDescription& world, const SectorOffset& offset);

// Puts frames with carriers where these are. A frame whose carrier is not there, or in that frame itself,
// stays as it is: validate() refuses it.
void place_carried(WorldDescription& world);

}  // namespace tessera
