#include "simulator/checker.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <deque>
#include <iterator>
#include <utility>
#include <vector>

#include "coordinator/command_list.h"
#include "coordinator/world_registry.h"
#include "proto/convert.h"
#include "proto/snapshot.h"
#include "simulator/processor_time.h"

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
    return Playback(WorldRegistry(world, *records, *joints), *std::move(simulation), {});
  }

  static absl::StatusOr<Playback> create(const SnapshotChunks& chunks) {
    absl::StatusOr<ReadSnapshot> snapshot = from_chunks(chunks);
    if (!snapshot.ok()) return snapshot.status();
    snapshot->world.settings.shuffle = 0;
    absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::restore(snapshot->world);
    if (!simulation.ok()) return simulation.status();
    WorldRegistry registry(snapshot->world, snapshot->catalogue);
    std::vector<WorldCatalogue::HeldBatch>& held = snapshot->catalogue.held;
    return Playback(std::move(registry), *std::move(simulation),
                    {std::make_move_iterator(held.begin()), std::make_move_iterator(held.end())});
  }

  // Gives commands for the next tick.
  absl::Status give(const v1::RecordedCommands& recorded) {
    absl::StatusOr<GivenCommands> given = give_again(recorded, registry_);
    if (!given.ok()) return given.status();
    for (const v1::NumberedShape& shape : given->new_shapes)
      simulation_->add_shape(shape.id(), registry_.shapes().ref(shape.id()));
    for (const std::shared_ptr<const ProgramModule>& module : given->new_modules)
      simulation_->add_module(module);
    std::ranges::move(given->commands.unpacked(), std::back_inserter(commands_));
    return absl::OkStatus();
  }

  // Commands that a snapshot has for the tick come first.
  void step() {
    if (!held_.empty()) {
      for (const ShapeEntry& entry : held_.front().new_shapes) simulation_->add_shape(entry.id, entry.shape);
      std::vector<Command>& first = held_.front().commands;
      commands_.insert(commands_.begin(), first.begin(), first.end());
      held_.pop_front();
    }
    simulation_->step(std::exchange(commands_, {}));
  }
  Tick tick() const { return simulation_->tick(); }
  TickHashes hashes() const { return hashes_of(*simulation_); }

 private:
  Playback(WorldRegistry registry, std::unique_ptr<Simulation> simulation,
           std::deque<WorldCatalogue::HeldBatch> held)
      : registry_(std::move(registry)), simulation_(std::move(simulation)), held_(std::move(held)) {}

  WorldRegistry registry_;
  std::unique_ptr<Simulation> simulation_;
  std::deque<WorldCatalogue::HeldBatch> held_;  // of the ticks that come first
  std::vector<Command> commands_;
};

absl::Status compare(Tick tick, const TickHashes& cluster, const TickHashes& alone) {
  const auto other = [tick](absl::string_view of, const std::string& there, const std::string& here) {
    return absl::AbortedError(
        absl::StrCat("tick ", tick, ": the cluster has the hash ", there, of, ", one process ", here));
  };
  if (cluster.world != alone.world) return other("", cluster.world, alone.world);
  if (cluster.programs != alone.programs) return other(" of programs", cluster.programs, alone.programs);
  return absl::OkStatus();
}

absl::Status too_long(Tick tick, std::chrono::nanoseconds taken, std::chrono::nanoseconds most,
                      const std::string& commands) {
  constexpr std::size_t kCommandsShown = 20'000;  // bytes
  return absl::AbortedError(
      absl::StrFormat("tick %d took %.0f ms of processor time, and may take %.0f ms; its commands: %s", tick,
                      static_cast<double>(taken.count()) / 1e6, static_cast<double>(most.count()) / 1e6,
                      commands.empty() ? "none" : commands.substr(0, kCommandsShown)));
}

}  // namespace

TickHashes hashes_of(const Simulation& simulation) {
  const WorldHash programs = simulation.program_hash();
  return {simulation.hash().to_string(), programs == WorldHash() ? "" : programs.to_string()};
}

absl::StatusOr<std::string> Checker::untouched_hash(Tick tick) {
  const absl::StatusOr<TickHashes> hashes = untouched(tick);
  if (!hashes.ok()) return hashes.status();
  return hashes->world;
}

absl::StatusOr<TickHashes> Checker::untouched(Tick tick) {
  TickHashes& hashes = untouched_hashes_[tick];
  if (!hashes.world.empty()) return hashes;
  if (!untouched_ || untouched_->tick() > tick) {
    absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(world_);
    if (!simulation.ok()) return simulation.status();
    untouched_ = *std::move(simulation);
  }
  while (untouched_->tick() < tick) {
    if (is_ended_()) return absl::CancelledError("interrupted");
    untouched_->step();
  }
  return hashes = hashes_of(*untouched_);
}

absl::Status Checker::check(std::span<const v1::RecordedInput> log, const SnapshotChunks* from) {
  bool has_commands = false;
  absl::btree_map<Tick, TickHashes> hashes;  // may arrive after commands of later ticks
  for (const v1::RecordedInput& input : log) {
    has_commands |= input.has_commands();
    if (!input.has_hash()) continue;
    const TickHashes now{input.hash().hash(), input.hash().programs()};
    const auto [place, is_new] = hashes.try_emplace(input.hash().tick(), now);
    if (!is_new && place->second != now) {
      const TickHashes& before = place->second;
      return absl::AbortedError(absl::StrCat("tick ", input.hash().tick(), " has the hash ", before.world,
                                             " (of programs: ", before.programs, "), and later ", now.world,
                                             " (", now.programs, ")"));
    }
  }
  if (has_commands || from != nullptr) return play(log, hashes, from);
  for (const auto& [tick, hash] : hashes) {
    const absl::StatusOr<TickHashes> alone = untouched(tick);
    if (!alone.ok()) return alone.status();
    if (absl::Status same = compare(tick, hash, *alone); !same.ok()) return same;
  }
  return absl::OkStatus();
}

absl::Status Checker::play(std::span<const v1::RecordedInput> log,
                           const absl::btree_map<Tick, TickHashes>& hashes, const SnapshotChunks* from) {
  absl::StatusOr<Playback> playback = from == nullptr ? Playback::create(world_) : Playback::create(*from);
  if (!playback.ok()) return playback.status();
  auto next = log.begin();
  for (const auto& [tick, hash] : hashes) {
    while (playback->tick() < tick) {
      if (is_ended_()) return absl::CancelledError("interrupted");
      std::string commands;
      for (; next != log.end(); ++next) {
        if (!next->has_commands()) continue;
        if (next->commands().tick() != playback->tick() + 1) break;
        if (absl::Status given = playback->give(next->commands()); !given.ok()) {
          return absl::AbortedError(absl::StrCat("tick ", next->commands().tick(), ": ", given.message()));
        }
        if (tick_work_max_.count() > 0) absl::StrAppend(&commands, next->commands().ShortDebugString(), "\n");
      }
      const std::chrono::nanoseconds begin = processor_time_of_thread();
      playback->step();
      const std::chrono::nanoseconds taken = processor_time_of_thread() - begin;
      longest_tick_ = std::max(longest_tick_, taken);
      if (tick_work_max_.count() > 0 && taken > tick_work_max_)
        return too_long(playback->tick(), taken, tick_work_max_, commands);
    }
    if (absl::Status same = compare(tick, hash, playback->hashes()); !same.ok()) return same;
  }
  return absl::OkStatus();
}

}  // namespace tessera
