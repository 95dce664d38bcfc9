#include "experiments/seams/costs.h"

#include <absl/strings/str_cat.h>

#include <memory>
#include <utility>

#include "experiments/contestant.h"
#include "experiments/seams/piles.h"
#include "experiments/turns.h"
#include "lpss/simulation/example_worlds.h"
#include "worlds/loader/world_file.h"

namespace tessera::seams {
namespace {

absl::StatusOr<std::unique_ptr<LocalWorld>> under(SeamPolicy seams, WorldDescription world) {
  world.settings.seams = seams;
  return in_sectors(world);
}

// Over the corner of eight sectors. It never sleeps, so that every tick has work to do.
absl::StatusOr<WorldDescription> awake_pile(const CostOptions& options, double sector_size) {
  Scene scene = pile_scenes().front();
  scene.sector_size = sector_size;
  scene.build = [&](const WorldSettings& settings) { return bin_world(settings, options.pile); };
  absl::StatusOr<Stage> stage = seams::stage(scene, Placement::kCorner, Policy::kIsland, options.precision);
  if (!stage.ok()) return stage.status();
  stage->world.settings.sleep_after = 0;
  return std::move(stage->world);
}

class Measurement {
 public:
  Measurement(const CostOptions& options, const RunRemotely& run_remotely, const Progress& progress,
              Costs& costs)
      : options_(options), run_remotely_(run_remotely), progress_(progress, 0), costs_(costs) {}

  absl::Status measure() {
    const bool with_file = !options_.worlds.empty();
    progress_.expect(options_.ticks * (with_file ? 3 : 2) + 3);
    absl::Status status = race_pile(16);
    if (status.ok()) status = race_pile(8);
    if (status.ok() && with_file) status = race_file(absl::StrCat(options_.worlds, "/gazebo/3k_shapes.sdf"));
    if (status.ok()) status = measure_seams();
    return status;
  }

 private:
  absl::Status race_pile(double sector_size) {
    const absl::StatusOr<WorldDescription> world = awake_pile(options_, sector_size);
    if (!world.ok()) return world.status();
    return race(absl::StrCat("pile in sectors of ", sector_size, " m"), *world);
  }

  absl::Status race_file(const std::string& file) {
    const absl::StatusOr<LoadedWorld> loaded = load_world_file(file);
    if (!loaded.ok()) return loaded.status();
    WorldDescription world = loaded->world;
    world.settings.precision = options_.precision;
    return race("3k_shapes.sdf", world);
  }

  absl::Status race(const std::string& name, const WorldDescription& world) {
    std::vector<std::pair<std::string, Contestant>> contestants;
    const auto enter = [&](const std::string& policy, absl::StatusOr<std::unique_ptr<LocalWorld>> local) {
      if (!local.ok()) return local.status();
      contestants.emplace_back(policy, Contestant(*std::move(local), world));
      return absl::OkStatus();
    };
    absl::Status entered = enter("island", under(SeamPolicy::kIsland, world));
    if (entered.ok()) entered = enter("clone-1", under(SeamPolicy::kClone, world));
    if (entered.ok()) entered = enter("plain", in_one_world(world));
    if (!entered.ok()) return entered;
    absl::Status raced = in_turns(contestants, options_.ticks, /*in_turn=*/1, progress_,
                                  [](auto& entrant) { entrant.second.step(); });
    if (!raced.ok()) return raced;
    for (const auto& [policy, contestant] : contestants) {
      costs_.times.push_back(
          {name, policy, options_.ticks, median(contestant.ticks_us()) / 1000, contestant.hash()});
    }
    return absl::OkStatus();
  }

  absl::Status measure_seams() {
    WorldSettings settings;
    settings.precision = options_.precision;
    settings.sleep_after = 0;
    settings.sector_size = 4;
    absl::Status status = measure_seam("tower of 10", tower_world(settings, 10, {0, 0, -3}));
    settings.solver_iterations = 30;
    if (status.ok()) status = measure_seam("chain of 20", chain_world(settings, 20, {-5, 0.013, 4}));
    const absl::StatusOr<WorldDescription> pile = awake_pile(options_, 16);
    if (!pile.ok()) return pile.status();
    if (status.ok()) status = measure_seam("pile", *pile);
    return status;
  }

  absl::Status measure_seam(const std::string& name, const WorldDescription& world) {
    const Tick unmeasured = options_.ticks / 2;
    const absl::StatusOr<RemoteRun> run = run_remotely_(world, options_.ticks, unmeasured);
    if (!run.ok()) return run.status();
    SeamCost cost;
    cost.world = name;
    cost.ticks = options_.ticks - unmeasured;
    cost.tick_ms = run->tick_ms;
    cost.bytes_per_tick = static_cast<double>(run->exchange_bytes) / static_cast<double>(cost.ticks);
    cost.contacts = run->contacts;
    cost.bytes_per_tick_and_contact = run->contacts > 0 ? cost.bytes_per_tick / run->contacts : 0;
    cost.hash = run->world_hash;
    costs_.seams.push_back(std::move(cost));
    return progress_.advance();
  }

  const CostOptions& options_;
  const RunRemotely& run_remotely_;
  ProgressCount progress_;
  Costs& costs_;
};

}  // namespace

absl::Status measure_costs(const CostOptions& options, const RunRemotely& run_remotely,
                           const Progress& progress, Costs& costs) {
  return Measurement(options, run_remotely, progress, costs).measure();
}

}  // namespace tessera::seams
