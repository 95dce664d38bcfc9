#include "simulator/checker.h"

#include <absl/container/btree_map.h>
#include <absl/strings/str_cat.h>

#include <iterator>
#include <utility>
#include <vector>

#include "coordinator/command_list.h"
#include "coordinator/world_registry.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// A world in one process that executes recorded commands.
class Playback {
 public:
  static absl::StatusOr<Playback> create(const WorldDescription& world) {
    const absl::StatusOr<std::vector<BodyRecord>> records = records_of(world);
    if (!records.ok()) return records.status();
    const absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(world);
    if (!joints.ok()) return joints.status();
    absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world);
    if (!simulation.ok()) return simulation.status();
    return Playback(WorldRegistry(world, *records, *joints), *std::move(simulation));
  }

  // Gives commands for the next tick.
  absl::Status give(const v1::RecordedCommands& recorded) {
    absl::StatusOr<GivenCommands> given = give_again(recorded, registry_);
    if (!given.ok()) return given.status();
    for (const v1::NumberedShape& shape : given->new_shapes)
      simulation_->add_shape(shape.id(), registry_.shapes().ref(shape.id()));
    std::move(given->commands.begin(), given->commands.end(), std::back_inserter(commands_));
    return absl::OkStatus();
  }

  void step() { simulation_->step(std::exchange(commands_, {})); }
  Tick tick() const { return simulation_->tick(); }
  std::string hash() const { return simulation_->hash().to_string(); }

 private:
  Playback(WorldRegistry registry, std::unique_ptr<Simulation> simulation)
      : registry_(std::move(registry)), simulation_(std::move(simulation)) {}

  WorldRegistry registry_;
  std::unique_ptr<Simulation> simulation_;
  std::vector<Command> commands_;
};

absl::Status other_bits(Tick tick, const std::string& cluster, const std::string& alone) {
  return absl::AbortedError(
      absl::StrCat("tick ", tick, ": the cluster has the hash ", cluster, ", one process ", alone));
}

}  // namespace

absl::StatusOr<std::string> Checker::untouched_hash(Tick tick) {
  std::string& hash = untouched_hashes_[tick];
  if (!hash.empty()) return hash;
  if (!untouched_ || untouched_->tick() > tick) {
    absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world_);
    if (!simulation.ok()) return simulation.status();
    untouched_ = *std::move(simulation);
  }
  while (untouched_->tick() < tick) {
    if (is_ended_()) return absl::CancelledError("interrupted");
    untouched_->step();
  }
  return hash = untouched_->hash().to_string();
}

absl::Status Checker::check(std::span<const v1::RecordedInput> log) {
  std::vector<const v1::RecordedCommands*> commands;
  absl::btree_map<Tick, std::string> hashes;  // may arrive after commands of later ticks
  for (const v1::RecordedInput& input : log) {
    if (input.has_commands()) commands.push_back(&input.commands());
    if (!input.has_hash()) continue;
    const auto [place, is_new] = hashes.try_emplace(input.hash().tick(), input.hash().hash());
    if (!is_new && place->second != input.hash().hash()) {
      return absl::AbortedError(absl::StrCat("tick ", input.hash().tick(), " has the hash ", place->second,
                                             ", and later ", input.hash().hash()));
    }
  }
  if (commands.empty()) {
    for (const auto& [tick, hash] : hashes) {
      const absl::StatusOr<std::string> alone = untouched_hash(tick);
      if (!alone.ok()) return alone.status();
      if (*alone != hash) return other_bits(tick, hash, *alone);
    }
    return absl::OkStatus();
  }
  absl::StatusOr<Playback> playback = Playback::create(world_);
  if (!playback.ok()) return playback.status();
  auto next = commands.begin();
  for (const auto& [tick, hash] : hashes) {
    while (playback->tick() < tick) {
      if (is_ended_()) return absl::CancelledError("interrupted");
      for (; next != commands.end() && (*next)->tick() == playback->tick() + 1; ++next) {
        if (absl::Status given = playback->give(**next); !given.ok()) {
          return absl::AbortedError(absl::StrCat("tick ", (*next)->tick(), ": ", given.message()));
        }
      }
      playback->step();
    }
    if (std::string alone = playback->hash(); alone != hash) return other_bits(tick, hash, alone);
  }
  return absl::OkStatus();
}

}  // namespace tessera
