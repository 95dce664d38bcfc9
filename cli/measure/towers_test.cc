#include "cli/measure/towers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

WorldDescription tower() {
  WorldBuilder builder{WorldSettings()};
  const ShapeId crate = builder.shape(Box{});
  builder.add_floor(10, 0);
  for (int level = 0; level < 5; ++level)
    builder.add("town::tower_1::crate_" + std::to_string(level), crate, 6, {0, 0, 0.5 + level});
  return builder.world();
}

TEST(TowersTest, NumbersThatAreNoneCountAsFallen) {
  const WorldDescription world = tower();
  std::vector<BodyRecord> records = records_of(world).value();
  Towers towers(world, records);
  for (BodyRecord& record : records) {
    if (record.properties.motion == Motion::kDynamic) record.state.position[1] = std::nan("");
    towers.set_end(record);
  }
  EXPECT_EQ(towers.report().standing, 0u);
  EXPECT_EQ(towers.report().displacement_median, std::numeric_limits<double>::infinity());
}

TEST(TowersTest, TopDecidesAndMovesToOtherSectorsCount) {
  const WorldDescription world = tower();
  std::vector<BodyRecord> records = records_of(world).value();
  Towers towers(world, records);
  for (BodyRecord& record : records) towers.set_end(record);
  EXPECT_EQ(towers.report().standing, 1u);
  EXPECT_EQ(towers.report().displacement_max, 0);
  records.back().home.i += 1;
  towers.set_end(records.back());
  EXPECT_EQ(towers.report().standing, 0u);
  EXPECT_EQ(towers.report().displacement_max, world.settings.sector_size);
}

// Up is where nothing pulls to, as it is felt there: of a planet, which is far from the frame's sectors.
TEST(TowersTest, MayStandInAFrameThatMoves) {
  WorldDescription world = tower();
  CentralGravity planet;
  planet.centre.local = {0, 0, -planet.radius};
  world.settings.gravity = planet;
  world.settings.frames.emplace_back().name = "ship";
  for (BodyDescription& body : world.bodies) body.pose.position.sector.frame = 1;
  const std::vector<BodyRecord> start = records_of(world).value();
  Towers towers(world, start);
  for (const BodyRecord& record : start) towers.set_end(record);
  EXPECT_EQ(towers.report().standing, 1u);
}

}  // namespace
}  // namespace tessera
