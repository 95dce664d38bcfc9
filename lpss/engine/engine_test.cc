// What bodies do in one engine world.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "lpss/engine/test_world.h"

namespace tessera::engine_tests {
namespace {

using testing::DoubleNear;

struct Ground {
  ShapeId shape;
  double z;    // of its body
  double top;  // where bodies rest
};
constexpr Ground kGrounds[] = {{kFloorShape, -1, 0},
                               {kPlaneShape, 0, 0},
                               {kMeshShape, 0, 0},
                               {kHeightFieldShape, 0, 0.5},
                               {kCompoundFloorShape, 0, 0}};

TEST(RestTest, EveryShapeRestsOnEveryGroundAtItsHeight) {
  const auto engine = test_engine(test_settings());
  for (const Ground& ground : kGrounds) {
    TestWorld world(*engine);
    world.add(static_body(1, ground.shape, {0, 0, ground.z}));
    for (ShapeId shape = 0; shape < kDynamicShapes; ++shape) {
      BodyRecord record = dynamic_body(10 + shape, shape,
                                       {shape * 2.1 - 8.3, 0.7, ground.top + resting_height(shape) + 0.05});
      record.properties.angular_damping = 0.5;
      world.add(record);
    }
    world.run(240);
    for (ShapeId shape = 0; shape < kDynamicShapes; ++shape) {
      // The dumbbell leans on its ball.
      if (shape == kDumbbellShape) continue;
      EXPECT_NEAR(world.height(10 + shape), ground.top + resting_height(shape), 0.006)
          << "shape " << shape << " on " << ground.shape;
    }
    EXPECT_NEAR(world.height(10 + kDumbbellShape), ground.top + resting_height(kDumbbellShape), 0.05);
  }
}

TEST(RestTest, SmallAndLargeBodiesKeepTheirSize) {
  const auto engine = test_engine(test_settings());
  const double sizes[] = {0.004, 0.02, 0.1, 4, 20};
  ShapeId next = 100;
  for (double size : sizes) {
    const double r = size / 2;
    ConvexHull hull;
    for (double x : {-r, r})
      for (double y : {-r, r})
        for (double z : {-r, r}) hull.points.emplace_back(x, y, z);
    for (const Geometry& geometry :
         {Geometry(Box{{size, size, size}}), Geometry(Cylinder{r, size}), Geometry(hull)}) {
      TestWorld world(*engine);
      engine->add_shape(next, {{{geometry, {}}}});
      BodyRecord record = dynamic_body(10, next++, {0.1 * size, 0.2 * size, r * 1.02});
      record.properties.mass = size * size * size * 1000;
      const double inertia = record.properties.mass * size * size / 6;
      record.properties.inertia = {inertia, inertia, inertia};
      // A hull far smaller than what it lies on is beyond float's distance algorithm.
      const bool is_small = size < 0.05;
      world.add(static_body(1, is_small ? kPlaneShape : kFloorShape, {0, 0, is_small ? 0.0 : -1.0}));
      world.add(record);
      // In one step, gravity must not move the body by much of its size.
      const double tick = std::min(kTick, std::sqrt(0.05 * size / 9.81));
      for (int i = 0; i < 120; ++i) world.step(tick);
      EXPECT_NEAR(world.height(10), r, 0.01 * size) << "size " << size << " geometry " << geometry.index();
    }
  }
}

TEST(RestTest, CentreFrameIsWhereTheBodyTurns) {
  // The same box once centred, once with its origin in a corner and turned axes.
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  engine->add_shape(100, {{{Box{{1, 0.6, 0.4}}, {}}}});
  engine->add_shape(101, {{{Box{{1, 0.6, 0.4}}, {{0.5, 0.3, 0.2}, Eigen::Quaterniond::Identity()}}}});
  world.add(static_body(1, kFloorShape, {0, 0, -1}));
  world.add(dynamic_body(10, 100, {0, 0, 0.3}));
  BodyRecord cornered = dynamic_body(11, 101, {3, 0, 0.3});
  cornered.properties.centre = {0.5, 0.3, 0.2};
  world.add(cornered);
  world.run(120);
  EXPECT_NEAR(world.height(10), 0.2, 0.004);
  EXPECT_NEAR(world.height(11), 0.2, 0.004);
}

TEST(HeightFieldTest, SamplesLieWhereTheyAreSaidTo) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(static_body(1, kHeightFieldShape, {0, 0, 0}));
  const auto height_at = [&](double x, double y) {
    const auto hit = world.world().raycast({x, y, 10}, {x, y, -10}, {1});
    return hit ? 10 - 20 * hit->fraction : -100.0;
  };
  EXPECT_NEAR(height_at(0.3, 0.2), 0.5, 1e-3);
  EXPECT_NEAR(height_at(-19.9, -19.9), 0.5, 1e-3);
  EXPECT_NEAR(height_at(19.99, 19.99), 3, 0.06);
  EXPECT_NEAR(height_at(19.99, -19.9), 0.5, 1e-3);
}

// A flat terrain of 40 x 40 squares of 1 m, two triangles each.
TriangleMesh squares() {
  TriangleMesh mesh;
  constexpr std::uint32_t kSide = 41;
  for (std::uint32_t row = 0; row < kSide; ++row) {
    for (std::uint32_t column = 0; column < kSide; ++column) {
      mesh.vertices.push_back({column - 20.0, row - 20.0, 0});
    }
  }
  for (std::uint32_t row = 0; row + 1 < kSide; ++row) {
    for (std::uint32_t column = 0; column + 1 < kSide; ++column) {
      const std::uint32_t corner = row * kSide + column;
      for (const std::uint32_t n : {0u, 1u, kSide, 1u, kSide + 1, kSide}) mesh.indices.push_back(corner + n);
    }
  }
  return mesh;
}

TEST(TerrainTest, ABallRollsOverInnerEdgesAsOverAFloor) {
  const auto engine = test_engine(test_settings());
  engine->add_shape(100, Shape{{{squares(), {}}}});
  engine->add_shape(101, Shape{{{HeightField{41, 41, {1, 1}, std::vector<double>(41 * 41, 0.0)}, {}}}});
  for (const ShapeId ground : {ShapeId{100}, ShapeId{101}, kPlaneShape, kFloorShape}) {
    TestWorld world(*engine);
    world.add(static_body(1, ground, {0, 0, ground == kFloorShape ? -1.0 : 0.0}));
    BodyRecord ball = dynamic_body(10, kSphereShape, {-18, -17.7, 0.5});
    ball.state.linear_velocity = {5, 4.3, 0};
    ball.state.angular_velocity = {-8.6, 10, 0};
    world.add(ball);
    double highest = 0;
    for (int t = 0; t < 400; ++t) {
      world.step();
      highest = std::max(highest, world.height(10));
    }
    EXPECT_LT(highest, 0.502) << "shape " << ground;
    EXPECT_NEAR(world.state(10).linear_velocity[0], 5, 0.05) << "shape " << ground;
    EXPECT_NEAR(world.state(10).linear_velocity[1], 4.3, 0.05) << "shape " << ground;
  }
}

TEST(AddStaticTest, PartIsPosedInTheSector) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  const Pose pose{{0, 0, 2}, Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()))};
  const Shape part{{{Box{{1, 4, 6}}, {{0.5, 0, 0}, Eigen::Quaterniond::Identity()}}}};
  const BodySlot slot = world.add_static(1, part, pose);
  EXPECT_EQ(world.world().position(slot), Eigen::Vector3d(0, 0, 2));
  // Turned, the box is 1 m thick, its middle 0.5 m below the pose.
  world.add(dynamic_body(10, kBoxShape, {2, 0, 2.6}));
  world.run(60);
  EXPECT_NEAR(world.height(10), 2.5, 0.006);
}

TEST(StateTest, ComesBackBitForBit) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  BodyRecord record = dynamic_body(10, kTableShape, {0.1f, 20, 30});
  record.state.angular_velocity = {1, 2, 3};
  world.add(record);
  world.run(50);
  BodyState state = world.state(10);
  state.still_for = 0.25;
  state.activity = Activity::kWantsSleep;
  world.world().set_state(world.slot(10), state);
  EXPECT_EQ(hash_of(world.state(10), 1), hash_of(state, 1));
  BodyRecord copy = record;
  copy.id = {11};
  copy.state = state;
  world.add(copy);
  EXPECT_EQ(hash_of(world.state(11), 1), hash_of(state, 1));
}

TEST(ForceTest, GravityWrenchAndImpulse) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  BodyRecord floating = dynamic_body(11, kBoxShape, {5, 0, 0});
  floating.properties.gravity = false;
  world.add(dynamic_body(10, kBoxShape, {0, 0, 0}));
  world.add(floating);
  world.world().add_wrench(world.slot(11), {{0, 6, 0}, {}});
  world.world().add_wrench(world.slot(11), {{0, 6, 0}, {}});
  world.world().detect(kTick);
  EXPECT_NEAR(world.world().total_wrench(world.slot(10)).force[2], -9.81, 1e-5);
  EXPECT_NEAR(world.world().total_wrench(world.slot(11)).force[1], 12, 1e-5);
  const auto solver = engine->make_solver();
  SolveTask task{.bodies = {{&world.world(), world.slot(10)}, {&world.world(), world.slot(11)}}};
  divide_into_islands(task);
  SolvedTask solved;
  solver->solve(task, kTick, solved);
  world.world().integrate(kTick);
  EXPECT_NEAR(world.state(10).linear_velocity[2], -9.81 * kTick, 1e-6);
  EXPECT_NEAR(world.state(11).linear_velocity[1], 12 * kTick, 1e-6);
  world.step();
  EXPECT_NEAR(world.state(11).linear_velocity[1], 12 * kTick, 1e-6) << "a wrench lasts one step";
  world.world().apply_impulse(world.slot(11), {1, 0, 0}, {0, 0.5, 0});
  EXPECT_NEAR(world.state(11).linear_velocity[0], 1, 1e-6);
  EXPECT_NEAR(world.state(11).angular_velocity[2], -3, 1e-5);
}

TEST(IntegrateTest, ABodyTurnsAsFarAsItsSpinTakesIt) {
  const auto engine = test_engine(test_settings());
  for (const double turn : {0.01, 0.7, 0.9, 2.0, 3.0}) {
    TestWorld world(*engine);
    BodyRecord spun = dynamic_body(10, kSphereShape, {0, 0, 0});
    spun.state.angular_velocity = {0, 0, turn / kTick};
    world.add(spun);
    world.step();
    const std::array<double, 9> rows = world.state(10).rotation;
    EXPECT_NEAR(std::atan2(rows[3], rows[0]), turn, 1e-5);
  }
}

TEST(MaskTest, BothSidesMustWantTheContact) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(static_body(1, kFloorShape, {0, 0, -1}));
  BodyRecord other = dynamic_body(10, kBoxShape, {0, 0, 0.5});
  other.properties.category = 2;
  BodyRecord blind = dynamic_body(11, kBoxShape, {3, 0, 0.5});
  blind.properties.mask = 2;
  BodyRecord fast = dynamic_body(12, kSphereShape, {6, 0, 5});
  fast.properties.mask = 2;
  fast.state.linear_velocity = {0, 0, -200};
  for (const BodyRecord& record : {other, blind, fast}) world.add(record);
  world.run(60);
  EXPECT_NEAR(world.height(10), 0.5, 0.005);
  EXPECT_LT(world.height(11), -3);
  EXPECT_LT(world.height(12), -150) << "sweeps respect masks";
}

TEST(KinematicTest, ConveyorCarriesWhatLiesOnIt) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  BodyRecord belt = dynamic_body(10, kFloorShape, {0, 0, -1});
  belt.properties.motion = Motion::kKinematic;
  belt.state.linear_velocity = {1, 0, 0};
  world.add(belt);
  world.add(dynamic_body(11, kBoxShape, {0, 0, 0.5}));
  world.run(180);
  EXPECT_EQ(world.state(10).position[0], 0) << "the caller moves kinematic bodies";
  EXPECT_EQ(world.state(10).linear_velocity[0], 1);
  EXPECT_NEAR(world.state(11).linear_velocity[0], 1, 0.01);
  EXPECT_NEAR(world.height(11), 0.5, 0.005);
}

TEST(ContinuousCollisionTest, BulletDoesNotPassAThinWall) {
  for (bool continuous : {true, false}) {
    EngineSettings settings = test_settings();
    settings.continuous_collision = continuous;
    const auto engine = test_engine(settings);
    engine->add_shape(100, {{{Sphere{0.02}, {}}}});
    engine->add_shape(101, {{{Box{{0.02, 4, 4}}, {}}}});
    engine->add_shape(102, {{{Box{{0.03, 0.03, 0.03}}, {}}}});
    TestWorld world(*engine);
    world.add(static_body(1, 101, {0, 0, 0}));
    BodyRecord ball = dynamic_body(10, 100, {-5, 0, 0});
    ball.properties.gravity = false;
    ball.properties.mass = 0.01;
    ball.properties.inertia = {1e-6, 1e-6, 1e-6};
    ball.state.linear_velocity = {300, 0, 0};
    BodyRecord cube = ball;
    cube.id = {11};
    cube.properties.shape = 102;
    cube.state.position = {-5, 1, 0.5};
    world.add(ball);
    world.add(cube);
    world.run(30);
    EXPECT_EQ(world.state(10).position[0] < 0, continuous);
    EXPECT_EQ(world.state(11).position[0] < 0, continuous);
  }
}

TEST(RaycastTest, FindsTheNearestThatIsWanted) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  BodyRecord second = dynamic_body(11, kBoxShape, {5, 0, 0});
  second.properties.category = 4;
  world.add(second);
  world.add(dynamic_body(10, kBoxShape, {3, 0, 0}));
  world.add(dynamic_body(12, kBoxShape, {1, 0, 0}), Role::kClone);
  world.add(static_body(1, kPlaneShape, {0, 0, -2}));
  const auto hit = world.world().raycast({-2, 0.1, 0.1}, {8, 0.1, 0.1}, {0xffffffff});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->body.value, 10u) << "clones are not hit";
  EXPECT_NEAR(hit->fraction, 0.45, 1e-5);
  EXPECT_NEAR(hit->normal.x(), -1, 1e-5);
  EXPECT_EQ(world.world().raycast({-2, 0.1, 0.1}, {8, 0.1, 0.1}, {4})->body.value, 11u);
  EXPECT_EQ(world.world().raycast({-2, 0, 0}, {-2, 0, -9}, {1})->body.value, 1u);
  EXPECT_FALSE(world.world().raycast({-2, 0, 0}, {-2, 0, 9}, {1}).has_value());
  // Two at the same distance: the lower id.
  world.add(dynamic_body(9, kBoxShape, {3, 0, 0}));
  EXPECT_EQ(world.world().raycast({-2, 0.1, 0.1}, {8, 0.1, 0.1}, {1})->body.value, 9u);
}

TEST(RaycastTest, MeetsEachBodyOnceOnItsWayButThoseThatItIsNotTo) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  for (const std::uint64_t id : {11, 10, 12})
    world.add(dynamic_body(id, kBoxShape, {double(id % 10) * 2, 0, 0}),
              id == 12 ? Role::kClone : Role::kHome);
  world.add(static_body(1, kBoxShape, {6, 0, 0}));
  const std::vector<RayHit> hits = world.world().raycast_all({-2, 0.1, 0.1}, {8, 0.1, 0.1}, {});
  ASSERT_EQ(hits.size(), 3u);
  const std::array<double, 3> fractions{0.75, 0.15, 0.35};
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_EQ(hits[n].body.value, (std::array<std::uint64_t, 3>{1, 10, 11})[n]);
    EXPECT_NEAR(hits[n].fraction, fractions[n], 1e-5);
  }
  const std::vector<BodyId> except{BodyId{10}, BodyId{11}};
  const QueryFilter others{.except = except};
  EXPECT_EQ(world.world().raycast({-2, 0.1, 0.1}, {8, 0.1, 0.1}, others)->body.value, 1u);
  EXPECT_EQ(world.world().raycast_all({-2, 0.1, 0.1}, {8, 0.1, 0.1}, others).size(), 1u);
  EXPECT_EQ(world.world().near(Sphere{0.5}, {}, 10, others).size(), 1u);
}

TEST(SweepTest, AProbeStopsAtTheFirstThatIsWanted) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(dynamic_body(10, kBoxShape, {3, 0, 0}));
  world.add(dynamic_body(11, kBoxShape, {5, 0, 0}));
  world.add(dynamic_body(12, kBoxShape, {2, 0, 0}), Role::kClone);
  world.add(static_body(1, kPlaneShape, {0, 0, -2}));
  const Pose from{{-2, 0.1, 0.1}, Eigen::Quaterniond::Identity()};
  const auto sweep = [&](const Eigen::Vector3d& direction, double length, const QueryFilter& filter) {
    return world.world().sweep(Sphere{0.25}, from, direction, length, filter);
  };
  const Eigen::Vector3d east = Eigen::Vector3d::UnitX();
  const auto hit = sweep(east, 10, {});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->body.value, 10u);
  EXPECT_NEAR(hit->distance, 4.25, 1e-3);
  EXPECT_NEAR((hit->normal + east).norm(), 0, 1e-3);
  EXPECT_FALSE(sweep(east, 4.2, {}));
  EXPECT_FALSE(sweep(-east, 10, {}));
  const std::vector<BodyId> except{BodyId{10}};
  EXPECT_NEAR(sweep(east, 10, {.except = except})->distance, 6.25, 1e-3);
  const auto below = sweep(-Eigen::Vector3d::UnitZ(), 10, {});
  ASSERT_TRUE(below);
  EXPECT_EQ(below->body.value, 1u);
  EXPECT_NEAR(below->distance, 1.85, 1e-3);
  EXPECT_NEAR(below->normal.z(), 1, 1e-3);
  const auto inside =
      world.world().sweep(Sphere{0.25}, {{2.4, 0, 0}, Eigen::Quaterniond::Identity()}, -east, 5, {});
  ASSERT_TRUE(inside);
  EXPECT_EQ(inside->distance, 0);
  EXPECT_NEAR((inside->normal + east).norm(), 0, 1e-3);
}

TEST(RaycastTest, SeesBodiesWhereTheyHaveMovedTo) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  BodyRecord record = dynamic_body(10, kBoxShape, {0, 0, 0});
  record.properties.gravity = false;
  world.add(record);
  BodyState moved = world.state(10);
  moved.position = {50, 0, 0};
  world.world().set_state(world.slot(10), moved);
  EXPECT_TRUE(world.world().raycast({50, 0, 5}, {50, 0, -5}, {1}).has_value());
  EXPECT_FALSE(world.world().raycast({0, 0, 5}, {0, 0, -5}, {1}).has_value());
}

TEST(BoxTest, SweptBoxAndReach) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  BodyRecord record = dynamic_body(10, kBoxShape, {0, 0, 0});
  record.state.linear_velocity = {60, 0, 0};
  world.add(record);
  world.add(static_body(1, kBoxShape, {0, 10, 0}));
  world.add(dynamic_body(11, kBoxShape, {0, -10, 0}), Role::kClone);
  const Eigen::AlignedBox3d box = world.world().swept_box(world.slot(10), kTick);
  EXPECT_NEAR(box.min().x(), -0.52, 1e-3);
  EXPECT_NEAR(box.max().x(), 1.52, 1e-3);
  const auto around = [](double x, double y) {
    return Eigen::AlignedBox3d(Eigen::Vector3d(x - 0.1, y - 0.1, -0.1),
                               Eigen::Vector3d(x + 0.1, y + 0.1, 0.1));
  };
  BodySlot hint = kNoSlot;
  EXPECT_TRUE(world.world().reaches_home_body(around(0.5, 0), hint));
  EXPECT_TRUE(world.world().reaches_home_body(around(0.5, 0), hint)) << "again";
  EXPECT_FALSE(world.world().reaches_home_body(around(2, 0), hint));
  EXPECT_FALSE(world.world().reaches_home_body(around(0, 10), hint)) << "static";
  EXPECT_FALSE(world.world().reaches_home_body(around(0, -10), hint)) << "clone";
}

// Of a body that has just come from another server, what makes it go farther is set after it was added.
TEST(BoxTest, ReachesAsFarAsWhatIsSetLaterSays) {
  const auto engine = test_engine(test_settings());
  const auto reaches = [&](const BodyState& state, const auto& set) {
    TestWorld world(*engine);
    BodyRecord record = dynamic_body(10, kBoxShape, {0, 0, 0});
    record.state.linear_velocity = state.linear_velocity;
    record.state.angular_velocity = state.angular_velocity;
    record.state.activity = state.activity;
    set(world.world(), world.add(record));
    BodySlot hint = kNoSlot;
    return world.world().reaches_home_body({Eigen::Vector3d(-0.1, 0.9, -0.1), Eigen::Vector3d(0.1, 1.1, 0.1)},
                                           hint);
  };
  BodyState moving;
  moving.linear_velocity = {30, 0, 0};
  moving.angular_velocity = {0, 0, 30};
  BodyState asleep;
  asleep.activity = Activity::kAsleep;
  EXPECT_FALSE(reaches({}, [](SectorWorld&, BodySlot) {}));
  EXPECT_FALSE(reaches(moving, [](SectorWorld&, BodySlot) {}));
  EXPECT_TRUE(reaches({}, [](SectorWorld& world, BodySlot slot) { world.set_surge(slot, 0.8); }));
  EXPECT_TRUE(reaches({}, [](SectorWorld& world, BodySlot slot) {
    world.add_wrench(slot, {{3000, 0, 0}, {}});  // N, on 1 kg: 0.8 m in a tick
  }));
  EXPECT_TRUE(reaches(moving, [](SectorWorld& world, BodySlot slot) { world.set_jointed(slot, true); }));
  EXPECT_TRUE(reaches(asleep, [](SectorWorld& world, BodySlot slot) {
    world.set_surge(slot, 0.8);
    world.wake(slot);
  }));
}

TEST(ContactTest, PairsAreSortedAndTold) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(dynamic_body(30, kBoxShape, {0, 0, 0.5}));
  world.add(dynamic_body(20, kTableShape, {3, 0, 0.4}));
  world.add(dynamic_body(10, kBoxShape, {0, 0.1, 1.5}));
  world.add(static_body(25, kFloorShape, {0, 0, -1}));
  world.run(30);
  const std::span<const ContactPair> contacts = world.world().contacts();
  ASSERT_EQ(contacts.size(), 3u);
  EXPECT_EQ(contacts[0].a.value, 10u);
  EXPECT_EQ(contacts[0].b.value, 30u);
  EXPECT_EQ(contacts[1].a.value, 20u);
  EXPECT_EQ(contacts[2].a.value, 25u);
  EXPECT_EQ(contacts[2].b.value, 30u);
  for (const ContactPair& pair : contacts) EXPECT_TRUE(pair.touching);
  const ContactDetail upper = world.world().touching_patches(0).at(0);
  EXPECT_NEAR(upper.normal.z(), 1, 1e-3) << "on b, pointing to a";
  ASSERT_EQ(upper.points.size(), 4u);
  for (const TouchingPoint& point : upper.points) EXPECT_NEAR(point.position.z(), 1, 0.01);
  EXPECT_NEAR(upper.impulse, 9.81 * kTick, 0.02);
  const ContactDetail lower = world.world().touching_patches(2).at(0);
  EXPECT_NEAR(lower.normal.z(), -1, 1e-3);
  EXPECT_NEAR(lower.points.at(0).position.z(), 0, 0.01);
  EXPECT_NEAR(lower.impulse, 2 * 9.81 * kTick, 0.03);

  world.remove(30);
  EXPECT_EQ(world.world().contacts().size(), 1u);
}

TEST(ContactTest, ClonesMeetHomeBodiesOnlyUnlessTheyAreSolved) {
  for (const bool plain_bullet : {false, true}) {
    EngineSettings settings = test_settings();
    settings.plain_bullet = plain_bullet;
    const auto engine = test_engine(settings);
    TestWorld world(*engine);
    world.add(static_body(1, kFloorShape, {0, 0, -1}));
    world.add(dynamic_body(10, kBoxShape, {0, 0, 0.5}), Role::kClone);
    world.add(dynamic_body(11, kBoxShape, {0, 0, 1.5}), Role::kClone);
    world.add(dynamic_body(12, kBoxShape, {0, 0, 2.5}));
    world.world().detect(kTick);
    EXPECT_EQ(world.world().contacts().size(), plain_bullet ? 3u : 1u);
  }
}

TEST(SleepTest, FallsAsleepStaysAndWakes) {
  EngineSettings settings = test_settings();
  settings.sleep_after = 0.5;
  const auto engine = test_engine(settings);
  TestWorld world(*engine);
  world.add(static_body(1, kFloorShape, {0, 0, -1}));
  world.add(dynamic_body(10, kBoxShape, {0, 0, 0.5}));
  world.add(dynamic_body(11, kBoxShape, {0, 0, 1.5}));
  world.run(120);
  ASSERT_EQ(world.asleep(), 2u);
  EXPECT_EQ(world.world().contacts().size(), 2u) << "contacts of sleepers stay";
  const std::uint64_t asleep = world.hash();
  world.run(60);
  EXPECT_EQ(world.hash(), asleep);
  world.add(dynamic_body(12, kSphereShape, {0.1, 0, 4}));
  world.run(60);
  EXPECT_EQ(world.asleep(), 0u) << "woken by what fell on them";
  world.run(600);
  EXPECT_NEAR(world.height(10), 0.5, 0.01);
}

// For `still` ticks at rest, then for one at `speed` times the sleeping speed.
double still_for_after_slip(double speed, int still) {
  EngineSettings settings = test_settings();
  settings.sleep_after = 1;
  const auto engine = test_engine(settings);
  TestWorld world(*engine);
  BodyRecord floating = dynamic_body(10, kBoxShape, {0, 0, 0});
  floating.properties.gravity = false;
  world.add(floating);
  world.run(still);
  const Eigen::Vector3d slip(speed * settings.sleep_linear_speed, 0, 0);
  world.world().set_velocity(world.slot(10), slip, Eigen::Vector3d::Zero());
  world.run(1);
  return world.state(10).still_for;
}

TEST(SleepTest, ASlipTakesStillnessBackAndAMotionAllOfIt) {
  EXPECT_NEAR(still_for_after_slip(0.5, 30), 31 * kTick, 1e-5);
  EXPECT_NEAR(still_for_after_slip(1.5, 30), (30 - 4 * 1.5 * 1.5) * kTick, 1e-5);
  EXPECT_EQ(still_for_after_slip(5, 30), 0);
}

TEST(SleepTest, NeverWithoutATimeToSleepAfter) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(static_body(1, kFloorShape, {0, 0, -1}));
  world.add(dynamic_body(10, kBoxShape, {0, 0, 0.5}));
  world.run(300);
  EXPECT_EQ(world.state(10).activity, Activity::kAwake);
  EXPECT_GT(world.state(10).still_for, 3);
}

// Overlaps open by position alone, and what still moves so does not rest, although it has no velocity.
TEST(OverlapTest, BallsInOnePlaceComeApartSlowly) {
  EngineSettings settings = test_settings();
  settings.sleep_after = 0.5;
  const auto engine = test_engine(settings);
  TestWorld world(*engine);
  constexpr std::uint64_t kBalls = 10;
  for (std::uint64_t id = 1; id <= kBalls; ++id) {
    BodyRecord ball = dynamic_body(id, kSphereShape, {0, 0, 0});
    ball.properties.gravity = false;
    world.add(ball);
  }
  for (int tick = 0; tick < 600; ++tick) {
    world.run(1);
    for (std::uint64_t id = 1; id <= kBalls; ++id) {
      ASSERT_LT(Eigen::Vector3d(world.state(id).linear_velocity.data()).norm(), 2) << "tick " << tick;
    }
  }
  for (std::uint64_t a = 1; a <= kBalls; ++a) {
    for (std::uint64_t b = 1; b < a; ++b) {
      const Eigen::Vector3d apart =
          Eigen::Vector3d(world.state(a).position.data()) - Eigen::Vector3d(world.state(b).position.data());
      EXPECT_GT(apart.norm(), 0.95) << a << ", " << b;
    }
  }
}

TEST(OverlapTest, OfACrowdTheDeepestContactsAreKept) {
  constexpr std::uint64_t kBalls = 200;
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  for (std::uint64_t id = 1; id <= kBalls; ++id)
    world.add(dynamic_body(id, kSphereShape, {0.001 * static_cast<double>(id), 0, 10}));
  world.world().detect(kTick);
  std::map<BodyId, int> contacts;
  for (const ContactPair& pair : world.world().contacts()) {
    ++contacts[pair.a];
    ++contacts[pair.b];
  }
  ASSERT_EQ(contacts.size(), kBalls);
  for (const auto& [body, count] : contacts) {
    EXPECT_GE(count, 64) << body.value;
    EXPECT_LT(count, 199) << body.value;
  }
}

TEST(EngineTest, OnePrecisionAProcess) {
  const auto engine = test_engine(test_settings());
  EngineSettings other = test_settings();
  other.precision = test_precision == Precision::kFloat32 ? Precision::kFloat64 : Precision::kFloat32;
  EXPECT_EQ(load_engine(other).status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace tessera::engine_tests
