// A body alone in its world: it needs neither a solver nor what finds pairs, and must not notice that.

#include <gtest/gtest.h>

#include <cmath>

#include "lpss/engine/test_world.h"

namespace tessera::engine_tests {
namespace {

BodyRecord tumbling(std::uint64_t id, ShapeId shape) {
  BodyRecord record = dynamic_body(id, shape, {1, 2, 3});
  record.properties.inertia = {0.2, 0.3, 0.15};
  record.state.linear_velocity = {1.3, -0.7, 4.1};
  record.state.angular_velocity = {2.1, 0.4, -3.3};
  return record;
}

// A step without a solver.
void fly(TestWorld& world, std::uint64_t id) {
  world.world().detect(kTick);
  world.world().fly(world.slot(id), kTick);
  world.world().integrate(kTick);
}

TEST(LoneTest, CoastsAsTheSolverWouldHaveIt) {
  for (const bool is_damped : {false, true}) {
    const auto engine = test_engine(test_settings());
    for (ShapeId shape = 0; shape < kDynamicShapes; ++shape) {
      BodyRecord record = tumbling(10, shape);
      if (is_damped) {
        record.properties.linear_damping = 0.1;
        record.properties.angular_damping = 0.3;
      }
      TestWorld solved(*engine);
      TestWorld coasting(*engine);
      // With another body about, the engine looks for pairs.
      TestWorld in_company(*engine);
      in_company.add(static_body(1, kFloorShape, {0, 0, 500}));
      for (TestWorld* world : {&solved, &coasting, &in_company}) world->add(record);
      for (int i = 0; i < 200; ++i) {
        const Wrench wrench{{0.3 * i, -2, 1}, {0.01, 0.02 * (i % 7), -0.1}};
        for (TestWorld* world : {&solved, &coasting, &in_company}) {
          world->world().add_wrench(world->slot(10), wrench);
        }
        solved.step(kTick);
        fly(coasting, 10);
        fly(in_company, 10);
        ASSERT_EQ(solved.hash(), coasting.hash()) << "shape " << shape << " step " << i;
        ASSERT_EQ(solved.hash(), in_company.hash()) << "shape " << shape << " step " << i;
      }
    }
  }
}

TEST(LoneTest, CompanyThatComesAndGoesLeavesNoTrace) {
  const auto engine = test_engine(test_settings());
  TestWorld alone(*engine);
  TestWorld in_company(*engine);
  in_company.add(static_body(1, kFloorShape, {0, 0, 500}));
  for (TestWorld* world : {&alone, &in_company}) {
    world->add(dynamic_body(10, kBoxShape, {0, 0, 0}));
    world->run(20);
    BodyRecord visitor = dynamic_body(11, kSphereShape, {0.1, 0, world->height(10) + 1.3});
    visitor.state.linear_velocity[2] = -20;
    world->add(visitor);
    world->run(10);
  }
  EXPECT_NE(alone.state(10).angular_velocity, alone.state(11).angular_velocity);
  EXPECT_EQ(alone.hash(), in_company.hash());
  for (TestWorld* world : {&alone, &in_company}) {
    world->remove(11);
    world->run(20);
  }
  EXPECT_EQ(alone.hash(), in_company.hash());
}

TEST(LoneTest, IsFoundByQuestions) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(tumbling(10, kSphereShape));
  world.run(30);
  const Eigen::Vector3d place(world.state(10).position.data());
  const Eigen::Vector3d away(0, 3, 0);
  BodySlot hint = kNoSlot;
  EXPECT_TRUE(world.world().reaches_home_body({place, place + away}, hint));
  EXPECT_FALSE(world.world().reaches_home_body({place + away, place + 2 * away}, hint));
  const auto hit = world.world().raycast(place + away, place - away, {~0u});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->body, BodyId{10});
  EXPECT_EQ(world.world().near(Sphere{0.5}, {place + away, Eigen::Quaterniond::Identity()}, 5, {~0u}).size(),
            1u);
  const std::uint64_t before = world.hash();
  world.run(10);
  EXPECT_NE(world.hash(), before);
}

// A pull of 0.006 m/s^2 is less than the last digit that a float has for 30 km/s.
TEST(FineFlightTest, APullBelowTheLastDigitCounts) {
  EngineSettings settings = test_settings();
  settings.fine_flight = true;
  const auto engine = test_engine(settings);
  TestWorld world(*engine);
  BodyRecord record = dynamic_body(10, kSphereShape, {0, 0, 0});
  record.state.linear_velocity = {30000, 20000, 10000};
  world.add(record);
  world.world().set_gravity(world.slot(10), {0, 0, -0.006});
  constexpr int kSteps = 1000;
  constexpr double kStep = 0.02;
  for (int i = 0; i < kSteps; ++i) {
    BodyState state = world.state(10);
    state.position = {};
    world.world().set_state(world.slot(10), state);
    world.world().detect(kStep);
    world.world().fly(world.slot(10), kStep);
    world.world().integrate(kStep);
  }
  EXPECT_NEAR(world.state(10).linear_velocity[2], 10000 - 0.006 * kStep * kSteps, 1e-6);
  EXPECT_EQ(world.state(10).linear_velocity[0], 30000);
  EXPECT_NEAR(world.state(10).position[0], 30000 * kStep, 1e-9);
}

// What a solver has touched is what the engine's numbers can hold.
TEST(FineFlightTest, EndsWithAContact) {
  EngineSettings settings = test_settings();
  settings.fine_flight = true;
  const auto engine = test_engine(settings);
  TestWorld world(*engine);
  world.add(static_body(1, kFloorShape, {0, 0, -1}));
  world.add(dynamic_body(10, kSphereShape, {0, 0, 1.0 / 3}));
  EXPECT_EQ(world.height(10), 1.0 / 3);
  world.step();
  if (test_precision == Precision::kFloat32) {
    EXPECT_EQ(world.height(10), static_cast<float>(world.height(10)));
  }
}

}  // namespace
}  // namespace tessera::engine_tests
