#include "experiments/plain_world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "experiments/towers.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

// A tower of five crates on a plane, `metres` along x from the anchor.
WorldDescription tower_at(double metres) {
  WorldDescription world;
  world.shapes = {Shape{{ShapePart{Plane{}, Pose{}}}}, Shape{{ShapePart{Box{}, Pose{}}}}};
  world.bodies.emplace_back();
  world.bodies.back().name = "ground::link";
  world.bodies.back().properties.motion = Motion::kStatic;
  for (int level = 0; level < 5; ++level) {
    world.bodies.emplace_back();
    BodyDescription& crate = world.bodies.back();
    crate.name = "town::tower_1::crate_" + std::to_string(level);
    crate.properties.shape = 1;
    crate.properties.mass = 6;
    crate.pose.position = canonical({}, {metres, 0, 0.5 + level}, world.settings.sector_size).value();
  }
  return world;
}

TowerReport run_plain(const WorldDescription& world, int ticks) {
  const std::unique_ptr<PlainWorld> plain = PlainWorld::create(world, Precision::kFloat32).value();
  for (int tick = 0; tick < ticks; ++tick) plain->step();
  Towers towers(world, records_of(world).value());
  plain->for_each_body([&](const BodyRecord& record) { towers.set_end(record); });
  return towers.report();
}

TEST(PlainWorldTest, TowerStandsNearTheOriginAndNotFarAway) {
  const TowerReport near = run_plain(tower_at(0), 120);
  EXPECT_EQ(near.towers, 1u);
  EXPECT_EQ(near.standing, 1u);
  EXPECT_LT(near.displacement_max, 0.05);
  const TowerReport far = run_plain(tower_at(6.4e6 + 0.3), 120);
  EXPECT_GT(far.displacement_max, near.displacement_max);
}

TEST(PlainWorldTest, BodiesFallAsleepTogether) {
  const std::unique_ptr<PlainWorld> plain = PlainWorld::create(tower_at(0), Precision::kFloat32).value();
  for (int tick = 0; tick < 600; ++tick) plain->step();
  plain->for_each_body([](const BodyRecord& record) { EXPECT_EQ(record.state.activity, Activity::kAsleep); });
}

TEST(TowersTest, NumbersThatAreNoneCountAsFallen) {
  const WorldDescription world = tower_at(0);
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
  const WorldDescription world = tower_at(0);
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

}  // namespace
}  // namespace tessera
