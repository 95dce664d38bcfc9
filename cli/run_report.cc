#include "cli/run_report.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>
#include <thread>

#include "cli/terminal.h"
#include "cli/text.h"
#include "client_sdk/src/status_json.h"
#include "proto/peak_memory.h"
#include "proto/settings_json.h"

namespace tessera::cli {
namespace {

double percentile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0;
  const auto place = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(place, 1, sorted.size()) - 1];
}

// JSON has no infinity: it is written as null.
double distance_from(const nlohmann::json& json) {
  return json.is_number() ? json.get<double>() : std::numeric_limits<double>::infinity();
}

}  // namespace

absl::StatusOr<std::uint64_t> ticks_of(double seconds, double time_step) {
  const double ticks = std::round(seconds / time_step);
  if (!(ticks >= 0 && ticks <= kRunTicksMax)) {
    return absl::InvalidArgumentError(absl::StrCat("--seconds ", seconds, " at a time step of ", time_step,
                                                   " s is beyond ", kRunTicksMax, " ticks"));
  }
  return static_cast<std::uint64_t>(ticks);
}

int threads_of(const RunOptions& options, int processes) {
  if (options.threads > 0) return options.threads;
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  return std::max(1, cores / processes);
}

TickTimes tick_times(std::vector<double> milliseconds) {
  std::sort(milliseconds.begin(), milliseconds.end());
  const double sum = std::accumulate(milliseconds.begin(), milliseconds.end(), 0.0);
  return {.mean = milliseconds.empty() ? 0 : sum / static_cast<double>(milliseconds.size()),
          .p50 = percentile(milliseconds, 0.5),
          .p99 = percentile(milliseconds, 0.99),
          .max = percentile(milliseconds, 1)};
}

void RunReport::describe(const LoadedWorld& loaded, const RunOptions& options, std::uint64_t tick_count) {
  settings = loaded.world.settings;
  world = loaded.world.name;
  ticks = tick_count;
  bodies = loaded.world.bodies.size();
  servers = options.in_process || options.plain ? 0 : options.servers;
  threads = threads_of(options, std::max(1, servers));
  notices = loaded.notices;
  repairs = loaded.repairs;
}

void RunReport::describe(const ReadSnapshot& snapshot, const RunOptions& options, std::uint64_t tick_count) {
  settings = snapshot.world.settings;
  world = snapshot.catalogue.name;
  first_tick = snapshot.world.tick;
  ticks = tick_count;
  bodies = snapshot.catalogue.bodies.size();
  servers = options.in_process ? 0 : options.servers;
  threads = threads_of(options, std::max(1, servers));
}

void RunReport::set_wall_time(double seconds) {
  wall_seconds = seconds;
  real_time_factor = seconds > 0 ? static_cast<double>(ticks) * settings.time_step / seconds : 0;
}

nlohmann::json to_json(const TowerReport& towers) {
  return {{"towers", towers.towers},
          {"standing", towers.standing},
          {"displacement_median_m", towers.displacement_median},
          {"displacement_max_m", towers.displacement_max},
          {"standing_below_m", kStandingDisplacementMax}};
}

nlohmann::json to_json(const MovementReport& movement) {
  return {{"bodies", movement.bodies},
          {"moved", movement.moved},
          {"moved_from_m", kMovedMin},
          {"coordinate_max_m", movement.coordinate_max},
          {"coordinate_step_m", movement.coordinate_step}};
}

nlohmann::json to_json(const RunReport& report) {
  nlohmann::json json = {
      {"mode", report.mode},
      {"world", report.world},
      {"world_hash", report.world_hash},
      {"program_hash", report.program_hash},
      {"first_tick", report.first_tick},
      {"ticks", report.ticks},
      {"bodies", report.bodies},
      {"sectors", report.sectors},
      {"real_time_factor", report.real_time_factor},
      {"tick_ms", to_json(report.tick_ms)},
      {"peak_rss_mb", report.peak_rss_mb},
      {"servers", report.servers},
      {"threads", report.threads},
      {"settings", to_json(report.settings)},
      {"load_seconds", report.load_seconds},
      {"wall_seconds", report.wall_seconds},
      {"notices", report.notices},
      {"repairs", report.repairs},
  };
  for (const TickCounter& counter : kTickCounters) json[counter.name_in_run] = report.counts.*counter.value;
  nlohmann::json& divergences = json["divergences"] = nlohmann::json::array();
  for (const NamedDivergence& divergence : report.divergences) divergences.push_back(to_json(divergence));
  for (const auto& [process, peak] : report.peak_rss_mb_by_process)
    json["peak_rss_mb_by_process"][process] = peak;
  if (report.towers) json["towers"] = to_json(*report.towers);
  if (report.movement) json["movement"] = to_json(*report.movement);
  return json;
}

absl::StatusOr<RunReport> report_from_json(const nlohmann::json& json) {
  try {
    RunReport report;
    report.mode = json.at("mode").get<std::string>();
    report.world_hash = json.at("world_hash").get<std::string>();
    report.program_hash = json.at("program_hash").get<std::string>();
    report.ticks = json.at("ticks").get<std::uint64_t>();
    report.real_time_factor = json.at("real_time_factor").get<double>();
    for (const TickCounter& counter : kTickCounters)
      report.counts.*counter.value = json.at(counter.name_in_run).get<std::uint64_t>();
    if (const auto towers = json.find("towers"); towers != json.end()) {
      report.towers =
          TowerReport{towers->at("towers").get<std::size_t>(), towers->at("standing").get<std::size_t>(),
                      distance_from(towers->at("displacement_median_m")),
                      distance_from(towers->at("displacement_max_m"))};
    }
    if (const auto movement = json.find("movement"); movement != json.end()) {
      report.movement = MovementReport{
          movement->at("bodies").get<std::size_t>(), movement->at("moved").get<std::size_t>(),
          distance_from(movement->at("coordinate_max_m")), distance_from(movement->at("coordinate_step_m"))};
    }
    return report;
  } catch (const nlohmann::json::exception& error) {
    return absl::DataLossError(absl::StrCat("the report of a run is not complete: ", error.what()));
  }
}

std::string to_text(const RunReport& report) {
  std::vector<std::vector<std::string>> rows;
  const auto row = [&](std::string name, std::string value) {
    rows.push_back({std::move(name), std::move(value)});
  };
  const double simulated = static_cast<double>(report.ticks) * report.settings.time_step;
  row("world",
      absl::StrFormat("%s, %s, sectors of %g m, seams %s", report.world, name_of(report.settings.precision),
                      report.settings.sector_size, name_of(report.settings.seams)));
  const std::string threads = absl::StrCat(report.threads, report.threads == 1 ? " thread" : " threads");
  if (report.first_tick > 0) row("from", absl::StrCat("a snapshot of tick ", grouped(report.first_tick)));
  row("servers", report.servers == 0 ? absl::StrCat("none (", report.mode, "), ", threads)
                                     : absl::StrCat(report.servers, ", each with ", threads));
  row("bodies", grouped(report.bodies));
  for (const TickCounter& counter : kTickCounters) {
    const bool is_total = counter.over_ticks == OverTicks::kTotal;
    row(title_of(counter), absl::StrCat(grouped(report.counts.*counter.value), is_total ? "" : " at most"));
  }
  row("simulated", absl::StrFormat("%g s in %s ticks, in %.2f s (and %.2f s to load)", simulated,
                                   grouped(report.ticks), report.wall_seconds, report.load_seconds));
  row("real-time factor", absl::StrFormat("%.2f", report.real_time_factor));
  row("tick", absl::StrFormat("mean %.2f ms, p50 %.2f ms, p99 %.2f ms, max %.2f ms", report.tick_ms.mean,
                              report.tick_ms.p50, report.tick_ms.p99, report.tick_ms.max));
  row("peak memory", absl::StrFormat("%.0f MB (largest process)", report.peak_rss_mb));
  row("world hash", report.world_hash);
  if (!report.program_hash.empty()) row("program hash", report.program_hash);
  std::string text = table(rows, {}, false);
  for (const NamedDivergence& divergence : report.divergences)
    absl::StrAppend(&text, "diverged: ", to_text(divergence), "\n");
  if (report.counts.diverged > report.divergences.size()) {
    absl::StrAppend(&text, "diverged: ", report.counts.diverged - report.divergences.size(),
                    " times more, later\n");
  }
  absl::StrAppend(&text, file_notes(report.notices, report.repairs));
  return text;
}

absl::StatusOr<nlohmann::json> read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", file.string()));
  nlohmann::json json = nlohmann::json::parse(in, nullptr, false);
  if (json.is_discarded()) return absl::DataLossError(absl::StrCat(file.string(), " is no JSON"));
  return json;
}

double peak_rss_mb(pid_t process) { return static_cast<double>(peak_rss_bytes(process)) / 1e6; }

}  // namespace tessera::cli
