// A tower does not lean, whatever its coordinates round to.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr int kTowersInRow = 12;
constexpr int kLevels = 10;
constexpr double kLeanMax = 1e-3;  // m

TEST(Towers, StandUprightWhereverTheyAre) {
  WorldSettings settings;
  settings.precision = engine_tests::test_precision;
  settings.sector_size = 512;
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  builder.add_floor(120, 0);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int n = 0; n < kTowersInRow; ++n) {
    for (int level = 0; level < kLevels; ++level) {
      builder.add(absl::StrCat("tower", n, "_", level), box, 1,
                  {3 * n - 43.5 + 0.02 * (level % 3), -43.5 + 0.013 * (level % 2), 0.5 + level});
    }
  }
  const absl::StatusOr<std::unique_ptr<Simulation>> simulation = Simulation::create(builder.world());
  ASSERT_TRUE(simulation.ok()) << simulation.status();
  std::map<BodyId, BodyState> start;
  (*simulation)->for_each_body([&](const BodyRecord& body) { start[body.id] = body.state; });
  for (int tick = 0; tick < 200; ++tick) (*simulation)->step();
  (*simulation)->for_each_body([&](const BodyRecord& body) {
    for (const int axis : {0, 1})
      EXPECT_NEAR(body.state.position[axis], start[body.id].position[axis], kLeanMax) << body.id.value;
  });
}

}  // namespace
}  // namespace tessera
