// Contacts that are easy to get wrong: what rolls gains no speed, what stands stays, what is fast hits.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

const Eigen::Quaterniond kLying(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));

BodyRecord body_of(const PartitionCluster& cluster, std::size_t place) {
  return *cluster.body(BodyId{place + 1});
}

Eigen::Vector3d velocity_of(const PartitionCluster& cluster, std::size_t place) {
  return Eigen::Vector3d(body_of(cluster, place).state.linear_velocity.data());
}

Eigen::Vector3d position_of(const PartitionCluster& cluster, std::size_t place, double sector_size) {
  const BodyRecord body = body_of(cluster, place);
  return Eigen::Vector3d(body.state.position.data()) +
         sector_size * Eigen::Vector3d(double(body.home.i), double(body.home.j), double(body.home.k));
}

bool is_asleep(const PartitionCluster& cluster, std::size_t place) {
  return body_of(cluster, place).state.activity == Activity::kAsleep;
}

TEST(Rolling, NothingGainsSpeedOnALevelFloor) {
  WorldSettings settings = sectors_of(788);
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  builder.add_floor(100, 0);
  const std::pair<Geometry, double> shapes[] = {{Cylinder{0.2, 0.5}, 0.2}, {Cylinder{0.2, 0.05}, 0.2},
                                                {Cylinder{1, 1}, 1},       {Capsule{0.2, 0.5}, 0.2},
                                                {Sphere{0.2}, 0.2},        {Ellipsoid{{0.2, 0.2, 0.4}}, 0.2}};
  constexpr double kSpeed = 0.3;  // m/s
  for (std::size_t n = 0; n < std::size(shapes); ++n) {
    const auto& [shape, radius] = shapes[n];
    BodyDescription& roller = builder.add(absl::StrCat("roller", n), builder.shape(shape), 2,
                                          {0, 4.0 * static_cast<double>(n), radius});
    roller.pose.orientation = kLying;
    roller.linear_velocity = {kSpeed, 0, 0};
    roller.angular_velocity = {0, kSpeed / radius, 0};
  }
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 3600; ++tick) {
    cluster->step();
    for (std::size_t n = 0; n < std::size(shapes); ++n) {
      ASSERT_LT(velocity_of(*cluster, n + 1).norm(), 1.001 * kSpeed) << "roller " << n << ", tick " << tick;
    }
  }
  for (std::size_t n = 0; n < std::size(shapes); ++n) {
    EXPECT_NEAR(position_of(*cluster, n + 1, 788).z(), shapes[n].second, 0.01 * shapes[n].second) << n;
  }
}

TEST(Standing, ACartWithFreeWheelsStays) {
  WorldBuilder builder(sectors_of(128));
  builder.add_floor(100, 0);
  builder.add("chassis", builder.shape(Box{{1, 0.5, 0.1}}), 20, {0, 0, 0.3});
  const ShapeId wheel = builder.shape(Cylinder{0.2, 0.1});
  for (int n = 0; n < 4; ++n) {
    const Eigen::Vector3d place(n & 1 ? 0.4 : -0.4, n & 2 ? 0.35 : -0.35, 0.2);
    const std::string name = absl::StrCat("wheel", n);
    builder.add(name, wheel, 2, place).pose.orientation = kLying;
    builder.tie(absl::StrCat("axle", n), JointType::kRevolute, "chassis", name, place,
                Eigen::Vector3d::UnitY());
  }
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 600; ++tick) cluster->step();
  EXPECT_LT(position_of(*cluster, 1, 128).head<2>().norm(), 0.01);
  EXPECT_TRUE(is_asleep(*cluster, 1));
}

TEST(Standing, FiveCylindersOnEachOtherSleep) {
  WorldBuilder builder(sectors_of(128));
  builder.add_floor(100, 0);
  const ShapeId cylinder = builder.shape(Cylinder{0.25, 0.5});
  for (int n = 0; n < 5; ++n) builder.add(absl::StrCat("cylinder", n), cylinder, 10, {0, 0, 0.25 + 0.5 * n});
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 600; ++tick) cluster->step();
  for (int n = 0; n < 5; ++n) {
    const auto place = static_cast<std::size_t>(n + 1);
    EXPECT_TRUE(is_asleep(*cluster, place)) << n;
    EXPECT_LT((position_of(*cluster, place, 128) - Eigen::Vector3d(0, 0, 0.25 + 0.5 * n)).norm(), 0.01) << n;
  }
}

TEST(Standing, BarrelsThatAreTippedOverSleep) {
  WorldBuilder builder(sectors_of(16));
  builder.add_floor(30, 0);
  const ShapeId barrel = builder.shape(Cylinder{0.3, 0.9});
  for (int n = 0; n < 12; ++n) {
    BodyDescription& body = builder.add(absl::StrCat("barrel", n), barrel, 20,
                                        {0.7 * (n % 4), 0.8 * (n / 4), 0.6 + 0.2 * (n % 3)});
    body.pose.orientation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * n, Eigen::Vector3d(1, 2, 0).normalized()));
    body.properties.surface = Surface{.rolling_friction = 0.002};  // or one may roll on for ever
  }
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 1800; ++tick) cluster->step();
  for (std::size_t n = 0; n < 12; ++n) {
    EXPECT_TRUE(is_asleep(*cluster, n + 1)) << n;
    EXPECT_GT(position_of(*cluster, n + 1, 16).z(), 0.28) << n;
  }
}

// Its corners meet the ground one after the other within a pass, which turns it a little: by about 1 mm.
TEST(Standing, ABoxDroppedFlatStaysOnAPlaneAsOnABox) {
  Eigen::Vector3d ends[2];
  for (const bool is_plane : {true, false}) {
    WorldBuilder builder(sectors_of(128));
    if (is_plane) {
      builder.add("floor", builder.shape(Plane{Eigen::Vector3d::UnitZ()}), 1, {0, 0, 0}, Motion::kStatic);
    } else {
      builder.add_floor(20, 0);
    }
    builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {0, 0, 1.5});
    const auto cluster = cluster_of(builder.world(), 1);
    for (int tick = 0; tick < 300; ++tick) cluster->step();
    ends[is_plane] = position_of(*cluster, 1, 128);
    EXPECT_LT((ends[is_plane] - Eigen::Vector3d(0, 0, 0.5)).norm(), 0.01) << is_plane;
    EXPECT_TRUE(is_asleep(*cluster, 1)) << is_plane;
  }
  EXPECT_LT((ends[0] - ends[1]).norm(), 1e-4);
}

// A block that turns a hundred times as easily as others, tilted and half in the floor: more steps than usual
// open the overlap no faster.
TEST(Resting, WhatTurnsEasilyIsLiftedOutOfTheFloorAndNotThrown) {
  WorldBuilder builder(sectors_of(100));
  builder.add_floor(20, 0);
  BodyDescription& block = builder.add("block", builder.shape(Box{{6, 5, 4}}), 3, {0, 0, 1});
  block.properties.inertia = {0.1, 0.1, 0.1};
  block.pose.orientation = Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 3).normalized());
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 300; ++tick) {
    cluster->step();
    const Eigen::Vector3d turn(body_of(*cluster, 1).state.angular_velocity.data());
    const double kinetic = 3 * velocity_of(*cluster, 1).squaredNorm() / 2 + 0.1 * turn.squaredNorm() / 2;
    ASSERT_LT(kinetic, 20) << "tick " << tick;
    ASSERT_LT(position_of(*cluster, 1, 100).z(), 2.5) << "tick " << tick;
  }
}

// Between the floor and what is above it, which leaves too little room: it does not get out, nor does it
// rest.
TEST(Overlaps, WhatIsBuriedDoesNotFallAsleepUnlessItIsFixedThere) {
  WorldBuilder builder(sectors_of(128));
  builder.add_floor(20, 0);
  const ShapeId box = builder.shape(Box{{0.4, 0.4, 0.4}});
  const ShapeId lid = builder.shape(Box{{1, 1, 0.2}});
  builder.add("stuck", box, 1, {0, 0, 0.15});
  builder.add("lid", lid, 1, {0, 0, 0.4}, Motion::kStatic);
  builder.add("base", box, 1, {5, 0, 0.1});
  builder.tie("mount", JointType::kFixed, "", "base", {5, 0, 0.1});
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 300; ++tick) cluster->step();
  EXPECT_FALSE(is_asleep(*cluster, 1));
  EXPECT_NEAR(position_of(*cluster, 1, 128).z(), 0.15, 1e-3);
  EXPECT_TRUE(is_asleep(*cluster, 3));
}

// Five boxes in one place, without gravity. In short ticks contacts are stiffer, and each step leaves a
// little of the speed at which it opens overlaps: they came apart at 12 m/s in ticks of 1/8000 s, and at 1.7
// in those of 1/60.
TEST(Overlaps, OpenNoFasterInShortTicks) {
  for (const double time_step : {1.0 / 60, 1.0 / 1000, 1.0 / 8000}) {
    WorldBuilder builder(sectors_of(100));
    builder.world().settings.time_step = time_step;
    builder.world().settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
    builder.add("box0", builder.shape(Box{{3, 4, 5}}), 1, {0, 0, 0});
    const ShapeId other = builder.shape(Box{{2, 3, 4}});
    const Eigen::Vector3d places[] = {{0.5, 0.4, 1}, {-0.5, 0.4, 1}, {0.5, -0.4, -1}, {0.2, 0.4, -1}};
    for (int n = 0; n < 4; ++n) {
      builder.add(absl::StrCat("box", n + 1), other, 2, places[n]).pose.orientation =
          Eigen::AngleAxisd(0.3 * n, Eigen::Vector3d(1, 2, 3).normalized());
    }
    const auto cluster = cluster_of(builder.world(), 1);
    for (double time = 0; time < 1; time += time_step) cluster->step();
    for (std::size_t n = 0; n < 5; ++n)
      EXPECT_LT(velocity_of(*cluster, n).norm(), 2) << "box " << n << ", ticks of " << time_step << " s";
  }
}

// As SDF has it for a link without <inertia>.
TEST(Standing, AHeavyBoxWithTheMomentsOfALightOneSleeps) {
  WorldBuilder builder(sectors_of(128));
  builder.add_floor(20, 0);
  builder.add("box", builder.shape(Box{{2, 2, 2}}), 1000, {0, 0, 1.05}).properties.inertia = {1, 1, 1};
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 300; ++tick) cluster->step();
  EXPECT_TRUE(is_asleep(*cluster, 1));
  EXPECT_NEAR(position_of(*cluster, 1, 128).z(), 1, 0.005);
}

TEST(Standing, LightAndHeavyBoxesInTurns) {
  WorldBuilder builder(sectors_of(128));
  builder.add_floor(20, 0);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int n = 0; n < 6; ++n) builder.add(absl::StrCat("box", n), box, n % 2 ? 100 : 1, {0, 0, 0.5 + n});
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 600; ++tick) cluster->step();
  for (int n = 0; n < 6; ++n) {
    const Eigen::Vector3d place = position_of(*cluster, static_cast<std::size_t>(n + 1), 128);
    EXPECT_LT((place - Eigen::Vector3d(0, 0, 0.5 + n)).norm(), 0.03) << n;
  }
}

// The number of dominoes of 1 and 100 kg in turns that have fallen: they lie on the next one, and the last
// few, sometimes, in a heap. One that only leans on the next one is steeper.
int fallen(double sector_size, int count, int ticks) {
  constexpr double kFallen = 0.8;  // cosine to the vertical
  WorldBuilder builder(sectors_of(sector_size));
  builder.add_floor(0.4 * count, 0);
  const ShapeId domino = builder.shape(Box{{0.2, 0.8, 1.6}});
  for (int n = 0; n < count; ++n) {
    builder.add(absl::StrCat("domino", n), domino, n % 2 ? 1 : 100, {0.7 * n - 0.35 * count, 0, 0.8});
  }
  builder.world().bodies[1].angular_velocity = {0, 1.5, 0};
  builder.world().bodies[1].linear_velocity = {1.2, 0, 0};
  const auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < ticks; ++tick) cluster->step();
  int down = 0;
  for (int n = 0; n < count; ++n) {
    if (body_of(*cluster, static_cast<std::size_t>(n + 1)).state.rotation[8] < kFallen) ++down;
  }
  return down;
}

TEST(Dominoes, LightAndHeavyOnesFallAlikeInOneSectorAndOverNine) {
  EXPECT_EQ(fallen(256, 300, 3600), 300);
  EXPECT_EQ(fallen(25, 300, 3600), 300);
}

// A bumpy square of 20 m; `samples` vertices a side.
TriangleMesh bumps(int samples) {
  TriangleMesh mesh;
  const double spacing = 20.0 / (samples - 1);
  for (int row = 0; row < samples; ++row) {
    for (int column = 0; column < samples; ++column) {
      const double x = spacing * column - 10;
      const double y = spacing * row - 10;
      mesh.vertices.push_back({x, y, 0.6 * std::sin(1.3 * x) * std::cos(0.9 * y)});
    }
  }
  const auto stride = static_cast<std::uint32_t>(samples);
  for (std::uint32_t row = 0; row + 1 < stride; ++row) {
    for (std::uint32_t column = 0; column + 1 < stride; ++column) {
      const std::uint32_t n = row * stride + column;
      for (const std::uint32_t corner : {n, n + 1, n + stride, n + 1, n + 1 + stride, n + stride}) {
        mesh.indices.push_back(corner);
      }
    }
  }
  return mesh;
}

TEST(Dropping, OnVerticesAndEdgesOfAMeshLands) {
  for (const int samples : {11, 81}) {
    WorldBuilder builder(sectors_of(8));
    builder.add("ground", builder.shape(bumps(samples)), 1, {0, 0, 0}, Motion::kStatic);
    const ShapeId shapes[] = {builder.shape(Sphere{0.05}), builder.shape(Box{{0.2, 0.1, 0.05}}),
                              builder.shape(Capsule{0.05, 0.2}), builder.shape(Cylinder{0.1, 0.02})};
    const double spacing = 20.0 / (samples - 1);
    std::size_t count = 0;
    for (int row = 1; row < 9; ++row) {
      for (int column = 1; column < 9; ++column) {
        // Above a vertex, and above the middle of an edge.
        const double x = spacing * std::round(2 * column / spacing) - 10;
        const double y = spacing * (std::round(2 * row / spacing) + (count % 2 == 0 ? 0 : 0.5)) - 10;
        BodyDescription& body =
            builder.add(absl::StrCat("body", count), shapes[count / 2 % 4], 0.5, {x, y, 3});
        body.linear_velocity.z() = count % 3 == 0 ? 0 : -100;
        ++count;
      }
    }
    const auto cluster = cluster_of(builder.world(), 1);
    for (int tick = 0; tick < 240; ++tick) cluster->step();
    for (std::size_t n = 0; n < count; ++n) {
      const Eigen::Vector3d place = position_of(*cluster, n + 1, 8);
      const bool is_over_edge = place.head<2>().cwiseAbs().maxCoeff() > 10;
      EXPECT_TRUE(is_over_edge || place.z() > -1)
          << samples << " samples, body " << n << " at " << place.transpose();
    }
  }
}

// Two balls on a rod, along y.
Shape dumbbell() {
  ShapePart left{Sphere{0.1}, {}};
  ShapePart right{Sphere{0.1}, {}};
  left.pose.position.y() = -0.3;
  right.pose.position.y() = 0.3;
  return Shape{{left, right, ShapePart{Box{{0.05, 0.6, 0.05}}, {}}}};
}

// Two bodies without weight that fly at each other along x and meet at `where` (m) after 0.31 s.
WorldDescription duel(double sector_size, double speed_a, double speed_b, double where, bool is_compound) {
  WorldSettings settings = sectors_of(sector_size);
  settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  WorldBuilder builder(settings);
  const ShapeId ball = builder.shape(Sphere{0.1});
  builder.world().shapes.push_back(dumbbell());
  const ShapeId other = is_compound ? ball + 1 : ball;
  constexpr double kTime = 0.31;  // s, not at the end of a tick
  const double y = is_compound ? 0.3 : 0.01;
  builder.add("a", ball, 1, {where - speed_a * kTime - 0.1, y, 0}).linear_velocity = {speed_a, 0, 0};
  builder.add("b", other, 1, {where + speed_b * kTime + 0.1, 0, 0}).linear_velocity = {-speed_b, 0, 0};
  return builder.world();
}

// Whether they have hit each other, and none went through the other.
bool have_hit(const WorldDescription& world) {
  const auto cluster = cluster_of(world, 1);
  for (int tick = 0; tick < 30; ++tick) cluster->step();
  const double change = world.bodies[0].linear_velocity.x() - velocity_of(*cluster, 0).x();
  return change > 0.01 * (world.bodies[0].linear_velocity - world.bodies[1].linear_velocity).x();
}

TEST(Fast, BodiesThatFlyAtEachOtherHit) {
  for (const double speed : {100.0, 300.0, 1000.0}) {
    for (const double other : {0.0, 0.5 * speed, speed}) {
      for (const bool is_compound : {false, true}) {
        EXPECT_TRUE(have_hit(duel(788, speed, other, 0, is_compound)))
            << speed << " " << other << is_compound;
        EXPECT_TRUE(have_hit(duel(788, other, speed, 0, is_compound)))
            << speed << " " << other << is_compound;
      }
    }
  }
}

}  // namespace
}  // namespace tessera
