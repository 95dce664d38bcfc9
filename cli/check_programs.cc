#include "cli/check_programs.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "cli/interrupt.h"
#include "cli/text.h"
#include "lpss/observe/state.h"
#include "lpss/programs/registry.h"
#include "lpss/simulation/partition_cluster.h"

namespace tessera::cli {
namespace {

constexpr std::uint32_t kShuffledPartitions = 3;
constexpr std::uint32_t kRestoredPartitions = 2;

using Bodies = std::map<BodyId, std::vector<ProgramRecord>>;

Bodies programmed(PartitionCluster& cluster) {
  Bodies bodies;
  for (Rank rank = 0; rank < cluster.size(); ++rank) {
    for_each_programmed(cluster.partition(rank),
                        [&](const ProgramsView& of) { bodies.emplace(of.id, of.programs); });
  }
  return bodies;
}

// The first number of two that differs, by its name; empty where none does.
std::string difference(const ProgramRecord& a, const ProgramRecord& b) {
  const Program* const program = find_program(a.kind);
  if (program == nullptr || a.kind != b.kind) return "its kind";
  const auto differs = [](const std::vector<double>& x, const std::vector<double>& y,
                          std::span<const NumberSpec> table) -> std::string {
    for (std::size_t n = 0; n < std::min(x.size(), y.size()); ++n) {
      if (x[n] != y[n]) return absl::StrFormat("%s, %.17g and %.17g", table[n].name, x[n], y[n]);
    }
    return {};
  };
  for (const std::string& text :
       {differs(a.parameters, b.parameters, program->parameters()),
        differs(a.inputs, b.inputs, program->inputs()), differs(a.values, b.values, program->values())}) {
    if (!text.empty()) return text;
  }
  return a.wake_at != b.wake_at ? "when it wakes" : a.fault != b.fault ? "why it was stopped" : "";
}

std::string name_of(const WorldDescription& world, BodyId id) {
  return id.value <= world.bodies.size() ? world.bodies[id.value - 1].name : absl::StrCat("body ", id.value);
}

// Where two runs of the world differ that have different hashes.
std::string first_difference(const WorldDescription& world, PartitionCluster& alone,
                             PartitionCluster& other) {
  const Bodies ours = programmed(alone);
  const Bodies theirs = programmed(other);
  for (const auto& [id, programs] : ours) {
    const auto found = theirs.find(id);
    if (found == theirs.end()) return absl::StrCat(name_of(world, id), ": it is not there");
    for (std::size_t place = 0; place < programs.size(); ++place) {
      const std::string text = difference(programs[place], found->second.at(place));
      if (!text.empty())
        return absl::StrCat("program ", place, " (", programs[place].kind, ") of ", name_of(world, id), ": ",
                            text);
    }
  }
  return "bodies, not programs";
}

absl::Status compare(const WorldDescription& world, PartitionCluster& alone, PartitionCluster& other,
                     const char* how) {
  if (alone.hash() == other.hash() && alone.program_hash() == other.program_hash()) return absl::OkStatus();
  return absl::AbortedError(absl::StrCat("at tick ", alone.tick(), ", ", how, " differs from one server: ",
                                         first_difference(world, alone, other)));
}

}  // namespace

absl::StatusOr<CheckedPrograms> check_programs(const WorldDescription& world, std::uint64_t ticks) {
  absl::StatusOr<std::unique_ptr<PartitionCluster>> alone = PartitionCluster::create(world, 1);
  if (!alone.ok()) return alone.status();
  WorldDescription shuffled_world = world;
  shuffled_world.settings.shuffle = 1;
  absl::StatusOr<std::unique_ptr<PartitionCluster>> shuffled =
      PartitionCluster::create(shuffled_world, kShuffledPartitions);
  if (!shuffled.ok()) return shuffled.status();
  std::unique_ptr<PartitionCluster> restored;
  CheckedPrograms checked;
  for (; checked.ticks < ticks; ++checked.ticks) {
    if (interrupted()) return absl::CancelledError("interrupted");
    if (checked.ticks == ticks / 2) {
      absl::StatusOr<std::unique_ptr<PartitionCluster>> again =
          PartitionCluster::restore((*shuffled)->snapshot(), kRestoredPartitions);
      if (!again.ok()) return again.status();
      restored = *std::move(again);
    }
    (*alone)->step();
    (*shuffled)->step();
    if (restored) restored->step();
    checked.instances_max = std::max(checked.instances_max, (*alone)->counts().programs);
    if (absl::Status status = compare(world, **alone, **shuffled, "the run on three shuffled servers");
        !status.ok())
      return status;
    if (!restored) continue;
    if (absl::Status status = compare(world, **alone, *restored, "the run that was restored"); !status.ok())
      return status;
  }
  return checked;
}

std::string to_text(const CheckedPrograms& checked) {
  return absl::StrCat(
      "programs checked: ", grouped(checked.ticks), " ticks, up to ", grouped(checked.instances_max),
      " instances in one, the same on one server, on three that are shuffled, and restored\n");
}

}  // namespace tessera::cli
