// Joints of a running world: their properties, and their positions tick by tick.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "lpss/model/joint.h"
#include "lpss/model/world_description.h"
#include "tessera/stream.h"

namespace tessera {

// A joint by its id or by its name.
using JointName = std::variant<JointId, std::string>;

// A joint of the world. `joint.properties` refers to bodies by their ids, and its frames are in body frames.
struct FoundJoint {
  JointId id;
  JointDescription joint;  // with its latest drives
  std::string parent;      // name of the body; empty: the world
  std::string child;
  // Centres of mass in the body frames: the velocities of a BodySample are of these points.
  Eigen::Vector3d parent_centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d child_centre = Eigen::Vector3d::Zero();
};

struct FoundJoints {
  std::vector<FoundJoint> joints;  // ascending by id
  bool truncated = false;          // there are more
};

struct JointSample {
  JointId id;
  JointState state;
  bool asleep = false;  // its child sleeps
};

struct JointFrame {
  Tick tick = 0;
  std::vector<JointSample> joints;  // in the requested order; without joints whose bodies are gone
};

using JointStream = Stream<JointFrame>;

// The position of a joint, from its bodies at one tick; `parent` is null if it is the world.
JointState joint_state(const FoundJoint& joint, const BodySample* parent, const BodySample& child,
                       double sector_size);

}  // namespace tessera
