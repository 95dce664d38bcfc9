// Requests of every kind, with fields at their bounds and beyond, on clusters of one and two servers: no
// process ends, and the bits are those of one process. Each run draws the same seeds; with TESSERA_SEED=N,
// only seed N.
//
// For a long search, with new seeds and a bound on the work of a tick: CONTRIBUTING.md.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "lpss/engine/test_world.h"
#include "simulator/scenario.h"

namespace tessera {
namespace {

constexpr std::uint64_t kSeeds = 8;

WorldDescription world() {
  WorldDescription pile = corner_pile();
  pile.settings.precision = engine_tests::test_precision;
  return pile;
}

TEST(AnyRequests, EndNoProcessAndChangeNoBit) {
  const char* given = std::getenv("TESSERA_SEED");
  std::vector<std::uint64_t> seeds;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) seeds.push_back(seed);
  if (given != nullptr) seeds = {std::strtoull(given, nullptr, 10)};
  ScenarioRunner runner(world());
  Coverage coverage;
  for (const std::uint64_t seed : seeds) {
    const Scenario scenario{.seed = seed,
                            .servers = static_cast<std::uint32_t>(1 + seed % 2),
                            .ticks = 100,
                            .commands = 200,
                            .extremes = true};
    // A process that ends has said which one it was.
    std::printf("%s\n", command_of(scenario).c_str());
    std::fflush(stdout);
    const absl::StatusOr<ScenarioReport> report = runner.run(scenario);
    ASSERT_TRUE(report.ok()) << report.status() << "\nto repeat it: " << command_of(scenario)
                             << " --precision " << name_of(engine_tests::test_precision);
    coverage.add(report->coverage);
  }
  std::printf("%s", coverage.text().c_str());
}

}  // namespace
}  // namespace tessera
