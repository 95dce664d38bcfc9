// Substeps by need: what contacts remember, and that an island gets the same whatever else is solved with it.
#include "lpss/native/contact_needs.h"

#include <gtest/gtest.h>

#include <initializer_list>

#include "lpss/bullet/test_world.h"

namespace tessera::native {
namespace {

using namespace bullet;  // the worlds of the tests

constexpr double kWeight = 9.81 / 60;  // N s, of 1 kg in a tick

constexpr double kFast = 1;  // m/s

int after(const ContactNeeds& needs, std::initializer_list<double> impulses, double inverse_mass = 1) {
  ContactNeed need;
  for (const double impulse : impulses) needs.note(need, impulse, inverse_mass);
  return needs.substeps(need, /*rests_on=*/0, kFast);
}

TEST(ContactNeedsTest, GrowWithTheLoadFromHalfTheUsualOn) {
  const ContactNeeds needs{WorldSettings{}};
  int last = 0;
  for (double load = 1; load < 1e9; load *= 2) {
    const int substeps = after(needs, {load * kWeight, load * kWeight, load * kWeight});
    EXPECT_GE(substeps, last);
    EXPECT_GE(substeps, 2);
    EXPECT_LE(substeps, 64);
    last = substeps;
  }
  EXPECT_EQ(last, 64);
  EXPECT_EQ(needs.least(), 2);
  EXPECT_EQ(after(needs, {kWeight, kWeight, kWeight}), 2);
  EXPECT_EQ(after(needs, {kWeight, 10 * kWeight, 10 * kWeight}), 4);
  EXPECT_EQ(after(needs, {kWeight, 10 * kWeight, 10 * kWeight}, 1000), 64)
      << "by the weight of the lighter body";
}

TEST(ContactNeedsTest, AreTheUsualUntilThreeTicksAreKnown) {
  const ContactNeeds needs{WorldSettings{}};
  EXPECT_EQ(after(needs, {}), 4);
  EXPECT_EQ(after(needs, {kWeight, kWeight}), 4);
  EXPECT_EQ(after(needs, {1000 * kWeight, 1000 * kWeight}), 4);
}

TEST(ContactNeedsTest, AreMoreForBodiesThatWerePlacedOnEachOther) {
  const ContactNeeds needs{WorldSettings{}};
  ContactNeed need;
  EXPECT_EQ(needs.substeps(need, 0, 0), 8);
  for (int tick = 0; tick < 3; ++tick) needs.note(need, kWeight, 1);
  EXPECT_EQ(needs.substeps(need, 0, 0), 2);
}

TEST(ContactNeedsTest, AnImpactIsNoLoad) {
  const ContactNeeds needs{WorldSettings{}};
  EXPECT_EQ(after(needs, {kWeight, kWeight, kWeight, 1000 * kWeight, kWeight}), 2);
  EXPECT_GT(after(needs, {kWeight, kWeight, 1000 * kWeight, 1000 * kWeight}), 4);
}

TEST(ContactNeedsTest, DoNotFlicker) {
  const ContactNeeds needs{WorldSettings{}};
  ContactNeed need;
  for (int tick = 0; tick < 10; ++tick) {
    needs.note(need, (tick % 2 == 0 ? 20.9 : 21.1) * kWeight, 1);
    needs.note(need, (tick % 2 == 0 ? 20.9 : 21.1) * kWeight, 1);
    if (tick < 2) continue;
    EXPECT_EQ(needs.substeps(need, 0, kFast), 8) << tick;
  }
  needs.note(need, 15 * kWeight, 1);
  EXPECT_EQ(needs.substeps(need, 0, kFast), 4);
}

TEST(ContactNeedsTest, GrowWithWhatRestsOnALighterBody) {
  const ContactNeeds needs{WorldSettings{}};
  EXPECT_EQ(needs.substeps({}, 10, kFast), 4);
  EXPECT_EQ(needs.substeps({}, 1000, kFast), 32);
  EXPECT_EQ(needs.substeps({kWeight, 3, 2}, 1, kFast), 2);
}

TEST(ContactNeedsTest, GrowWithWhatBodiesFallInATick) {
  WorldSettings settings;
  settings.time_step = 1.0 / 15;
  const ContactNeeds needs(settings);
  EXPECT_EQ(after(needs, {40 * kWeight, 40 * kWeight, 40 * kWeight}), 16)
      << "a load of nine, in four times the time";
  settings.time_step = 1e-3;
  EXPECT_EQ(after(ContactNeeds(settings), {10 * 9.81e-3, 10 * 9.81e-3, 10 * 9.81e-3}), 4);
}

TEST(ContactNeedsTest, GrowWithTheTurnOfJointedBodies) {
  const ContactNeeds needs{WorldSettings{}};
  EXPECT_EQ(needs.for_turn(0), 4);
  EXPECT_EQ(needs.for_turn(0.5), 4);
  EXPECT_EQ(needs.for_turn(0.6), 8);
  EXPECT_EQ(needs.for_turn(1.5), 16);
  EXPECT_EQ(needs.for_turn(1e9), 64);
}

TEST(ContactNeedsTest, StayTheUsualWithoutAdaption) {
  WorldSettings settings;
  settings.adapt = false;
  const ContactNeeds needs(settings);
  EXPECT_EQ(needs.least(), 4);
  EXPECT_EQ(after(needs, {100 * kWeight, 100 * kWeight, 100 * kWeight}), 4);
  EXPECT_EQ(needs.for_turn(1), 4);
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

TEST(ContactNeedsTest, AnIslandIsSolvedTheSameInAnyCompany) {
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

TEST(ContactNeedsTest, AHeavyBoxStandsOnALightOne) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(static_body(1, kFloorShape, {0, 0, -1}));
  add_stack(world, 10, 0, {1, 1000});
  for (int i = 0; i < 300; ++i) world.step();
  EXPECT_NEAR(world.height(11), 1.5, 0.05);
}

}  // namespace
}  // namespace tessera::native
