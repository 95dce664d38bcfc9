// Surfaces of their own: belts and tracks, friction that differs by direction, and what resists spinning and
// rolling, against closed forms.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr double kG = 9.8;         // m/s^2
constexpr double kTickRate = 60;   // 1/s
constexpr double kFriction = 0.5;  // of all bodies, unless stated otherwise

WorldSettings level_world(double sector_size = 128) {
  WorldSettings settings = sectors_of(sector_size);
  settings.gravity = UniformGravity{{0, 0, -kG}};
  return settings;
}

BodyState state_of_body(const PartitionCluster& cluster, std::uint64_t id) {
  return cluster.body(BodyId{id})->state;
}

Eigen::Vector3d speed_of(const PartitionCluster& cluster, std::uint64_t id) {
  return Eigen::Vector3d(state_of_body(cluster, id).linear_velocity.data());
}

Eigen::Vector3d spin_of(const PartitionCluster& cluster, std::uint64_t id) {
  return Eigen::Vector3d(state_of_body(cluster, id).angular_velocity.data());
}

// m, from the centre of sector (0, 0, 0).
double way_along_x(const PartitionCluster& cluster, std::uint64_t id, double sector_size) {
  const BodyRecord body = *cluster.body(BodyId{id});
  return body.state.position[0] + static_cast<double>(body.home.i) * sector_size;
}

void run_for(PartitionCluster& cluster, double seconds) {
  const int ticks = static_cast<int>(std::lround(seconds * kTickRate));
  for (int tick = 0; tick < ticks; ++tick) cluster.step();
}

// Body 1 is a belt along x, whose top is at z = 0; body 2 is a crate on it.
WorldDescription belt_world(double sector_size, double belt_speed) {
  WorldBuilder builder(level_world(sector_size));
  builder.add("belt", builder.shape(Box{{200, 4, 2}}), 1, {0, 0, -1}, Motion::kStatic);
  builder.world().bodies[0].properties.surface = Surface{.velocity = {belt_speed, 0, 0}};
  builder.add("crate", builder.shape(Box{{0.6, 0.6, 0.2}}), 5, {0, 0, 0.1});
  return builder.world();
}

TEST(Belt, ACrateReachesItsSpeedAsCoulombSays) {
  constexpr double kSpeed = 1;
  const auto cluster = cluster_of(belt_world(128, kSpeed), 1);
  run_for(*cluster, 0.1);
  // Contacts bear from the second small step on.
  EXPECT_NEAR(speed_of(*cluster, 2).x(), kFriction * kG * 0.1, kFriction * kG / kTickRate / 4);
  run_for(*cluster, 0.2);  // it takes 0.204 s
  EXPECT_NEAR(speed_of(*cluster, 2).x(), kSpeed, 0.01 * kSpeed);
  run_for(*cluster, 2);
  EXPECT_NEAR(speed_of(*cluster, 2).x(), kSpeed, 0.001 * kSpeed);
  EXPECT_LT(spin_of(*cluster, 2).norm(), 0.01);
}

TEST(Belt, ItCarriesOverSeamsWithTheSameBits) {
  constexpr double kSector = 2;
  const WorldDescription world = belt_world(kSector, 1);
  EXPECT_EQ(first_difference(run(world, 1, 1, 600), run(world, 3, 2, 600)), 600u);
  const auto cluster = cluster_of(world, 2);
  run_for(*cluster, 10);
  // All but what it lost until it had the speed, v^2 / (2 mu g).
  EXPECT_NEAR(way_along_x(*cluster, 2, kSector), 10 - 1 / (2 * kFriction * kG), 0.02);
}

TEST(Belt, NothingSleepsOnOneHoweverSlowItIs) {
  constexpr double kSpeed = 0.002;  // m/s, far below the speed of sleep
  const auto cluster = cluster_of(belt_world(128, kSpeed), 1);
  run_for(*cluster, 10);
  EXPECT_NE(state_of_body(*cluster, 2).activity, Activity::kAsleep);
  EXPECT_NEAR(way_along_x(*cluster, 2, 128), 10 * kSpeed, 0.05 * 10 * kSpeed);
}

TEST(Belt, StartingWakesWhatSleepsOnItAndStoppingLetsItSleep) {
  std::vector<std::vector<WorldHash>> runs;
  for (const std::uint32_t partitions : {1u, 3u}) {
    auto cluster = cluster_of(belt_world(2, 0), partitions);
    std::vector<WorldHash> hashes;
    const auto go = [&](int ticks, std::vector<Command> commands) {
      for (int tick = 0; tick < ticks; ++tick) {
        cluster->step(commands);
        commands.clear();
        hashes.push_back(cluster->hash());
      }
    };
    go(180, {});
    EXPECT_EQ(state_of_body(*cluster, 2).activity, Activity::kAsleep);
    go(180, {SetSurfaceMotion{BodyId{1}, {0.5, 0, 0}}});
    EXPECT_NEAR(speed_of(*cluster, 2).x(), 0.5, 0.005);
    go(180, {SetSurfaceMotion{BodyId{1}}});
    EXPECT_EQ(state_of_body(*cluster, 2).activity, Activity::kAsleep);
    runs.push_back(std::move(hashes));
  }
  EXPECT_EQ(first_difference(runs[0], runs[1]), runs[0].size());
}

TEST(Belt, OneThatIsTurnedCarriesAlongItsOwnAxes) {
  WorldDescription world = belt_world(2, 1);
  world.bodies[0].pose.orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()));
  const auto cluster = cluster_of(world, 1);
  run_for(*cluster, 1);
  EXPECT_NEAR(speed_of(*cluster, 2).y(), 1, 0.01);
  EXPECT_NEAR(speed_of(*cluster, 2).x(), 0, 0.01);
}

// The crate is in another sector than the belt, which is known there as a replica.
TEST(Belt, OneOfAKinematicBodyIsToldToOtherServers) {
  WorldBuilder builder(level_world(8));
  builder.add_floor(20, -0.5);
  builder.add("belt", builder.shape(Box{{6, 1, 0.4}}), 1, {3.5, 0, -0.3}, Motion::kKinematic);
  builder.add("crate", builder.shape(Box{{0.4, 0.4, 0.2}}), 2, {5.5, 0, 0});
  std::vector<std::vector<WorldHash>> runs;
  for (const std::uint32_t partitions : {1u, 3u}) {
    const auto cluster = cluster_of(builder.world(), partitions);
    std::vector<WorldHash> hashes;
    for (int tick = 0; tick < 300; ++tick) {
      std::vector<Command> commands;
      if (tick == 120) commands.push_back(SetSurfaceMotion{BodyId{2}, {-0.5, 0, 0}});
      cluster->step(commands);
      hashes.push_back(cluster->hash());
    }
    EXPECT_NEAR(speed_of(*cluster, 3).x(), -0.5, 0.005) << partitions;
    runs.push_back(std::move(hashes));
  }
  EXPECT_EQ(first_difference(runs[0], runs[1]), runs[0].size());
}

TEST(Track, ItDrivesItsBodyForwards) {
  constexpr double kSpeed = 0.8;
  for (const double sector_size : {128.0, 1.5}) {
    WorldBuilder builder(level_world(sector_size));
    builder.add_floor(30, 0);
    BodyDescription& track = builder.add("track", builder.shape(Box{{1, 0.3, 0.2}}), 20, {0, 0, 0.1});
    track.properties.surface = Surface{.running = {0, kSpeed, 0}};
    const auto running = cluster_of(builder.world(), 2);
    run_for(*running, 2);
    EXPECT_NEAR(speed_of(*running, 2).x(), kSpeed, 0.01 * kSpeed) << sector_size;
    running->step(std::vector<Command>{SetSurfaceMotion{BodyId{2}, {}, {0, -kSpeed, 0}}});
    run_for(*running, 2);
    EXPECT_NEAR(speed_of(*running, 2).x(), -kSpeed, 0.01 * kSpeed) << sector_size;
  }
}

// A flat crate on the floor, whose friction is `along` in its x and `across` in its y.
WorldDescription sledge_world(double along, double across, const Eigen::Vector3d& velocity, double turn) {
  WorldBuilder builder(level_world());
  builder.add_floor(50, 0);
  builder.world().bodies[0].properties.friction = 2;
  BodyDescription& sledge = builder.add("sledge", builder.shape(Box{{1, 1, 0.1}}), 5, {0, 0, 0.05});
  sledge.properties.friction = along;
  sledge.properties.surface = Surface{.direction = {3, 0, 0}, .second_friction = across};
  sledge.pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
  sledge.linear_velocity = velocity;
  return builder.world();
}

TEST(Friction, ItDiffersByDirection) {
  constexpr double kAlong = 0.4;
  constexpr double kAcross = 0.1;
  constexpr double kStart = 3;  // m/s
  constexpr double kTime = 0.5;
  for (const double turn : {0.0, std::numbers::pi / 2}) {
    const bool is_turned = turn > 0;
    const auto along_x = cluster_of(sledge_world(kAlong, kAcross, {kStart, 0, 0}, turn), 1);
    run_for(*along_x, kTime);
    const double slowed = (is_turned ? kAcross : kAlong) * kG * kTime;
    EXPECT_NEAR(speed_of(*along_x, 2).x(), kStart - slowed, 0.02 * slowed);
    const auto along_y = cluster_of(sledge_world(kAlong, kAcross, {0, kStart, 0}, turn), 1);
    run_for(*along_y, kTime);
    const double slowed_in_y = (is_turned ? kAlong : kAcross) * kG * kTime;
    EXPECT_NEAR(speed_of(*along_y, 2).y(), kStart - slowed_in_y, 0.02 * slowed_in_y);
  }
}

TEST(Friction, AcrossItsDirectionThereMayBeNone) {
  const auto cluster = cluster_of(sledge_world(0.5, 0, {2, 1, 0}, 0), 1);
  run_for(*cluster, 0.2);
  EXPECT_NEAR(speed_of(*cluster, 2).x(), 2 - 0.5 * kG * 0.2, 0.02 * 0.5 * kG * 0.2);
  run_for(*cluster, 1);
  EXPECT_NEAR(speed_of(*cluster, 2).x(), 0, 1e-3);
  EXPECT_NEAR(speed_of(*cluster, 2).y(), 1, 1e-3);
}

// Friction of an ellipse is that of largest dissipation: along (along^2 vx, across^2 vy) for a velocity v.
TEST(Friction, AtAnAngleItIsWithinTheEllipse) {
  constexpr double kAlong = 0.4;
  constexpr double kAcross = 0.2;
  const Eigen::Vector2d v(20, 20);  // m/s: its direction hardly changes
  const auto cluster = cluster_of(sledge_world(kAlong, kAcross, {v.x(), v.y(), 0}, 0), 1);
  run_for(*cluster, 0.5);
  const Eigen::Vector2d squares(kAlong * kAlong, kAcross * kAcross);
  const double length = std::hypot(kAlong * v.x(), kAcross * v.y());
  const Eigen::Vector2d slowed = squares.cwiseProduct(v) / length * kG * 0.5;
  EXPECT_NEAR(v.x() - speed_of(*cluster, 2).x(), slowed.x(), 0.05 * slowed.x());
  EXPECT_NEAR(v.y() - speed_of(*cluster, 2).y(), slowed.y(), 0.05 * slowed.y());
}

TEST(Friction, RollingSlowsABallAsItsArmSays) {
  constexpr double kRadius = 0.2;
  constexpr double kArm = 0.01;
  constexpr double kSpeed = 2;
  WorldBuilder builder(level_world(3));
  builder.add_floor(30, 0);
  BodyDescription& ball = builder.add("ball", builder.shape(Sphere{kRadius}), 3, {0, 0, kRadius});
  ball.properties.surface = Surface{.rolling_friction = kArm};
  ball.linear_velocity = {kSpeed, 0, 0};
  ball.angular_velocity = {0, kSpeed / kRadius, 0};
  EXPECT_EQ(first_difference(run(builder.world(), 1, 1, 240), run(builder.world(), 3, 1, 240)), 240u);
  const auto cluster = cluster_of(builder.world(), 1);
  run_for(*cluster, 3);
  const double slowed = 5.0 / 7 * kG * kArm / kRadius * 3;
  EXPECT_NEAR(speed_of(*cluster, 2).x(), kSpeed - slowed, 0.02 * slowed);
  run_for(*cluster, 6);
  EXPECT_EQ(state_of_body(*cluster, 2).activity, Activity::kAsleep);
}

// On a slope of less than arm / radius it stays.
TEST(Friction, RollingHoldsABallOnASlope) {
  constexpr double kRadius = 0.2;
  constexpr double kArm = 0.02;
  for (const double slope : {0.09, 0.11}) {
    WorldSettings settings = level_world();
    settings.gravity = UniformGravity{{kG * slope, 0, -kG}};
    WorldBuilder builder(settings);
    builder.add_floor(30, 0);
    builder.add("ball", builder.shape(Sphere{kRadius}), 3, {0, 0, kRadius}).properties.surface =
        Surface{.rolling_friction = kArm};
    const auto cluster = cluster_of(builder.world(), 1);
    run_for(*cluster, 4);
    const double rolls = 5.0 / 7 * kG * (slope - kArm / kRadius) * 4 * 4 / 2;
    EXPECT_NEAR(way_along_x(*cluster, 2, 128), std::max(rolls, 0.0), 0.03);
  }
}

TEST(Friction, APatchStopsASpinningBall) {
  constexpr double kRadius = 0.2;
  constexpr double kPatch = 0.02;
  constexpr double kSpin = 14;  // rad/s
  WorldBuilder builder(level_world());
  builder.add_floor(30, 0);
  BodyDescription& ball = builder.add("ball", builder.shape(Sphere{kRadius}), 3, {0, 0, kRadius});
  ball.properties.surface = Surface{.torsional_friction = 0.8, .patch_radius = kPatch};
  ball.angular_velocity = {0, 0, kSpin};
  const auto cluster = cluster_of(builder.world(), 1);
  run_for(*cluster, 1);
  const double slowed = 3 * std::numbers::pi / 16 * 0.8 * kPatch * kG / (0.4 * kRadius * kRadius);
  EXPECT_NEAR(spin_of(*cluster, 2).z(), kSpin - slowed, 0.02 * slowed);
  run_for(*cluster, kSpin / slowed);
  EXPECT_NEAR(spin_of(*cluster, 2).z(), 0, 0.01);
}

}  // namespace
}  // namespace tessera
