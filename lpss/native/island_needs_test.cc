// Small steps by need: what a body carries, and that an island gets the same whatever else is solved with it.
#include "lpss/native/island_needs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <vector>

#include "lpss/bullet/test_world.h"

namespace tessera::native {
namespace {

using namespace bullet;  // the worlds of the tests

using ::testing::ElementsAre;

constexpr std::size_t kGround = ContactEdge::kGround;

TEST(BurdensTest, OfATowerAreWhatIsAbove) {
  const std::vector<ContactEdge> touches = {{0, 1}, {1, 2}, {kGround, 0}};
  EXPECT_THAT(load_ratios(std::vector<double>{1, 1, 1}, touches), ElementsAre(2, 1, 0));
  EXPECT_THAT(load_ratios(std::vector<double>{1, 2, 1000}, touches), ElementsAre(1002, 500, 0));
  EXPECT_THAT(load_ratios(std::vector<double>{1000, 2, 1}, touches), ElementsAre(0.003, 0.5, 0));
}

TEST(BurdensTest, AreSharedAmongThoseBelow) {
  EXPECT_THAT(load_ratios(std::vector<double>{1, 1, 8},
                          std::vector<ContactEdge>{{0, 2}, {1, 2}, {0, kGround}, {1, kGround}}),
              ElementsAre(4, 4, 0));
}

TEST(BurdensTest, NobodyCarriesWhatFloats) {
  EXPECT_THAT(load_ratios(std::vector<double>{1, 1000}, std::vector<ContactEdge>{{0, 1}}), ElementsAre(0, 0));
  EXPECT_TRUE(load_ratios({}, {}).empty());
}

TEST(StepsForTest, GrowWithTheBurdenFromHalfTheUsualOn) {
  EXPECT_EQ(steps_for(0, 4), 2);
  EXPECT_EQ(steps_for(9, 4), 4);
  int last = 0;
  for (double load_ratio = 0.1; load_ratio < 1e9; load_ratio *= 2) {
    const int steps = steps_for(load_ratio, 4);
    EXPECT_GE(steps, last);
    EXPECT_GE(steps, 2);
    EXPECT_LE(steps, 64);
    last = steps;
  }
  EXPECT_GT(last, 4);
  EXPECT_GE(steps_for(0, 2), 2);
  EXPECT_EQ(steps_for(1e9, 64), 64);
}

TEST(StepsForTest, GrowWithWhatABodyFallsInATick) {
  EXPECT_EQ(load_in_tick(9, 9.81 / 1e6), 9);
  EXPECT_EQ(load_in_tick(9, 9.81 / 3600), 9);
  EXPECT_DOUBLE_EQ(load_in_tick(9, 9.81 / 225), 9 * 16);
  EXPECT_EQ(steps_for(load_in_tick(9, 9.81 / 225), 4), 16);
}

void add_stack(TestWorld& world, std::uint64_t first, double x, std::initializer_list<double> masses) {
  double height = 0.5;
  for (const double mass : masses) {
    BodyRecord box = dynamic_body(first++, kBoxShape, {x, 0, height});
    box.properties.mass = mass;
    for (double& moment : box.properties.inertia) moment *= mass;
    world.add(box);
    height += 1;
  }
}

TEST(IslandNeedsTest, AnIslandIsSolvedTheSameInAnyCompany) {
  const auto engine = test_engine(test_settings());
  TestWorld alone(*engine);
  TestWorld in_company(*engine);
  for (TestWorld* world : {&alone, &in_company}) {
    world->add(static_body(1, kFloorShape, {0, 0, -1}));
    add_stack(*world, 20, 0, {1, 2, 1, 3});
  }
  add_stack(in_company, 10, -5, {1});
  add_stack(in_company, 40, 5, {1, 1000});
  in_company.add(dynamic_body(50, kSphereShape, {10, 0, 20}));
  for (int i = 0; i < 120; ++i) {
    alone.step();
    in_company.step();
    for (std::uint64_t id = 20; id < 24; ++id) {
      ASSERT_EQ(hash_of(alone.state(id), 1), hash_of(in_company.state(id), 1))
          << "box " << id << " step " << i;
    }
  }
}

TEST(IslandNeedsTest, WhatTurnsFarTakesMoreSteps) {
  EXPECT_EQ(steps_for_turn(0, 4), 4);
  EXPECT_EQ(steps_for_turn(0.5, 4), 4);
  EXPECT_EQ(steps_for_turn(0.6, 4), 8);
  EXPECT_EQ(steps_for_turn(1.5, 4), 16);
  EXPECT_EQ(steps_for_turn(1e9, 4), 64);
}

TEST(IslandNeedsTest, AHeavyBoxStandsOnALightOne) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(static_body(1, kFloorShape, {0, 0, -1}));
  add_stack(world, 10, 0, {1, 1000});
  for (int i = 0; i < 300; ++i) world.step();
  EXPECT_NEAR(world.height(11), 1.5, 0.05);
}

}  // namespace
}  // namespace tessera::native
