#include "cli/prepared_run.h"

#include <utility>
#include <vector>

#include "proto/snapshot_file.h"

namespace tessera::cli {

namespace {

absl::StatusOr<PreparedRun> prepare_snapshot(const RunOptions& options, const std::string& mode) {
  const Clock::time_point begin = Clock::now();
  const WorldOverrides& overrides = options.overrides;
  if (overrides.knobs.any() || overrides.strict || overrides.shift != SectorOffset{}) {
    return absl::InvalidArgumentError("a snapshot has its settings: it cannot be run with others");
  }
  const absl::StatusOr<std::vector<v1::SnapshotChunk>> chunks = read_snapshot(options.from);
  if (!chunks.ok()) return chunks.status();
  absl::StatusOr<ReadSnapshot> snapshot = from_chunks(*chunks);
  if (!snapshot.ok()) return snapshot.status();
  const absl::StatusOr<std::uint64_t> ticks = ticks_of(options.seconds, snapshot->world.settings.time_step);
  if (!ticks.ok()) return ticks.status();
  PreparedRun run{.begin = begin, .loaded = {}, .snapshot = *std::move(snapshot), .report = {}};
  run.report.mode = mode;
  run.report.describe(*run.snapshot, options, *ticks);
  return run;
}

}  // namespace

absl::StatusOr<PreparedRun> prepare(const RunOptions& options, const std::string& mode) {
  if (!options.from.empty()) return prepare_snapshot(options, mode);
  const Clock::time_point begin = Clock::now();
  absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  const absl::StatusOr<std::uint64_t> ticks = ticks_of(options.seconds, loaded->world.settings.time_step);
  if (!ticks.ok()) return ticks.status();
  PreparedRun run{.begin = begin, .loaded = *std::move(loaded), .snapshot = {}, .report = {}};
  run.report.mode = mode;
  run.report.describe(run.loaded, options, *ticks);
  return run;
}

}  // namespace tessera::cli
