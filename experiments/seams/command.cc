#include "experiments/seams/command.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cstdlib>
#include <memory>

#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/progress.h"
#include "cli/terminal.h"
#include "cli/world_options.h"
#include "experiments/local_servers.h"
#include "experiments/output.h"
#include "experiments/seams/report.h"

namespace tessera::seams {
namespace {

struct SeamOptions {
  std::vector<std::string> scenes;
  std::vector<std::string> policies;
  std::vector<std::string> placements;
  Precision precision = Precision::kFloat32;
  bool quick = false;
  int seeds = -1;  // of simulated networks; negative: the battery's default
  bool no_costs = false;
  std::filesystem::path json;
  std::filesystem::path csv;
};

// Two servers, started for the first world and reused for all others.
class TwoServers {
 public:
  explicit TwoServers(Precision precision) : precision_(precision) {}

  absl::StatusOr<RemoteRun> run(const WorldDescription& world, Tick ticks, Tick unmeasured) {
    if (absl::Status started = start(); !started.ok()) return started;
    RemoteRun run;
    const absl::Status status =
        servers_->cluster().attend([&] { return step(world, ticks, unmeasured, run); });
    if (!status.ok()) return status;
    return run;
  }

 private:
  absl::Status start() {
    if (servers_) return absl::OkStatus();
    absl::StatusOr<std::unique_ptr<experiments::LocalServers>> servers =
        experiments::LocalServers::start(2, precision_);
    if (!servers.ok()) return servers.status();
    servers_ = *std::move(servers);
    return absl::OkStatus();
  }

  absl::Status step(const WorldDescription& world, Tick ticks, Tick unmeasured, RemoteRun& run) {
    absl::Status status = servers_->client().load(world, /*replace=*/true).status();
    if (status.ok() && unmeasured > 0) status = servers_->client().step(unmeasured).status();
    if (status.ok()) status = measure(ticks - unmeasured, run);
    if (!status.ok()) return status;
    const absl::StatusOr<HashAt> hash = servers_->client().hash();
    if (!hash.ok()) return hash.status();
    run.world_hash = hash->hash;
    return absl::OkStatus();
  }

  absl::Status measure(Tick ticks, RemoteRun& run) {
    constexpr Tick kBetween = 10;  // minimum number of ticks between two samples of the contacts
    const Tick stride = std::max(kBetween, ticks / 15);
    absl::StatusOr<ClusterStatus> status = servers_->client().status();
    if (!status.ok()) return status.status();
    const std::uint64_t bytes_before = bytes(*status);
    std::uint64_t contacts = 0;
    std::uint64_t looks = 0;
    for (Tick done = 0; done < ticks; done += stride) {
      if (auto stepped = servers_->client().step(std::min(stride, ticks - done)); !stepped.ok())
        return stepped.status();
      status = servers_->client().status();
      if (!status.ok()) return status.status();
      contacts += status->counts.contacts;
      ++looks;
    }
    run.tick_ms = status->tick_ms.p50;
    run.exchange_bytes = bytes(*status) - bytes_before;
    run.contacts = static_cast<double>(contacts) / static_cast<double>(std::max<std::uint64_t>(looks, 1));
    run.islands_shipped = status->counts_since_load.islands_shipped;
    return absl::OkStatus();
  }

  static std::uint64_t bytes(const ClusterStatus& status) {
    std::uint64_t sum = 0;
    for (const ServerStatus& server : status.servers) sum += server.exchange_bytes;
    return sum;
  }

  Precision precision_;
  std::unique_ptr<experiments::LocalServers> servers_;
};

template <typename All, typename NameOf>
absl::Status no_such(const char* what, const std::string& name, const All& all, NameOf name_of) {
  const auto append_name = [&](std::string* text, const auto& one) { text->append(name_of(one)); };
  return absl::InvalidArgumentError(
      absl::StrCat("unknown ", what, " \"", name, "\"; known are ", absl::StrJoin(all, ", ", append_name)));
}

// The values of `all` that `wanted` names, or all of them if it is empty.
template <typename T, std::size_t n, typename Parse>
absl::StatusOr<std::vector<T>> chosen(const char* what, const T (&all)[n],
                                      const std::vector<std::string>& wanted, Parse parse) {
  if (wanted.empty()) return std::vector<T>(std::begin(all), std::end(all));
  std::vector<T> values;
  for (const std::string& name : wanted) {
    const std::optional<T> value = parse(name);
    if (!value) return no_such(what, name, all, [](T known) { return name_of(known); });
    values.push_back(*value);
  }
  return values;
}

absl::StatusOr<std::vector<Scene>> chosen_scenes(const SeamOptions& options, const std::string& worlds) {
  std::vector<Scene> scenes = all_scenes(worlds);
  for (const std::string& name : options.scenes) {
    if (std::none_of(scenes.begin(), scenes.end(), [&](const auto& scene) { return scene.name == name; })) {
      return no_such("scene", name, scenes, [](const Scene& scene) { return scene.name; });
    }
  }
  std::erase_if(scenes, [&](const Scene& scene) {
    if (options.scenes.empty()) return options.quick && scene.heavy;
    return std::find(options.scenes.begin(), options.scenes.end(), scene.name) == options.scenes.end();
  });
  return scenes;
}

absl::StatusOr<BatteryOptions> battery_of(const SeamOptions& options, const std::string& worlds) {
  BatteryOptions battery;
  battery.precision = options.precision;
  absl::StatusOr<std::vector<Scene>> scenes = chosen_scenes(options, worlds);
  if (!scenes.ok()) return scenes.status();
  battery.scenes = *std::move(scenes);
  auto placements = chosen("placement", kPlacements, options.placements, placement_named);
  if (!placements.ok()) return placements.status();
  battery.placements = *std::move(placements);
  auto policies = chosen("policy", kPolicies, options.policies, policy_named);
  if (!policies.ok()) return policies.status();
  battery.policies = *std::move(policies);
  if (options.quick) {
    battery.references_elsewhere = 3;
    battery.hashes = {.seeds = 3, .shuffles = 2, .ticks = 60, .ticks_heavy = 10};
  }
  if (options.seeds >= 0) battery.hashes.seeds = options.seeds;
  return battery;
}

std::string short_number(double value) { return std::isfinite(value) ? absl::StrFormat("%.2g", value) : "-"; }

// One line per row; a "no" under "stands" is red.
std::string to_text(const Results& results) {
  std::vector<std::vector<std::string>> lines = {{"scene", "placement", "policy", "stands", "error, m",
                                                  "momentum", "energy", "overlap, m", "joint gap, m", "twice",
                                                  "bits"}};
  for (const Row& row : results.rows) {
    const Course& course = row.course;
    lines.push_back({row.scene, name_of(row.placement), name_of(row.policy),
                     row.stands ? "yes" : cli::coloured("no", cli::Colour::kRed),
                     short_number(row.max_error_m), short_number(course.momentum_drift),
                     short_number(course.energy_drift), short_number(course.penetration_max),
                     short_number(course.joint_gap_max), absl::StrCat(course.duplicate_events),
                     !row.same_bits   ? ""
                     : *row.same_bits ? "same"
                                      : cli::coloured("OTHER", cli::Colour::kRed)});
  }
  return cli::table(lines, {false, false, false, false, true, true, true, true, true, true, false});
}

// `end` is how the measurement ended: JSON says so where that was before its time.
absl::Status write_files(const SeamOptions& options, const Results& results, const Costs& costs,
                         const absl::Status& end) {
  if (!options.json.empty()) {
    nlohmann::json json = to_json(results, costs, options.precision);
    if (!end.ok()) json["stopped"] = end.message();
    if (absl::Status status = cli::write_json(options.json, json); !status.ok()) return status;
  }
  if (options.csv.empty()) return absl::OkStatus();
  if (absl::Status status = cli::write_text(options.csv, to_csv(results, options.precision)); !status.ok())
    return status;
  if (options.no_costs) return absl::OkStatus();
  return cli::write_text(experiments::beside(options.csv, "costs"), to_csv(costs));
}

void print(const Results& results, const Costs& costs, Precision precision) {
  absl::PrintF("%s\n", to_text(results));
  for (const Noise& noise : results.noise) {
    absl::PrintF("noise floor of %-24s %.2g m\n", noise.scene, noise.error_m);
  }
  for (const Equality& equality : results.equalities) {
    absl::PrintF("%-26s %-7s same bits: %d of %d seeds, %d of %d shuffles, ten servers: %s\n", equality.scene,
                 name_of(equality.policy), equality.seeds_equal, equality.seeds, equality.shuffles_equal,
                 equality.shuffles, equality.ten_partitions_equal ? "yes" : "no");
  }
  absl::PrintF("%s", to_csv(costs));
  const std::vector<std::string> missed = misses(results, precision);
  for (const std::string& miss : missed)
    absl::PrintF("%s %s\n", cli::coloured("misses:", cli::Colour::kRed), miss);
}

absl::Status measure_seams(const SeamOptions& options) {
  cli::catch_interrupts();
  const char* folder = std::getenv("TESSERA_WORLDS");
  const std::string worlds = folder == nullptr ? "" : folder;
  const absl::StatusOr<BatteryOptions> battery = battery_of(options, worlds);
  if (!battery.ok()) return battery.status();
  TwoServers servers(options.precision);
  const RunRemotely run_remotely = [&](const WorldDescription& world, Tick ticks, Tick unmeasured) {
    return servers.run(world, ticks, unmeasured);
  };
  Results results;
  absl::Status status = cli::with_bar("seams", [&](const Progress& progress) {
    return run_battery(*battery, run_remotely, progress, results);
  });
  Costs costs;
  if (status.ok() && !options.no_costs) {
    CostOptions cost_options{.precision = options.precision, .worlds = worlds};
    if (options.quick) {
      cost_options.pile = 400;
      cost_options.ticks = 60;
    }
    status = cli::with_bar("costs", [&](const Progress& progress) {
      return measure_costs(cost_options, run_remotely, progress, costs);
    });
  }
  const std::size_t rows = results.rows.size();
  if (rows == 0 && !status.ok()) return status;
  if (!status.ok())
    status = absl::Status(status.code(), absl::StrFormat("%s after %d rows", status.message(), rows));
  print(results, costs, options.precision);
  if (worlds.empty()) absl::PrintF("$TESSERA_WORLDS is not set: skipping diff_drive, r2d2 and 3k_shapes\n");
  absl::Status written = write_files(options, results, costs, status);
  return written.ok() ? status : written;
}

}  // namespace

void add_seams_command(CLI::App& app, cli::Action& action) {
  CLI::App& command = cli::add_command(
      app, "seams",
      "Run scenes with and without borders of sectors through them, on one server and on two, and compare.",
      "tessera experiment seams --quick --scene tower_level --policy island --json seams.json");
  const auto options = std::make_shared<SeamOptions>();
  command.add_option("--scene", options->scenes, "only this scene; repeatable");
  command.add_option("--policy", options->policies,
                     "only none, clone-1, clone-2, clone-4 or island; repeatable");
  command.add_option("--placement", options->placements,
                     "only reference, local, remote or corner; repeatable");
  add_parsed(command, "--engine", options->precision, cli::parse_precision, "f32 or f64; default: f32");
  command.add_flag("--quick", options->quick, "fewer seeds, no large pile, short costs");
  command
      .add_option("--seeds", options->seeds, "simulated networks per scene; default: 100, or 3 with --quick")
      ->check(CLI::Range(0, 1'000'000));
  command.add_flag("--no-costs", options->no_costs, "skip measuring times and bytes");
  add_parsed(command, "--json", options->json, cli::parse_output_file, "write all results to this file");
  add_parsed(command, "--csv", options->csv, cli::parse_output_file,
             "write the rows to this file, and the costs to one next to it");
  command.callback([options, &action] { action = [options] { return measure_seams(*options); }; });
}

}  // namespace tessera::seams
