// Bodies that touch nothing: they are not solved, and around a planet they fly finer than the engine's
// numbers.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <cmath>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

// Tumbling bodies, a few a sector at most, that drift through sectors of 16 m and now and then meet.
WorldDescription sparse_world(const WorldSettings& settings, int count) {
  WorldBuilder builder(settings);
  const ShapeId ball = builder.shape(Sphere{0.5});
  const ShapeId brick = builder.shape(Box{{1, 1.4, 0.6}});
  const int side = static_cast<int>(std::cbrt(count)) + 1;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d place(13.7 * (i % side), 14.1 * (i / side % side), 15.3 * (i / side / side));
    BodyDescription& body = builder.add(absl::StrCat("body", i), i % 2 == 0 ? ball : brick, 1 + i % 5, place);
    body.linear_velocity = Eigen::Vector3d(i % 7 - 3, i % 5 - 2, i % 11 - 5) * 1.7;
    body.angular_velocity = Eigen::Vector3d(i % 3 - 1, i % 4 - 2, i % 5 - 2) * 1.1;
  }
  return builder.world();
}

void add_joined_pair(WorldDescription& world, const Eigen::Vector3d& place) {
  WorldBuilder builder(world.settings);
  builder.world() = world;
  const ShapeId ball = builder.shape(Sphere{0.3});
  builder.add("parent", ball, 1, place).linear_velocity = {3, 0, 0};
  builder.add("child", ball, 2, place + Eigen::Vector3d(1, 0, 0));
  builder.tie("hinge", JointType::kRevolute, "parent", "child", place);
  world = builder.world();
}

std::vector<WorldHash> run_solving_all(const WorldDescription& world, int ticks) {
  auto cluster = PartitionCluster::create(world, 1, 1, /*free_flight=*/false);
  EXPECT_TRUE(cluster.ok()) << cluster.status();
  std::vector<WorldHash> hashes;
  for (int t = 0; t < ticks; ++t) {
    (*cluster)->step();
    hashes.push_back((*cluster)->hash());
  }
  return hashes;
}

TEST(LoneBodies, SparseWorldsEndInTheSameBitsAsWithTheSolver) {
  for (const SeamPolicy policy : {SeamPolicy::kIsland, SeamPolicy::kClone}) {
    const WorldDescription world = sparse_world(sectors_of(16, policy), 300);
    EXPECT_EQ(first_difference(run_solving_all(world, 150), run(world, 1, 1, 150)), 150u);
  }
}

TEST(LoneBodies, MixedWorldsEndInTheSameBitsAsWithTheSolver) {
  WorldDescription pile = pile_world(sectors_of(16), 60);
  add_joined_pair(pile, {20, 3, 12});
  for (const WorldDescription& world :
       {pile, tower_world(sectors_of(4), 6, {0, 0, -1}), chain_world(sectors_of(8), 5, {0, 0, 8})}) {
    EXPECT_EQ(first_difference(run_solving_all(world, 150), run(world, 1, 1, 150)), 150u);
  }
}

TEST(LoneBodies, FallAsTheyShould) {
  const WorldSettings settings;
  WorldBuilder builder(settings);
  builder.add("ball", builder.shape(Sphere{0.5}), 1, {0, 0, 50}).linear_velocity = {2, 0, 3};
  auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 1; tick <= 120; ++tick) {
    cluster->step();
    const BodyState state = cluster->body(BodyId{1})->state;
    const double time = tick * settings.time_step;
    EXPECT_NEAR(state.position[0], 2 * time, 1e-4);
    EXPECT_NEAR(state.position[2], 50 + 3 * time - 9.81 / 2 * time * time, 3e-4) << tick;
    EXPECT_NEAR(state.linear_velocity[2], 3 - 9.81 * time, 1e-4);
  }
}

// A ball that passes over several sectors in a tick meets a cube that no sector but its own knows of,
// wherever they are hosted.
TEST(LoneBodies, AFastOneHitsWhatIsSeveralSectorsAway) {
  for (const double speed : {2e3, 1e4, 1e5}) {
    for (const int direction : {-1, 1}) {
      WorldSettings settings = sectors_of(64);
      settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
      WorldBuilder builder(settings);
      const double away = 5 + 2.37 * speed * settings.time_step;
      builder.add("ball", builder.shape(Sphere{0.5}), 1, {-direction * away, 0.013, 0.017})
          .linear_velocity.x() = direction * speed;
      builder.add("cube", builder.shape(Box{{1, 1, 1}}), 1, {0, 0, 0});
      const std::vector<WorldHash> one = run(builder.world(), 1, 1, 20);
      EXPECT_EQ(first_difference(one, run(builder.world(), 3, 1, 20)), 20u);
      auto cluster = cluster_of(builder.world(), 2);
      for (int tick = 0; tick < 20; ++tick) cluster->step();
      for (const std::uint64_t body : {1, 2}) {
        EXPECT_NEAR(cluster->body(BodyId{body})->state.linear_velocity[0] / (direction * speed), 0.5, 0.05)
            << body << " at " << speed;
      }
    }
  }
}

WorldSettings around_a_planet() {
  WorldSettings settings = sectors_of(16);
  settings.gravity = CentralGravity{{{0, 0, -100'000}, {0, 0, 0}}, 9.81, 1.6e6};
  return settings;
}

TEST(LoneBodies, OrbitsAreTheSameOnAnyServersAndAnywhere) {
  WorldDescription world = sparse_world(around_a_planet(), 200);
  const std::vector<WorldHash> one = run(world, 1, 1, 150);
  EXPECT_EQ(first_difference(one, run(world, 3, 2, 150)), 150u);
  WorldDescription shuffled = world;
  shuffled.settings.shuffle = 7;
  EXPECT_EQ(first_difference(one, run(shuffled, 3, 1, 150)), 150u);
  ASSERT_TRUE(move_by(world, {std::int64_t{1} << 61, -(std::int64_t{1} << 61), 12345}).ok());
  EXPECT_EQ(first_difference(one, run(world, 2, 1, 150)), 150u);
}

// At 30 km/s the pull of a tick is less than the last digit of a float velocity.
TEST(LoneBodies, ASatelliteOf30KilometresASecondFallsAsItShould) {
  constexpr double kRadius = 1.5e11;  // m
  constexpr double kPull = 0.006;     // m/s^2
  WorldSettings settings;
  settings.time_step = 0.02;
  const absl::StatusOr<WorldPosition> centre = canonical({}, {-kRadius, 0, 0}, settings.sector_size);
  ASSERT_TRUE(centre.ok());
  settings.gravity = CentralGravity{*centre, kPull, kRadius};
  WorldBuilder builder(settings);
  builder.add("satellite", builder.shape(Sphere{0.5}), 100, {0, 0, 0}).linear_velocity = {
      0, std::sqrt(kPull * kRadius) * 0.6, std::sqrt(kPull * kRadius) * 0.8};
  auto cluster = cluster_of(builder.world(), 1);
  constexpr int kTicks = 5000;
  for (int tick = 0; tick < kTicks; ++tick) cluster->step();
  const BodyRecord satellite = *cluster->body(BodyId{1});
  const double time = kTicks * settings.time_step;
  const double fall =
      static_cast<double>(satellite.home.i) * settings.sector_size + satellite.state.position[0];
  EXPECT_NEAR(fall, -kPull * time * time / 2, 1e-3 * kPull * time * time / 2);
}

}  // namespace
}  // namespace tessera
