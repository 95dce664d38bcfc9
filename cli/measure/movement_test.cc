#include "cli/measure/movement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

// A floor and three boxes.
WorldDescription three_boxes() {
  WorldBuilder builder{WorldSettings()};
  const ShapeId crate = builder.shape(Box{});
  builder.add_floor(10, 0);
  for (int n = 0; n < 3; ++n) builder.add("crate_" + std::to_string(n), crate, 6, {2.0 * n, 0, 0.5});
  return builder.world();
}

TEST(MovementTest, CountsBodiesThatMovedAlsoToOtherSectors) {
  const WorldDescription world = three_boxes();
  const std::vector<BodyRecord> records = records_of(world).value();
  Movement movement(records, world.settings.sector_size, Precision::kFloat32);
  std::vector<BodyRecord> ends = records;
  ends[1].home.j += 1;
  ends[2].state.position[2] += 0.05;
  for (const BodyRecord& record : ends) movement.set_end(record);
  const MovementReport report = movement.report();
  EXPECT_EQ(report.bodies, 3u);
  EXPECT_EQ(report.moved, 1u);
  EXPECT_EQ(report.coordinate_max, 4);
  EXPECT_EQ(report.coordinate_step, std::ldexp(1, -21));
}

TEST(MovementTest, WhatIsNoNumberHasMoved) {
  const WorldDescription world = three_boxes();
  std::vector<BodyRecord> records = records_of(world).value();
  Movement movement(records, world.settings.sector_size, Precision::kFloat64);
  records[1].state.position[0] = std::nan("");
  for (const BodyRecord& record : records) movement.set_end(record);
  EXPECT_EQ(movement.report().moved, 1u);
  EXPECT_EQ(movement.report().coordinate_step, std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace tessera
