#include "coordinator/world_to_load.h"

#include <utility>

#include "lpss/model/world_records.h"
#include "lpss/programs/registry.h"
#include "proto/convert.h"

namespace tessera {

const std::string& WorldToLoad::name() const {
  if (const auto* described = std::get_if<Described>(&from)) return described->world.name;
  return std::get<ReadSnapshot>(from).catalogue.name;
}

const WorldSettings& WorldToLoad::settings() const {
  if (const auto* described = std::get_if<Described>(&from)) return described->world.settings;
  return std::get<ReadSnapshot>(from).world.settings;
}

const SectorIndex& WorldToLoad::anchor() const {
  if (const auto* described = std::get_if<Described>(&from)) return described->world.anchor;
  return std::get<ReadSnapshot>(from).world.anchor;
}

Tick WorldToLoad::tick() const {
  const auto* snapshot = std::get_if<ReadSnapshot>(&from);
  return snapshot == nullptr ? 0 : snapshot->world.tick;
}

absl::StatusOr<WorldToLoad> described_world(const v1::World& message) {
  absl::StatusOr<WorldDescription> world = from_proto(message);
  if (!world.ok()) return world.status();
  absl::StatusOr<std::vector<BodyRecord>> records = records_of(*world);
  if (!records.ok()) return records.status();
  absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(*world);
  if (!joints.ok()) return joints.status();
  if (absl::Status status = check_programs(*world); !status.ok()) return status;
  return WorldToLoad{.from =
                         WorldToLoad::Described{*std::move(world), *std::move(records), *std::move(joints)}};
}

WorldRegistry registry_of(const WorldToLoad& world) {
  if (const auto* described = std::get_if<WorldToLoad::Described>(&world.from)) {
    return {described->world, described->records, described->joints};
  }
  const ReadSnapshot& snapshot = std::get<ReadSnapshot>(world.from);
  return {snapshot.world, snapshot.catalogue};
}

std::vector<SequencedCommands> held_of(const WorldToLoad& world) {
  std::vector<SequencedCommands> held;
  const auto* snapshot = std::get_if<ReadSnapshot>(&world.from);
  if (snapshot == nullptr) return held;
  for (const WorldCatalogue::HeldBatch& batch : snapshot->catalogue.held) {
    SequencedCommands& to = held.emplace_back();
    to.commands.append(batch.commands);
    for (const ShapeEntry& entry : batch.new_shapes) to.new_shapes.push_back(to_proto(entry));
  }
  return held;
}

}  // namespace tessera
