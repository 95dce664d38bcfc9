// What a run is asked for, and what it found out: as a table for people, as JSON for programs.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/measure/movement.h"
#include "cli/measure/towers.h"
#include "cli/trajectory.h"
#include "cli/world_overrides.h"
#include "lpss/model/settings.h"
#include "lpss/model/tick_counts.h"
#include "lpss/model/tick_times.h"
#include "proto/snapshot.h"
#include "tessera/client.h"

namespace tessera::cli {

inline constexpr double kRunTicksMax = 1e12;

struct RunOptions {
  std::filesystem::path world;
  std::filesystem::path from;      // a snapshot, in the place of a world; empty: none
  std::filesystem::path snapshot;  // to be written at the end; empty: none
  TrajectoryOptions trajectory;
  WorldOverrides overrides;
  double seconds = 10;  // simulated
  int servers = 2;
  int threads = 0;  // of each process; 0: the machine's cores, shared among the servers
  bool in_process = false;
  bool plain = false;  // one plain Bullet world, in this process
  bool prove = false;
  bool check_programs = false;
  bool allow_divergence = false;
  std::filesystem::path json;  // empty: none
};

// The ticks that make up `seconds`, rounded. INVALID_ARGUMENT beyond kRunTicksMax.
absl::StatusOr<std::uint64_t> ticks_of(double seconds, double time_step);

// Threads of each process of a run on `processes` of them.
int threads_of(const RunOptions& options, int processes);

// Of the times of single ticks (ms, in any order).
TickTimes tick_times(std::vector<double> milliseconds);

struct RunReport {
  std::string mode;  // "cluster", "in-process", "plain"
  std::string world;
  std::string world_hash;
  std::string program_hash;      // empty: there are no programs
  std::uint64_t first_tick = 0;  // completed before the run: of the snapshot
  std::uint64_t ticks = 0;
  std::uint64_t bodies = 0;   // static ones too
  std::uint64_t sectors = 0;  // with a body that can move, at the end
  TickCounts counts;          // over all ticks: see kTickCounters
  double real_time_factor = 0;
  TickTimes tick_ms;
  double peak_rss_mb = 0;  // of the largest process
  std::vector<std::pair<std::string, double>> peak_rss_mb_by_process;
  int servers = 0;  // 0: in this process
  int threads = 1;  // of each process
  WorldSettings settings;
  double load_seconds = 0;
  double wall_seconds = 0;  // of the ticks
  std::vector<std::string> notices;
  std::vector<std::string> repairs;  // of faults of the world file
  std::optional<TowerReport> towers;
  std::optional<MovementReport> movement;    // of a run in this process
  std::vector<NamedDivergence> divergences;  // the first kDivergencesKept; `counts` has the number of all

  // Fills in what the world and the options say.
  void describe(const LoadedWorld& loaded, const RunOptions& options, std::uint64_t tick_count);
  void describe(const ReadSnapshot& snapshot, const RunOptions& options, std::uint64_t tick_count);
  // How long the ticks took, which gives the real-time factor.
  void set_wall_time(double seconds);
};

nlohmann::json to_json(const RunReport& report);
absl::StatusOr<RunReport> report_from_json(const nlohmann::json& json);
nlohmann::json to_json(const TowerReport& towers);
nlohmann::json to_json(const MovementReport& movement);

// Several lines for standard output.
std::string to_text(const RunReport& report);

// NOT_FOUND, or DATA_LOSS for what is no JSON.
absl::StatusOr<nlohmann::json> read_json(const std::filesystem::path& file);

// The peak memory of a process so far, in MB (10^6 bytes); 0 where there is no such process.
double peak_rss_mb(pid_t process);

}  // namespace tessera::cli
