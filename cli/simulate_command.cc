// `tessera simulate`: a whole cluster on a simulated network and disk, replayable from its seed.
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>
#include <absl/time/clock.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/run_apart.h"
#include "cli/world_options.h"
#include "simulator/scenario.h"
#include "simulator/shrink.h"

namespace tessera::cli {
namespace {

constexpr int kShrinkTriesMax = 200;
constexpr std::uint32_t kPlacesMax = 1'000'000;

struct SimulateOptions {
  std::filesystem::path world;  // empty: corner_pile()
  WorldOverrides overrides;
  Scenario scenario;  // the first of them
  std::uint64_t seeds = 1;
  std::string only_faults;
  std::string only_commands;
  bool shrinks = true;
  bool shows_log = false;
  std::filesystem::path json;
};

absl::StatusOr<WorldDescription> world_of(const SimulateOptions& options) {
  if (options.world.empty()) {
    WorldDescription world = corner_pile();
    if (absl::Status status = apply(options.overrides, world); !status.ok()) return status;
    return world;
  }
  absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  return std::move(loaded->world);
}

// As text_of_places() writes them.
absl::StatusOr<std::vector<std::uint32_t>> places_from(absl::string_view option, const std::string& text) {
  std::vector<std::uint32_t> places;
  if (text == "none") return places;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    const std::pair<absl::string_view, absl::string_view> ends =
        absl::StrSplit(part, absl::MaxSplits('-', 1));
    std::uint32_t first = 0;
    std::uint32_t last = 0;
    const bool is_range = absl::SimpleAtoi(ends.first, &first) &&
                          absl::SimpleAtoi(ends.second.empty() ? ends.first : ends.second, &last) &&
                          first <= last && last <= kPlacesMax;
    if (!is_range)
      return absl::InvalidArgumentError(absl::StrCat(option, ": '", part, "' is no place in the list"));
    for (std::uint32_t place = first; place <= last; ++place) places.push_back(place);
  }
  std::ranges::sort(places);
  return places;
}

// A broken invariant ends this process: then this says which scenario it was.
std::array<char, 4096> running_command{};

void tell_running_command(int) {
  constexpr char kIntroduction[] = "to repeat it: ";
  [[maybe_unused]] ssize_t ignored = ::write(STDERR_FILENO, kIntroduction, sizeof kIntroduction - 1);
  ignored = ::write(STDERR_FILENO, running_command.data(), std::strlen(running_command.data()));
  ignored = ::write(STDERR_FILENO, "\n", 1);
  signal(SIGABRT, SIG_DFL);
}

// Runs scenarios, and looks for smaller ones that fail, too.
class Runs {
 public:
  Runs(const SimulateOptions& options, const WorldDescription& world) : options_(options), runner_(world) {
    runner_.end_when(interrupted);
    if (options.shows_log) {
      runner_.log_to([](const std::string& line) { absl::PrintF("%s\n", line); });
    }
  }

  absl::StatusOr<std::string> hash_alone() {
    return runner_.checker().untouched_hash(options_.scenario.ticks);
  }

  // In a process of its own, unless nobody looks for smaller ones: then one that ends its process can be made
  // smaller, too.
  absl::StatusOr<ScenarioReport> run(const Scenario& scenario) {
    const std::string command = command_of(scenario);
    std::strncpy(running_command.data(), command.c_str(), running_command.size() - 1);
    if (!options_.shrinks) return runner_.run(scenario);
    return run_apart([this, &scenario] { return runner_.run(scenario); });
  }

  std::string command_of(const Scenario& scenario) const {
    return absl::StrCat(tessera::command_of(scenario, options_.world.string()),
                        options_of(options_.overrides));
  }

  // Errors other than ABORTED end everything.
  absl::Status run_all() {
    Scenario scenario = options_.scenario;
    const absl::Time start = absl::Now();
    for (std::uint64_t n = 0; n < options_.seeds; ++n, ++scenario.seed) {
      const absl::StatusOr<ScenarioReport> report = run(scenario);
      if (!report.ok() && !absl::IsAborted(report.status())) return report.status();
      rows_.push_back(row_of(scenario, report));
      if (report.ok()) {
        coverage_.add(report->coverage);
        absl::PrintF("seed %-10d %s  the same bits\n", scenario.seed, report->hash);
        continue;
      }
      ++wrong_;
      tell_failure(scenario, report.status());
    }
    const double seconds = absl::ToDoubleSeconds(absl::Now() - start);
    absl::PrintF("\n%d seeds, %d of them wrong, %.1f a second\n%s", options_.seeds, wrong_,
                 static_cast<double>(options_.seeds) / seconds, coverage_.text());
    return absl::OkStatus();
  }

  std::uint64_t wrong() const { return wrong_; }
  const nlohmann::json& rows() const { return rows_; }

 private:
  void tell_failure(const Scenario& scenario, const absl::Status& failure) {
    absl::PrintF("seed %-10d WRONG: %s\n  to repeat it: %s\n", scenario.seed, failure.message(),
                 command_of(scenario));
    std::fflush(stdout);
    if (!options_.shrinks) return;
    runner_.log_to({});
    const Shrunk smaller = shrink(
        scenario, failure, [this](const Scenario& fewer) { return run(fewer).status(); }, kShrinkTriesMax);
    absl::PrintF("  the smallest found (%d tries): %s\n  %s\n", smaller.tries, smaller.failure.message(),
                 command_of(smaller.scenario));
    std::fflush(stdout);
  }

  static nlohmann::json row_of(const Scenario& scenario, const absl::StatusOr<ScenarioReport>& report) {
    nlohmann::json row = {
        {"seed", scenario.seed},   {"servers", scenario.servers},   {"links", scenario.links},
        {"ticks", scenario.ticks}, {"commands", scenario.commands}, {"world_hash", nlohmann::json()},
        {"same", report.ok()}};
    for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
      row["faults"][kFaultNames[kind].option] = scenario.faults[kind];
    }
    if (!report.ok()) {
      row["error"] = std::string(report.status().message());
    } else {
      row["world_hash"] = report->hash;
      row["recoveries"] = report->coverage.recoveries;
    }
    return row;
  }

  const SimulateOptions& options_;
  ScenarioRunner runner_;
  Coverage coverage_;
  std::uint64_t wrong_ = 0;
  nlohmann::json rows_ = nlohmann::json::array();
};

absl::Status simulate(SimulateOptions& options) {
  catch_interrupts();
  const absl::StatusOr<WorldDescription> world = world_of(options);
  if (!world.ok()) return world.status();
  if (!options.only_faults.empty()) {
    absl::StatusOr<std::vector<std::uint32_t>> places = places_from("--only-faults", options.only_faults);
    if (!places.ok()) return places.status();
    options.scenario.only_faults = *std::move(places);
  }
  if (!options.only_commands.empty()) {
    absl::StatusOr<std::vector<std::uint32_t>> places = places_from("--only-commands", options.only_commands);
    if (!places.ok()) return places.status();
    options.scenario.only_commands = *std::move(places);
  }
  signal(SIGABRT, tell_running_command);
  Runs runs(options, *world);
  const absl::StatusOr<std::string> alone = runs.hash_alone();
  if (!alone.ok()) return alone.status();
  if (options.scenario.commands == 0) absl::PrintF("in one process  %s\n", *alone);
  std::fflush(stdout);
  absl::Status outcome = runs.run_all();
  if (!outcome.ok()) return outcome;
  if (runs.wrong() > 0) {
    outcome = absl::InternalError(absl::StrCat(runs.wrong(), " of ", options.seeds, " seeds went wrong"));
  }
  if (!options.json.empty()) {
    outcome.Update(write_json(options.json, {{"world_hash", *alone}, {"rows", runs.rows()}}));
  }
  return outcome;
}

void add_scenario_options(CLI::App& command, SimulateOptions& options) {
  Scenario& scenario = options.scenario;
  command
      .add_option("--seed", scenario.seed, "decides when each message arrives, and all that is random below")
      ->capture_default_str();
  command.add_option("--seeds", options.seeds, "how many seeds, from that one on")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command.add_option("--servers", scenario.servers, "simulated sector servers")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command.add_flag("--links", scenario.links,
                   "servers talk to those around them alone, however few they are");
  command.add_option("--ticks", scenario.ticks, "how long")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  command.add_option("--commands", scenario.commands, "random commands of clients on the way, and snapshots")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command.add_flag("--extremes", scenario.extremes,
                   "these are commands and queries of every kind, with fields at their bounds and beyond;\n"
                   "some clients do not wait for answers; worlds are loaded anew, unloaded and restored");
  command
      .add_option("--tick-work-max", scenario.tick_work_ms_max,
                  "ms of processor time that a tick may take in one process, or of one server; 0: any.\n"
                  "It is measured, so it differs from run to run")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  for (std::size_t kind = 0; kind < kFaultKinds; ++kind) {
    command
        .add_option(absl::StrCat("--", kFaultNames[kind].option), scenario.faults[kind],
                    kFaultNames[kind].help)
        ->check(CLI::Range(0, 10'000))
        ->capture_default_str();
  }
  command.add_option(
      "--only-faults", options.only_faults,
      "of these faults, in the order in which they begin, only those with these numbers, from 0\n"
      "(\"0,3-5\"; \"none\")");
  command.add_option("--only-commands", options.only_commands, "likewise, of the commands");
}

}  // namespace

void add_simulate_command(CLI::App& app, Action& action) {
  CLI::App& command = add_command(
      app, "simulate",
      "Test a whole cluster in one thread, with faults of network, clocks and disk drawn from a seed, and\n"
      "compare every tick with one process. A seed that fails prints the command that repeats it, and a "
      "smaller\n"
      "case that fails, too.",
      "tessera simulate worlds/busy.sdf --seed 42 --seeds 10 --servers 4 --commands 20 --cuts 2 --crashes 1");
  const auto options = std::make_shared<SimulateOptions>();
  command.add_option("world", options->world,
                     absl::StrCat(kWorldFile, "; without one, a small pile at a sector corner"));
  add_scenario_options(command, *options);
  command.add_flag("!--no-shrink", options->shrinks, "do not look for smaller scenarios that go wrong");
  command.add_flag("--log", options->shows_log, "show what the simulated processes log");
  add_override_options(command, options->overrides);
  add_parsed(command, "--json", options->json, parse_output_file, "write the hashes to this file, too");
  command.callback([options, &action] { action = [options] { return simulate(*options); }; });
}

}  // namespace tessera::cli
