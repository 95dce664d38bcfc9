// What programs do in a world: answers from mechanics, the same on any number of partitions and threads, and
// after a restore.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

TEST(Mover, GoesItsWayInTheTimeThatSpeedAndAccelerationTake) {
  WorldBuilder builder(settings_of());
  add_box(builder, "lift", {2, 2, 0.2}, {1, 0, 0}, Motion::kKinematic)
      .programs.push_back(example_program("mover", {{"z", 6}, {"speed", 2}, {"acceleration", 1}}));
  Watched world(builder);
  world.run(1);
  EXPECT_EQ(world.position("lift").z(), 0);
  world.tell("lift", "goal", 1);
  const double takes = 6.0 / 2 + 2.0 / 1;  // s
  int ticks = 1;
  while (value_of(world.body("lift"), "way") < 6 && ticks < 1000) {
    world.step();
    ++ticks;
    EXPECT_LE(world.velocity("lift").norm(), 2 + 1e-4);
  }
  EXPECT_NEAR(ticks * kDt, takes, 3 * kDt);
  world.run(0.1);
  EXPECT_NEAR(world.position("lift").z(), 6, 1e-6);
  // Half of the way back, and forth again.
  world.tell("lift", "goal", 0);
  world.run(2);
  world.tell("lift", "goal", 1);
  world.run(7);
  EXPECT_NEAR(world.position("lift").z(), 6, 1e-6);
}

TEST(Mover, SleepsAtTheEndOfItsWay) {
  WorldBuilder builder(settings_of());
  add_box(builder, "door", {2, 0.2, 2}, {1, 0, 0}, Motion::kKinematic)
      .programs.push_back(example_program("mover", {{"x", 1}, {"goal", 1}}));
  Watched world(builder);
  world.tell("door", "goal", 1);
  world.run(4);
  EXPECT_NEAR(world.position("door").x(), 2, 1e-6);
  EXPECT_TRUE(world.cluster().partition(0).at_rest);
  world.tell("door", "goal", 0);
  world.run(4);
  EXPECT_NEAR(world.position("door").x(), 1, 1e-6);
}

TEST(Character, WalksAtItsSpeedAndStands) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_character(builder, "walker", {0.1, 0.2, kExampleStanding});
  Watched world(builder);
  world.run(0.5);
  EXPECT_NEAR(world.position("walker").z(), kExampleStanding, 1e-3);
  world.tell("walker", "x", 1.5);
  world.run(1);
  EXPECT_NEAR(world.velocity("walker").x(), 1.5, 1e-4);
  const double before = world.position("walker").x();
  world.run(4);
  EXPECT_NEAR(world.position("walker").x() - before, 6, 1e-3);
  EXPECT_NEAR(world.position("walker").z(), kExampleStanding, 1e-3);
  world.tell("walker", "x", 0);
  world.run(4);
  const Eigen::Vector3d stands = world.position("walker");
  world.run(10);
  EXPECT_NEAR((world.position("walker") - stands).norm(), 0, 1e-5);
  EXPECT_TRUE(world.cluster().partition(0).at_rest) << "what stands on what does not move falls asleep";
  world.tell("walker", "y", 1);
  world.run(1);
  EXPECT_NEAR(world.velocity("walker").y(), 1, 1e-4);
}

TEST(Character, MissesNoTickAtBordersOfSectorsAndPartitions) {
  WorldBuilder builder(settings_of(4));
  builder.add_floor(50, 0);
  add_character(builder, "walker", {-9.7, 0.2, kExampleStanding}, {{"x", 1.5}});
  Watched world(builder, 3);
  world.run(1);
  for (int tick = 0; tick < 600; ++tick) {
    world.step();
    ASSERT_EQ(world.cluster().counts().programs, 1u) << tick;
    ASSERT_NEAR(world.velocity("walker").x(), 1.5, 1e-4) << tick;
    ASSERT_NEAR(world.position("walker").z(), kExampleStanding, 1e-3) << tick;
  }
}

TEST(Character, StandsOnSlopesThatItMayAndSlidesFromSteeperOnes) {
  for (const double degrees : {10.0, 30.0, 45.0}) {
    SCOPED_TRACE(degrees);
    WorldBuilder builder(settings_of(64));
    add_slope(builder, degrees * M_PI / 180);
    add_character(builder, "walker", {0.1, 0.2, kExampleStanding + 0.1 * std::tan(degrees * M_PI / 180)});
    Watched world(builder);
    world.run(2);
    const Eigen::Vector3d stands = world.position("walker");
    world.run(10);
    EXPECT_NEAR((world.position("walker") - stands).norm(), 0, 1e-4);
    EXPECT_NEAR(value_of(world.body("walker"), "slope"), degrees * M_PI / 180, 1e-3);
    // It walks with its speed seen from above.
    world.tell("walker", "x", 1);
    world.run(1);
    EXPECT_NEAR(world.velocity("walker").x(), 1, 1e-3);
    EXPECT_NEAR(world.velocity("walker").z(), std::tan(degrees * M_PI / 180), 2e-3);
  }
  WorldBuilder builder(settings_of(64));
  const double steep = 60 * M_PI / 180;
  add_slope(builder, steep);
  add_character(builder, "walker", {0.1, 0, 1.2 + 0.1 * std::tan(steep)});
  Watched world(builder);
  world.run(1);
  const Eigen::Vector3d before = world.velocity("walker");
  world.run(0.5);
  EXPECT_NEAR((world.velocity("walker") - before).norm() / 0.5, kG * std::sin(steep), 0.02 * kG);
}

TEST(Character, ClimbsStairsUpToItsStepAndNoHigher) {
  for (const double step : {0.15, 0.3, 0.7}) {
    SCOPED_TRACE(step);
    WorldBuilder builder(settings_of());
    builder.add_floor(50, 0);
    for (int n = 0; n < 8; ++n) {
      const double top = step * (n + 1);
      add_box(builder, "stair" + std::to_string(n), {0.5, 4, top}, {2.25 + 0.5 * n, 0, top / 2},
              Motion::kStatic);
    }
    add_character(builder, "walker", {0.1, 0.2, kExampleStanding}, {{"x", 1}});
    Watched world(builder);
    world.run(5);
    if (step < 0.4) {
      EXPECT_GT(world.position("walker").x(), 4.8);
      EXPECT_NEAR(world.position("walker").z(),
                  kExampleStanding + step * std::ceil((world.position("walker").x() - 2) / 0.5), 0.3);
    } else {
      EXPECT_LT(world.position("walker").x(), 2);
      EXPECT_NEAR(world.position("walker").z(), kExampleStanding, 1e-2);
    }
  }
}

TEST(Character, JumpsAsHighAsItIsAsked) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_character(builder, "walker", {0.1, 0.2, kExampleStanding}, {{"jump_height", 0.8}});
  Watched world(builder);
  world.run(0.5);
  world.tell("walker", "jump", 1);
  double highest = 0;
  for (int tick = 0; tick < 90; ++tick) {
    world.step();
    highest = std::max(highest, world.position("walker").z());
  }
  EXPECT_NEAR(highest, kExampleStanding + 0.8, 0.05);
  EXPECT_NEAR(world.position("walker").z(), kExampleStanding, 1e-3) << "once";
}

TEST(Character, RidesOnWhatMoves) {
  WorldBuilder builder(settings_of());
  add_box(builder, "lift", {3, 3, 0.2}, {1, 1, 0.1}, Motion::kKinematic)
      .programs.push_back(
          example_program("mover", {{"x", 20}, {"z", 10}, {"speed", 3}, {"acceleration", 2}}));
  add_character(builder, "rider", {1.3, 1.2, 0.2 + kExampleStanding});
  Watched world(builder);
  world.run(6);
  const Eigen::Vector3d before = world.position("rider") - world.position("lift");
  world.tell("lift", "goal", 1);
  world.run(12);
  EXPECT_NEAR(world.position("lift").x(), 21, 1e-5);
  const Eigen::Vector3d after = world.position("rider") - world.position("lift");
  EXPECT_NEAR((after - before).norm(), 0, 0.1);
  EXPECT_NEAR(after.z(), before.z(), 1e-3);
}

TEST(Character, PushesOffFromWhatItStandsOn) {
  WorldBuilder builder(settings_of());
  BodyDescription& raft = add_box(builder, "raft", {12, 4, 0.5}, {1, 0, -0.25}, Motion::kDynamic, 400);
  raft.properties.gravity = false;
  raft.properties.inertia = {1e9, 1e9, 1e9};
  add_character(builder, "walker", {0.1, 0, kExampleStanding}).properties.gravity = false;
  Watched world(builder);
  world.tell("walker", "x", 2);
  world.run(2);
  const double walker = 80 * world.velocity("walker").x();
  const double below = 400 * world.velocity("raft").x();
  EXPECT_GT(walker, 50);
  EXPECT_NEAR(walker + below, 0, 80 * 2 * 0.2) << "a tick behind at most";
  EXPECT_NEAR(world.velocity("walker").x() - world.velocity("raft").x(), 2, 1e-2);
}

TEST(Character, CrouchesUnderABeamAndStaysLowThere) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  // The shape ends at 1.6 m, and at 1.3 m when it crouches.
  add_box(builder, "beam", {2, 4, 0.2}, {4, 0, 1.55}, Motion::kStatic);
  add_character(builder, "walker", {0.1, 0.2, kExampleStanding}, {{"x", 1.5}});
  Watched world(builder);
  world.run(4);
  EXPECT_LT(world.position("walker").x(), 3) << "upright, it does not pass";
  world.tell("walker", "crouch", 1);
  world.run(0.9);
  EXPECT_NEAR(world.position("walker").z(), kExampleStanding - 0.3, 1e-2);
  EXPECT_GT(world.position("walker").x(), 3);
  world.step({told_all(world.world(), "walker", {{"crouch", 0}, {"x", 0}})});
  world.run(1);
  EXPECT_NEAR(world.position("walker").z(), 1.45 - 0.6, 0.02) << "under the beam";
  world.tell("walker", "x", 1.5);
  world.run(2);
  EXPECT_NEAR(world.position("walker").z(), kExampleStanding, 1e-3);
}

TEST(Vehicle, BrakesOnTheWayThatItsGripAllows) {
  for (const double grip : {0.5, 0.9}) {
    SCOPED_TRACE(grip);
    WorldBuilder builder(settings_of(64));
    builder.add_floor(400, 0);
    add_car(builder, "car", {0, 0, 0.6}, {{"grip", grip}, {"brake_force", 1e5}}).linear_velocity = {20, 0, 0};
    Watched world(builder);
    world.tell("car", "throttle", 0.02);  // as much as rolls on
    world.run(1);
    const double start = world.position("car").x();
    const double speed = world.velocity("car").x();
    EXPECT_NEAR(speed, 20, 1);
    world.step({told_all(world.world(), "car", {{"throttle", 0}, {"brake", 1}})});
    world.run(8);
    EXPECT_NEAR(world.velocity("car").norm(), 0, 1e-3);
    const double expected = speed * speed / (2 * grip * kG);
    EXPECT_NEAR(world.position("car").x() - start, expected, 0.04 * expected + speed * kDt);
  }
}

TEST(Vehicle, GoesInTheCircleOfItsSteering) {
  WorldBuilder builder(settings_of(64));
  builder.add_floor(400, 0);
  add_car(builder, "car", {0, 0, 0.6}, {{"throttle", 0.05}, {"speed", 3}, {"steer_angle", 0.4}});
  Watched world(builder);
  world.tell("car", "steer", 0.5);
  world.run(20);
  const Eigen::Vector3d velocity = world.velocity("car");
  const double turn = world.body("car").state.angular_velocity[2];
  const double rear = std::sqrt(std::pow(velocity.norm() / turn, 2) - std::pow(2.6 / 2, 2));
  EXPECT_NEAR(rear, 2.6 / std::tan(0.2), 0.15);
}

TEST(Vehicle, StandsOnASlopeAndClimbsIt) {
  WorldBuilder builder(settings_of(64));
  const double angle = 20 * M_PI / 180;
  add_slope(builder, angle);
  BodyDescription& car = add_car(builder, "car", {0, 0, 0}, {{"brake_force", 1e5}});
  car.pose.orientation = Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY());
  car.pose.position.local = car.pose.orientation * Eigen::Vector3d(-8, 1, 0.6);
  Watched world(builder);
  world.tell("car", "brake", 1);
  world.run(3);
  const Eigen::Vector3d stands = world.position("car");
  world.run(20);
  EXPECT_NEAR((world.position("car") - stands).norm(), 0, 1e-4);
  world.step({told_all(world.world(), "car", {{"throttle", 0.9}, {"brake", 0}})});
  const double speed = world.velocity("car").x();
  world.run(2);
  const double expected = 0.9 * 6000 / 1200 - kG * std::sin(angle);
  EXPECT_NEAR((world.velocity("car").norm() - speed) / 2, expected, 0.05 * kG);
}

TEST(Floater, FloatsAsDeepAsItsWeightAndSwingsAsItShould) {
  constexpr double kMass = 600;  // kg, of a cube of 1 m^3
  WorldBuilder builder(settings_of());
  add_box(builder, "buoy", {1, 1, 1}, {0.3, 0.2, 0}, Motion::kDynamic, kMass)
      .programs.push_back(example_program("floater", {{"level", 0.3}, {"damping", 0}, {"drag", 0}}));
  Watched world(builder);
  // It began 0.2 m too deep: about where it floats, it swings with T = 2 pi sqrt(m / (density g area)).
  const double rest = 0.3 - (kMass / 1000 - 0.5);
  const double period = 2 * M_PI * std::sqrt(kMass / (1000 * kG));
  std::vector<double> crossed;
  double before = world.position("buoy").z();
  for (int tick = 1; tick < 600; ++tick) {
    world.step();
    const double now = world.position("buoy").z();
    if (before < rest && now >= rest) crossed.push_back(tick * kDt);
    before = now;
  }
  ASSERT_GE(crossed.size(), 4u);
  EXPECT_NEAR((crossed.back() - crossed.front()) / static_cast<double>(crossed.size() - 1), period,
              0.02 * period);

  WorldBuilder calm(settings_of());
  add_box(calm, "buoy", {1, 1, 1}, {0.3, 0.2, 0}, Motion::kDynamic, kMass)
      .programs.push_back(example_program("floater", {{"level", 0.3}, {"damping", 2}}));
  Watched rests(calm);
  rests.run(20);
  EXPECT_NEAR(rests.position("buoy").z(), rest, 2e-3);
  EXPECT_NEAR(value_of(rests.body("buoy"), "displaced"), kMass / 1000, 2e-3);
}

TEST(Floater, RightsItself) {
  WorldBuilder builder(settings_of());
  BodyDescription& raft = add_box(builder, "raft", {4, 2, 0.5}, {0.3, 0.2, 0}, Motion::kDynamic, 1500);
  raft.pose.orientation = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX());
  raft.programs.push_back(
      example_program("floater", {{"length", 4}, {"width", 2}, {"height", 0.5}, {"damping", 2}}));
  Watched world(builder);
  world.run(20);
  const Eigen::Vector3d up = quaternion_of(world.body("raft").state) * Eigen::Vector3d::UnitZ();
  EXPECT_GT(std::abs(up.z()), 0.9999);
  EXPECT_NEAR(value_of(world.body("raft"), "displaced"), 1.5, 0.01);
}

TEST(Pad, OpensADoorWhileSomebodyIsOnIt) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_box(builder, "door", {1, 0.2, 2}, {3, 5, 1}, Motion::kKinematic)
      .programs.push_back(example_program("mover", {{"z", 2.5}, {"speed", 5}, {"acceleration", 20}}));
  const double door = static_cast<double>(builder.world().bodies.size());
  BodyDescription& pad = add_box(builder, "pad", {2, 2, 2}, {5, 0, 1}, Motion::kKinematic);
  pad.properties.trigger = true;
  pad.programs.push_back(example_program("pad", {{"body", door}}));
  add_character(builder, "walker", {0.1, 0.2, kExampleStanding}, {{"x", 1}});
  Watched world(builder, 3);
  world.run(2);
  EXPECT_NEAR(world.position("door").z(), 1, 1e-6);
  world.run(3);
  EXPECT_EQ(value_of(world.body("pad"), "count"), 1);
  EXPECT_NEAR(world.position("door").z(), 3.5, 1e-6);
  world.run(4);
  EXPECT_EQ(value_of(world.body("pad"), "count"), 0);
  EXPECT_NEAR(world.position("door").z(), 1, 1e-6);
}

TEST(Pad, TellsNothingThatIsOutOfBounds) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_character(builder, "told", {-5, 0, kExampleStanding});
  const double told = static_cast<double>(builder.world().bodies.size());
  BodyDescription& pad = add_box(builder, "pad", {2, 2, 2}, {5, 0, 1.05}, Motion::kKinematic);
  pad.properties.trigger = true;
  pad.programs.push_back(example_program("pad", {{"body", told}, {"inside", 1e6}}));
  add_character(builder, "walker", {5, 0.2, kExampleStanding});
  Watched world(builder);
  world.run(1);
  EXPECT_EQ(value_of(world.body("pad"), "count"), 1);
  EXPECT_EQ(world.body("told").programs[0].inputs[0], 0);
  EXPECT_TRUE(validate(world.cluster().snapshot()).ok());
}

TEST(Programs, AreStoppedWhereTheirBodyBecomesOneThatTheyCannotWorkOn) {
  WorldBuilder builder(settings_of());
  builder.add_floor(50, 0);
  add_character(builder, "walker", {0.1, 0, kExampleStanding}, {{"x", 1}});
  Watched world(builder);
  world.run(1);
  BodyProperties properties = world.body("walker").properties;
  properties.motion = Motion::kKinematic;
  world.step({SetProperties{world.body("walker").id, properties}});
  world.step();
  EXPECT_EQ(world.body("walker").programs.at(0).fault, "tick 61: its body must be dynamic, not kinematic");
  EXPECT_TRUE(validate(world.cluster().snapshot()).ok()) << validate(world.cluster().snapshot());
}

// Deep in a floor that all sectors around know a part of, a cast begins inside it.
TEST(Programs, InsideOfAFloorSenseTheSameOnAnyNumberOfPartitions) {
  WorldBuilder builder(settings_of(8));
  builder.add_floor(60, 0);
  for (int n = 0; n < 6; ++n) {
    add_character(builder, "walker" + std::to_string(n), {3.9 + 0.07 * n, 3.8 + 0.05 * n, -0.34 - 0.1 * n});
  }
  const WorldDescription world = builder.world();
  const auto run = [&](std::uint32_t partitions) {
    auto cluster = cluster_of(world, partitions);
    for (int tick = 0; tick < 30; ++tick) cluster->step();
    return std::pair(cluster->hash(), cluster->program_hash());
  };
  const auto alone = run(1);
  EXPECT_EQ(run(2), alone);
  EXPECT_EQ(run(4), alone);
}

TEST(Programs, AreTheSameOnAnyNumberOfPartitionsAndThreads) {
  const WorldDescription world = crowd_world(settings_of(8));
  constexpr int kTicks = 480;
  const auto alone = hashes_of(*cluster_of(world, 1), kTicks);
  EXPECT_NE(alone.front().second, alone.back().second);
  expect_the_same_on_any_partitions(world, alone);
}

TEST(Programs, GoOnFromASnapshot) {
  const WorldDescription world = crowd_world(settings_of(8));
  auto cluster = cluster_of(world, 3);
  hashes_of(*cluster, 200);
  const WorldSnapshot snapshot = cluster->snapshot();
  EXPECT_TRUE(validate(snapshot).ok()) << validate(snapshot);
  const auto expected = hashes_of(*cluster, 100);
  auto restored = PartitionCluster::restore(snapshot, 2);
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(hashes_of(**restored, 100), expected);
}

TEST(Programs, MoveWithTheirWorld) {
  WorldDescription world = crowd_world(settings_of(8));
  const WorldHash here = [&] {
    auto cluster = cluster_of(world, 2);
    return hashes_of(*cluster, 200).back().first;
  }();
  ASSERT_TRUE(move_by(world, {std::int64_t{1} << 40, -(std::int64_t{1} << 50), 12345}).ok());
  auto cluster = cluster_of(world, 2);
  EXPECT_EQ(hashes_of(*cluster, 200).back().first, here);
}

}  // namespace
}  // namespace tessera
