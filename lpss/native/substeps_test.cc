// Substeps by need: what asks for more stands, and an island gets the same whatever else is solved with it.
#include <gtest/gtest.h>

#include <initializer_list>

#include "lpss/engine/test_world.h"

namespace tessera::native {
namespace {

using namespace engine_tests;  // the worlds of the tests

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

TEST(SubstepsTest, AnIslandIsSolvedTheSameInAnyCompany) {
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

TEST(SubstepsTest, AHeavyBoxStandsOnALightOne) {
  for (const double ratio : {1e3, 1e5, 1e6}) {
    const auto engine = test_engine(test_settings());
    TestWorld world(*engine);
    world.add(static_body(1, kFloorShape, {0, 0, -1}));
    add_stack(world, 10, 0, {1, ratio});
    for (int i = 0; i < 300; ++i) world.step();
    EXPECT_NEAR(world.height(11), 1.5, 0.05) << ratio;
  }
}

TEST(SubstepsTest, HeavyAndLightBoxesStandInTurns) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(static_body(1, kFloorShape, {0, 0, -1}));
  add_stack(world, 10, 0, {1, 100, 1, 100, 1, 100, 1, 100, 1, 100});
  for (int i = 0; i < 600; ++i) world.step();
  EXPECT_NEAR(world.height(19), 9.5, 0.05);
}

}  // namespace
}  // namespace tessera::native
