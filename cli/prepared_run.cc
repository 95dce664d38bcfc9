#include "cli/prepared_run.h"

#include <utility>

namespace tessera::cli {

absl::StatusOr<PreparedRun> prepare(const RunOptions& options, const std::string& mode) {
  const Clock::time_point begin = Clock::now();
  absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  const absl::StatusOr<std::uint64_t> ticks = ticks_of(options.seconds, loaded->world.settings.time_step);
  if (!ticks.ok()) return ticks.status();
  PreparedRun run{.begin = begin, .loaded = *std::move(loaded), .report = {}};
  run.report.mode = mode;
  run.report.describe(run.loaded, options, *ticks);
  return run;
}

}  // namespace tessera::cli
