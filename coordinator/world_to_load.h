// Worlds that a coordinator is given, before servers have them.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <variant>
#include <vector>

#include "coordinator/sequencer.h"
#include "coordinator/world_registry.h"
#include "lpss/model/body.h"
#include "lpss/model/joint.h"
#include "lpss/model/world_description.h"
#include "proto/snapshot.h"
#include "world.pb.h"

namespace tessera {

// A valid world, as described or from a snapshot.
struct WorldToLoad {
  struct Described {
    WorldDescription world;
    std::vector<BodyRecord> records;
    std::vector<JointRecord> joints;
  };
  std::variant<Described, ReadSnapshot> from;
  bool is_replay = false;  // of a recording, which has all commands

  const std::string& name() const;
  const WorldSettings& settings() const;
  const SectorIndex& anchor() const;
  Tick tick() const;  // completed
};

// Errors as from_proto(), records_of() and joint_records_of().
absl::StatusOr<WorldToLoad> described_world(const v1::World& message);

WorldRegistry registry_of(const WorldToLoad& world);

// The commands of ticks to come that a snapshot has.
std::vector<SequencedCommands> held_of(const WorldToLoad& world);

}  // namespace tessera
