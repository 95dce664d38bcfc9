// A world between two ticks, as data: what it is made of, and its state. Whoever goes on from it, on any
// number of partitions, gets the bits that the world would have had.
#pragma once

#include <absl/status/status.h>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lpss/grid/sector_map.h"
#include "lpss/model/settings.h"
#include "lpss/model/shape.h"
#include "lpss/model/world_description.h"
#include "lpss/partition/world_state.h"
#include "lpss/tick/messages.h"

namespace tessera {

struct WorldSnapshot {
  WorldSettings settings;
  SectorIndex anchor;
  Tick tick = 0;                   // completed
  std::vector<ShapeEntry> shapes;  // ascending by ids
  SharedState shared;
  std::vector<MovedSector> sectors;  // all, ascending
};

// What the owner of a world's sequence of commands keeps of it: names, and what has been accepted and has not
// taken effect.
struct WorldCatalogue {
  struct Body {
    BodyId id;
    std::string name;
    BodyProperties properties;  // as simulated
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

// Whether names and ids are unique and in bounds, and all is as the state says where nothing is held.
// INVALID_ARGUMENT with the body, joint or name.
absl::Status validate(const WorldCatalogue& catalogue, const WorldSnapshot& world);

// Whether a partition can take the state over: INVALID_ARGUMENT, naming the body, joint or sector, where it
// contradicts itself or is out of bounds. Contact points are checked apart, by the engine that reads them.
absl::Status validate(const WorldSnapshot& world);

// What the sectors in which bodies live weigh: 1, and 1 a body.
std::vector<std::pair<SectorIndex, double>> load_of(const WorldSnapshot& world);

// The map that gives each of `servers` about as much of it.
SectorMap placed(const WorldSnapshot& world, std::uint32_t servers, std::uint64_t epoch);

// Fills a new partition, which has the world's shapes, with its part of a snapshot that is valid.
// INVALID_ARGUMENT, and the partition must not be used, where its engine cannot read contact points, or
// islands are not as contacts connect them.
absl::Status resume(Partition& partition, const SharedState& shared, std::span<const MovedSector> sectors);

// Likewise for a partition without shapes.
absl::Status resume(Partition& partition, const WorldSnapshot& world);

}  // namespace tessera
