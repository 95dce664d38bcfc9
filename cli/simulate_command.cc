// `tessera simulate`: a whole cluster on a simulated network, replayable from its seed.
#include <absl/strings/str_format.h>

#include <cstdio>
#include <memory>

#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/world_options.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"
#include "simulator/simulated_cluster.h"

namespace tessera::cli {
namespace {

struct SimulateOptions {
  std::filesystem::path world;  // empty: a small pile around the corner of eight sectors
  WorldOverrides overrides;
  std::uint64_t seed = 1;
  std::uint64_t seeds = 1;
  std::uint32_t servers = 3;
  std::uint64_t ticks = 120;
  std::filesystem::path json;
};

absl::StatusOr<WorldDescription> world_of(const SimulateOptions& options) {
  if (options.world.empty()) {
    WorldSettings settings;
    settings.sector_size = 8;
    return pile_world(settings, 40);
  }
  absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  return std::move(loaded->world);
}

absl::StatusOr<std::string> hash_under(const WorldDescription& world, const SimulateOptions& options,
                                       std::uint64_t seed) {
  SimulatedCluster cluster(seed, options.servers, world.settings.precision);
  cluster.end_when(interrupted);
  if (absl::Status loaded = cluster.load(world); !loaded.ok()) return loaded;
  if (const auto stepped = cluster.step(options.ticks); !stepped.ok()) return stepped.status();
  const auto hash = cluster.hash();
  if (!hash.ok()) return hash.status();
  return hash->hash();
}

absl::Status simulate(const SimulateOptions& options) {
  catch_interrupts();
  const absl::StatusOr<WorldDescription> world = world_of(options);
  if (!world.ok()) return world.status();
  absl::StatusOr<std::unique_ptr<Simulation>> alone = Simulation::create(*world);
  if (!alone.ok()) return alone.status();
  for (std::uint64_t tick = 0; tick < options.ticks; ++tick) {
    if (interrupted()) return absl::CancelledError("interrupted");
    (*alone)->step();
  }
  const std::string expected = (*alone)->hash().to_string();
  absl::PrintF("in one process  %s\n", expected);
  std::fflush(stdout);

  nlohmann::json rows = nlohmann::json::array();
  std::uint64_t differing = 0;
  for (std::uint64_t seed = options.seed; seed < options.seed + options.seeds; ++seed) {
    const absl::StatusOr<std::string> hash = hash_under(*world, options, seed);
    if (!hash.ok()) return hash.status();
    const bool same = *hash == expected;
    differing += same ? 0 : 1;
    absl::PrintF("seed %-10d %s  %s\n", seed, *hash, same ? "the same bits" : "DIFFERENT");
    rows.push_back({{"seed", seed},
                    {"servers", options.servers},
                    {"ticks", options.ticks},
                    {"world_hash", *hash},
                    {"same", same}});
  }
  absl::Status outcome;
  if (differing > 0) {
    outcome =
        absl::InternalError(absl::StrCat(differing, " of ", options.seeds, " seeds ended in different bits"));
  }
  if (!options.json.empty())
    outcome.Update(write_json(options.json, {{"world_hash", expected}, {"rows", rows}}));
  return outcome;
}

}  // namespace

void add_simulate_command(CLI::App& app, Action& action) {
  CLI::App& command = add_command(
      app, "simulate",
      "Run a coordinator and servers in one thread, on a network that delays and reorders by a seed.",
      "tessera simulate worlds/busy.sdf --seed 42 --seeds 10 --servers 4");
  const auto options = std::make_shared<SimulateOptions>();
  command.add_option("world", options->world,
                     absl::StrCat(kWorldFile, "; without one, a small pile at a sector corner"));
  command.add_option("--seed", options->seed, "decides when each message arrives")->capture_default_str();
  command.add_option("--seeds", options->seeds, "how many seeds, from that one on")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command.add_option("--servers", options->servers, "simulated sector servers")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command.add_option("--ticks", options->ticks, "how long")
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  add_override_options(command, options->overrides);
  add_parsed(command, "--json", options->json, parse_output_file, "write the hashes to this file, too");
  command.callback([options, &action] { action = [options] { return simulate(*options); }; });
}

}  // namespace tessera::cli
