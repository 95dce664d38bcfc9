// `tessera simulate`: a whole cluster on a simulated network, replayable from its seed.
#include <absl/strings/str_format.h>

#include <cstdio>
#include <memory>

#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/world_options.h"
#include "simulator/scenario.h"

namespace tessera::cli {
namespace {

struct SimulateOptions {
  std::filesystem::path world;  // empty: corner_pile()
  WorldOverrides overrides;
  Scenario scenario;  // the first of them
  std::uint64_t seeds = 1;
  std::filesystem::path json;
};

absl::StatusOr<WorldDescription> world_of(const SimulateOptions& options) {
  if (options.world.empty()) return corner_pile();
  absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  return std::move(loaded->world);
}

std::string told(const absl::StatusOr<ScenarioReport>& report) {
  if (!report.ok()) return absl::StrCat("WRONG: ", report.status().message());
  std::string text = absl::StrCat(report->hash, "  the same bits");
  if (report->recoveries > 0)
    absl::StrAppend(&text, ", went on from a checkpoint ", report->recoveries, " times");
  return text;
}

nlohmann::json row_of(const Scenario& scenario, const absl::StatusOr<ScenarioReport>& report) {
  nlohmann::json row = {{"seed", scenario.seed},
                        {"servers", scenario.servers},
                        {"ticks", scenario.ticks},
                        {"commands", scenario.commands},
                        {"cuts", scenario.cuts},
                        {"crashes", scenario.crashes},
                        {"coordinator_crashes", scenario.coordinator_crashes},
                        {"world_hash", nlohmann::json()},
                        {"same", report.ok()}};
  if (!report.ok()) {
    row["error"] = std::string(report.status().message());
  } else {
    row["world_hash"] = report->hash;
    row["recoveries"] = report->recoveries;
  }
  return row;
}

absl::Status simulate(const SimulateOptions& options) {
  catch_interrupts();
  const absl::StatusOr<WorldDescription> world = world_of(options);
  if (!world.ok()) return world.status();
  ScenarioRunner runner(*world);
  runner.end_when(interrupted);
  const absl::StatusOr<std::string> alone = runner.checker().untouched_hash(options.scenario.ticks);
  if (!alone.ok()) return alone.status();
  if (options.scenario.commands == 0) absl::PrintF("in one process  %s\n", *alone);
  std::fflush(stdout);

  nlohmann::json rows = nlohmann::json::array();
  std::uint64_t wrong = 0;
  Scenario scenario = options.scenario;
  for (std::uint64_t n = 0; n < options.seeds; ++n, ++scenario.seed) {
    const absl::StatusOr<ScenarioReport> report = runner.run(scenario);
    if (!report.ok() && !absl::IsAborted(report.status())) return report.status();
    wrong += report.ok() ? 0 : 1;
    absl::PrintF("seed %-10d %s\n", scenario.seed, told(report));
    rows.push_back(row_of(scenario, report));
  }
  absl::Status outcome;
  if (wrong > 0) {
    outcome = absl::InternalError(absl::StrCat(wrong, " of ", options.seeds, " seeds went wrong"));
  }
  if (!options.json.empty())
    outcome.Update(write_json(options.json, {{"world_hash", *alone}, {"rows", rows}}));
  return outcome;
}

}  // namespace

void add_simulate_command(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "simulate",
                  "Run a coordinator and servers in one thread, on a network that delays and reorders by a "
                  "seed, and compare\n"
                  "every seed with one process.",
                  "tessera simulate worlds/busy.sdf --seed 42 --seeds 10 --servers 4 --commands 20 --cuts 2");
  const auto options = std::make_shared<SimulateOptions>();
  Scenario& scenario = options->scenario;
  command.add_option("world", options->world,
                     absl::StrCat(kWorldFile, "; without one, a small pile at a sector corner"));
  command
      .add_option("--seed", scenario.seed, "decides when each message arrives, and all that is random below")
      ->capture_default_str();
  command.add_option("--seeds", options->seeds, "how many seeds, from that one on")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command.add_option("--servers", scenario.servers, "simulated sector servers")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command.add_option("--ticks", scenario.ticks, "how long")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  command.add_option("--commands", scenario.commands, "random commands of clients on the way")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command
      .add_option("--cuts", scenario.cuts,
                  "links between two processes that are cut for a while, and heal; one in four outlasts the\n"
                  "time-outs, so that the coordinator gives the server up, and the world goes on elsewhere")
      ->check(CLI::Range(0, 10'000))
      ->capture_default_str();
  command
      .add_option("--crashes", scenario.crashes,
                  "servers that end without a word; each time, another one joins some seconds later")
      ->check(CLI::Range(0, 64))
      ->capture_default_str();
  command
      .add_option(
          "--coordinator-crashes", scenario.coordinator_crashes,
          "how often the coordinator ends without a word; another one takes its place some seconds later")
      ->check(CLI::Range(0, 10'000))
      ->capture_default_str();
  add_override_options(command, options->overrides);
  add_parsed(command, "--json", options->json, parse_output_file, "write the hashes to this file, too");
  command.callback([options, &action] { action = [options] { return simulate(*options); }; });
}

}  // namespace tessera::cli
