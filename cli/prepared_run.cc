#include "cli/prepared_run.h"

#include <utility>
#include <vector>

#include "proto/snapshot_file.h"

namespace tessera::cli {

namespace {

// Those of a world file have their ids in its order.
std::vector<Trajectory::Candidate> candidates_of(const PreparedRun& run) {
  std::vector<Trajectory::Candidate> bodies;
  const auto add = [&](BodyId id, const std::string& name, const BodyProperties& properties) {
    bodies.push_back({id, name, properties.motion == Motion::kStatic});
  };
  if (run.snapshot) {
    for (const auto& body : run.snapshot->catalogue.bodies) add(body.id, body.name, body.properties);
  } else {
    for (const BodyDescription& body : run.loaded.world.bodies)
      add(BodyId{bodies.size() + 1}, body.name, body.properties);
  }
  return bodies;
}

absl::StatusOr<PreparedRun> with_trajectory(PreparedRun run, const TrajectoryOptions& options) {
  if (options.file.empty()) return run;
  absl::StatusOr<std::unique_ptr<Trajectory>> trajectory =
      Trajectory::open(options, candidates_of(run), run.report.settings, run.report.first_tick);
  if (!trajectory.ok()) return trajectory.status();
  run.trajectory = *std::move(trajectory);
  return run;
}

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
  PreparedRun run{
      .begin = begin, .loaded = {}, .snapshot = *std::move(snapshot), .trajectory = {}, .report = {}};
  run.report.mode = mode;
  run.report.describe(*run.snapshot, options, *ticks);
  return with_trajectory(std::move(run), options.trajectory);
}

}  // namespace

absl::StatusOr<PreparedRun> prepare(const RunOptions& options, const std::string& mode) {
  if (!options.from.empty()) return prepare_snapshot(options, mode);
  const Clock::time_point begin = Clock::now();
  absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  const absl::StatusOr<std::uint64_t> ticks = ticks_of(options.seconds, loaded->world.settings.time_step);
  if (!ticks.ok()) return ticks.status();
  PreparedRun run{
      .begin = begin, .loaded = *std::move(loaded), .snapshot = {}, .trajectory = {}, .report = {}};
  run.report.mode = mode;
  run.report.describe(run.loaded, options, *ticks);
  return with_trajectory(std::move(run), options.trajectory);
}

}  // namespace tessera::cli
