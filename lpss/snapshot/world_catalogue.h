// The names of a world, which no partition needs: of its bodies, joints and frames.
#pragma once

#include <absl/status/status.h>

#include <span>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"
#include "lpss/snapshot/world_snapshot.h"
#include "lpss/tick/messages.h"

namespace tessera {

// What clients attach to a body.
struct BodyTags {
  std::string owner;      // who may command it by requests with this owner; empty: nobody in particular
  std::string user_data;  // bytes
  std::vector<std::string> programs = {};  // the kinds of its programs, by their places
};

BodyTags tags_of(const BodyDescription& body, std::string owner = {});

// What the owner of a world's sequence of commands keeps of it: names, and what has been accepted and has not
// taken effect.
struct WorldCatalogue {
  struct Body {
    BodyId id;
    std::string name;
    BodyProperties properties;  // as simulated
    BodyTags tags = {};
  };
  struct Joint {
    std::string name;
    JointRecord record;
  };
  // A name of a place on a body.
  struct Frame {
    std::string name;
    BodyId body;
    Pose pose;  // in the body frame
  };
  // Of one of the ticks to come, in their order.
  struct HeldBatch {
    std::vector<Command> commands;
    std::vector<ShapeEntry> new_shapes;  // there before the commands
  };

  std::string name;
  std::vector<Body> bodies;   // ascending by ids
  std::vector<Joint> joints;  // likewise
  std::vector<Frame> frames;
  BodyId next_body{1};  // ids are never given again
  JointId next_joint{1};
  ShapeId next_shape = 0;
  std::vector<HeldBatch> held;
};

// The catalogue of a world that nobody has sent commands to. `world` is valid.
WorldCatalogue catalogue_of(const WorldDescription& world, std::span<const BodyRecord> records,
                            std::span<const JointRecord> joints);
WorldCatalogue catalogue_of(const WorldDescription& world);

// INVALID_ARGUMENT with the field and its bound.
absl::Status validate(const BodyTags& tags);

// Whether names and ids are unique and in bounds, and all is as the state says where nothing is held.
// INVALID_ARGUMENT with the body, joint or name.
absl::Status validate(const WorldCatalogue& catalogue, const WorldSnapshot& world);

}  // namespace tessera
