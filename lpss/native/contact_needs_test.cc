// Substeps by need: what contacts remember, and that an island gets the same whatever else is solved with it.
#include "lpss/native/contact_needs.h"

#include <gtest/gtest.h>

#include <initializer_list>

#include "lpss/bullet/test_world.h"

namespace tessera::native {
namespace {

using namespace bullet;  // the worlds of the tests

constexpr double kWeight = 9.81 / 60;  // N s, of 1 kg in a tick

ContactScale scale(double inverse_mass = 1, double extent = 1, double rests_on = 0, bool is_at_rest = false) {
  return {inverse_mass, extent, rests_on, is_at_rest};
}

int after(const ContactNeeds& needs, std::initializer_list<double> impulses, ContactScale of = scale()) {
  ContactNeed need;
  for (const double impulse : impulses) needs.note(need, impulse, of);
  return needs.substeps(need, of);
}

TEST(ContactNeedsTest, GrowWithTheLoadFromHalfTheUsualOn) {
  const ContactNeeds needs{WorldSettings{}};
  int last = 0;
  for (double load = 1; load < 1e9; load *= 2) {
    const int substeps = after(needs, {load * kWeight, load * kWeight, load * kWeight});
    EXPECT_GE(substeps, last);
    EXPECT_GE(substeps, 2);
    EXPECT_LE(substeps, 1024);
    last = substeps;
  }
  EXPECT_EQ(last, 1024);
  EXPECT_EQ(needs.least(), 2);
  EXPECT_EQ(after(needs, {kWeight, kWeight, kWeight}), 2);
  EXPECT_EQ(after(needs, {kWeight, 10 * kWeight, 10 * kWeight}), 4);
  EXPECT_EQ(after(needs, {kWeight, 10 * kWeight, 10 * kWeight}, scale(1000)), 128)
      << "by the weight of the lighter body";
}

TEST(ContactNeedsTest, AreFewUntilThreeTicksAreKnown) {
  const ContactNeeds needs{WorldSettings{}};
  EXPECT_EQ(after(needs, {}), 2);
  EXPECT_EQ(after(needs, {kWeight, kWeight}), 2);
  EXPECT_EQ(after(needs, {1000 * kWeight, 1000 * kWeight}), 2);
  EXPECT_EQ(after(needs, {1000 * kWeight, 1000 * kWeight, 1000 * kWeight}), 32);
}

TEST(ContactNeedsTest, AreMoreFromTheStartForWhatPressesHard) {
  const ContactNeeds needs{WorldSettings{}};
  constexpr double kFall = 9.81 / (60 * 60);  // m, in a tick
  ContactScale pressed = scale(1, 1);
  EXPECT_EQ(needs.substeps({}, pressed), 2);
  pressed.pressed = 500 * kFall;
  EXPECT_EQ(needs.substeps({}, pressed), 32);
  pressed.extent = 0.05;
  EXPECT_EQ(needs.substeps({}, pressed), 64) << "what is small must give way less";
  WorldSettings floating;
  floating.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  EXPECT_EQ(ContactNeeds(floating).substeps({}, pressed), 64) << "without gravity, too";
  ContactNeed known;
  for (int tick = 0; tick < 3; ++tick) needs.note(known, kWeight, pressed);
  EXPECT_EQ(needs.substeps(known, pressed), 2) << "what it bears says more";
}

TEST(ContactNeedsTest, AreMoreForBodiesThatWerePlacedOnEachOther) {
  const ContactNeeds needs{WorldSettings{}};
  ContactNeed need;
  EXPECT_EQ(needs.substeps(need, scale(1, 1, 0, true)), 8);
  for (int tick = 0; tick < 3; ++tick) needs.note(need, kWeight, scale());
  EXPECT_EQ(needs.substeps(need, scale(1, 1, 0, true)), 2);
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
    needs.note(need, (tick % 2 == 0 ? 20.9 : 21.1) * kWeight, scale());
    needs.note(need, (tick % 2 == 0 ? 20.9 : 21.1) * kWeight, scale());
    if (tick < 2) continue;
    EXPECT_EQ(needs.substeps(need, scale()), 8) << tick;
  }
  needs.note(need, 5 * kWeight, scale());
  EXPECT_EQ(needs.substeps(need, scale()), 4);
}

TEST(ContactNeedsTest, GrowWithNimblenessFromTheFirstTickOn) {
  const ContactNeeds needs{WorldSettings{}};
  ContactScale nimble = scale();
  nimble.nimbleness = 667;
  EXPECT_EQ(after(needs, {}, nimble), 32);
  EXPECT_EQ(after(needs, {kWeight, kWeight, kWeight}, nimble), 32);
}

TEST(ContactNeedsTest, GrowWithWhatRestsOnALighterBody) {
  const ContactNeeds needs{WorldSettings{}};
  EXPECT_EQ(needs.substeps({}, scale(1, 1, 10)), 4);
  EXPECT_EQ(needs.substeps({}, scale(1, 1, 1000)), 64);
  EXPECT_EQ(needs.substeps({kWeight, 2, 3}, scale(1, 1, 1)), 2);
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

// A link of 1 kg, 1 m long, on which so much hangs.
TEST(ContactNeedsTest, GrowWithWhatHangsOnALink) {
  const ContactNeeds needs{WorldSettings{}};
  const auto bears = [&](double mass) { return needs.for_pull(mass, /*lever=*/0.5, /*mobility=*/12); };
  EXPECT_EQ(bears(1), 4);
  EXPECT_EQ(bears(1e3), 8);
  EXPECT_EQ(bears(1e5), 64);
  EXPECT_EQ(bears(1e6), 128);
  EXPECT_EQ(bears(1e9), 1024);
}

TEST(ContactNeedsTest, GrowWithTheSmallnessOfWhatMustKeepItsPlace) {
  const ContactNeeds needs{WorldSettings{}};
  const auto on_floor = [&](double load, double extent) {
    const double impulse = (1 + load) * kWeight;
    return after(needs, {impulse, impulse, impulse}, scale(1, extent));
  };
  EXPECT_EQ(on_floor(0, 1), 2);
  EXPECT_EQ(on_floor(0, 0.01), 4);
  EXPECT_EQ(on_floor(9, 0.01), 16);
  EXPECT_EQ(on_floor(0, 0.001), 16);
  EXPECT_EQ(on_floor(1e9, 0.001), 1024);
}

TEST(ContactNeedsTest, OfIslandsOfFewBodiesMayBeMany) {
  const ContactNeeds needs{WorldSettings{}};
  EXPECT_EQ(needs.granted(1024, 1), 1024);
  EXPECT_EQ(needs.granted(1024, 128), 128);
  EXPECT_EQ(needs.granted(1024, 100'000), 64);
  EXPECT_EQ(needs.granted(2, 100'000), 2);
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
  for (const double ratio : {1e3, 1e5, 1e6}) {
    const auto engine = test_engine(test_settings());
    TestWorld world(*engine);
    world.add(static_body(1, kFloorShape, {0, 0, -1}));
    add_stack(world, 10, 0, {1, ratio});
    for (int i = 0; i < 300; ++i) world.step();
    EXPECT_NEAR(world.height(11), 1.5, 0.05) << ratio;
  }
}

TEST(ContactNeedsTest, HeavyAndLightBoxesStandInTurns) {
  const auto engine = test_engine(test_settings());
  TestWorld world(*engine);
  world.add(static_body(1, kFloorShape, {0, 0, -1}));
  add_stack(world, 10, 0, {1, 100, 1, 100, 1, 100, 1, 100, 1, 100});
  for (int i = 0; i < 600; ++i) world.step();
  EXPECT_NEAR(world.height(19), 9.5, 0.05);
}

}  // namespace
}  // namespace tessera::native
