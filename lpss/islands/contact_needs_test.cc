// Substeps by need: what contacts remember.
#include "lpss/islands/contact_needs.h"

#include <gtest/gtest.h>

#include <initializer_list>

namespace tessera {
namespace {

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
  const ContactNeeds needs{Substepping{}};
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
  const ContactNeeds needs{Substepping{}};
  EXPECT_EQ(after(needs, {}), 2);
  EXPECT_EQ(after(needs, {kWeight, kWeight}), 2);
  EXPECT_EQ(after(needs, {1000 * kWeight, 1000 * kWeight}), 2);
  EXPECT_EQ(after(needs, {1000 * kWeight, 1000 * kWeight, 1000 * kWeight}), 32);
}

TEST(ContactNeedsTest, AreMoreFromTheStartForWhatPressesHard) {
  const ContactNeeds needs{Substepping{}};
  constexpr double kFall = 9.81 / (60 * 60);  // m, in a tick
  ContactScale pressed = scale(1, 1);
  EXPECT_EQ(needs.substeps({}, pressed), 2);
  pressed.pressed = 500 * kFall;
  EXPECT_EQ(needs.substeps({}, pressed), 32);
  pressed.extent = 0.05;
  EXPECT_EQ(needs.substeps({}, pressed), 64) << "what is small must give way less";
  EXPECT_EQ(ContactNeeds(Substepping{.gravity = 0}).substeps({}, pressed), 64) << "without gravity, too";
  ContactNeed known;
  for (int tick = 0; tick < 3; ++tick) needs.note(known, kWeight, pressed);
  EXPECT_EQ(needs.substeps(known, pressed), 2) << "what it bears says more";
}

TEST(ContactNeedsTest, AreMoreForBodiesThatWerePlacedOnEachOther) {
  const ContactNeeds needs{Substepping{}};
  ContactNeed need;
  EXPECT_EQ(needs.substeps(need, scale(1, 1, 0, true)), 8);
  for (int tick = 0; tick < 3; ++tick) needs.note(need, kWeight, scale());
  EXPECT_EQ(needs.substeps(need, scale(1, 1, 0, true)), 2);
}

TEST(ContactNeedsTest, AnImpactIsNoLoad) {
  const ContactNeeds needs{Substepping{}};
  EXPECT_EQ(after(needs, {kWeight, kWeight, kWeight, 1000 * kWeight, kWeight}), 2);
  EXPECT_GT(after(needs, {kWeight, kWeight, 1000 * kWeight, 1000 * kWeight}), 4);
}

TEST(ContactNeedsTest, DoNotFlicker) {
  const ContactNeeds needs{Substepping{}};
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
  const ContactNeeds needs{Substepping{}};
  ContactScale nimble = scale();
  nimble.nimbleness = 667;
  EXPECT_EQ(after(needs, {}, nimble), 32);
  EXPECT_EQ(after(needs, {kWeight, kWeight, kWeight}, nimble), 32);
}

TEST(ContactNeedsTest, GrowWithWhatRestsOnALighterBody) {
  const ContactNeeds needs{Substepping{}};
  EXPECT_EQ(needs.substeps({}, scale(1, 1, 10)), 4);
  EXPECT_EQ(needs.substeps({}, scale(1, 1, 1000)), 64);
  EXPECT_EQ(needs.substeps({kWeight, 2, 3}, scale(1, 1, 1)), 2);
}

TEST(ContactNeedsTest, GrowWithWhatBodiesFallInATick) {
  const ContactNeeds needs(Substepping{.time_step = 1.0 / 15});
  EXPECT_EQ(after(needs, {40 * kWeight, 40 * kWeight, 40 * kWeight}), 16)
      << "a load of nine, in four times the time";
  EXPECT_EQ(after(ContactNeeds(Substepping{.time_step = 1e-3}), {10 * 9.81e-3, 10 * 9.81e-3, 10 * 9.81e-3}),
            4);
}

TEST(ContactNeedsTest, GrowWithTheTurnOfJointedBodies) {
  const ContactNeeds needs{Substepping{}};
  EXPECT_EQ(needs.for_turn(0), 4);
  EXPECT_EQ(needs.for_turn(0.5), 4);
  EXPECT_EQ(needs.for_turn(0.6), 8);
  EXPECT_EQ(needs.for_turn(1.5), 16);
  EXPECT_EQ(needs.for_turn(1e9), 64);
}

// A link of 1 kg, 1 m long, on which so much hangs.
TEST(ContactNeedsTest, GrowWithWhatHangsOnALink) {
  const ContactNeeds needs{Substepping{}};
  const auto bears = [&](double mass) { return needs.for_pull(mass, /*lever=*/0.5, /*mobility=*/12); };
  EXPECT_EQ(bears(1), 4);
  EXPECT_EQ(bears(1e3), 8);
  EXPECT_EQ(bears(1e5), 64);
  EXPECT_EQ(bears(1e6), 128);
  EXPECT_EQ(bears(1e9), 1024);
}

TEST(ContactNeedsTest, GrowWithTheSmallnessOfWhatMustKeepItsPlace) {
  const ContactNeeds needs{Substepping{}};
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
  const ContactNeeds needs{Substepping{}};
  EXPECT_EQ(needs.granted(1024, 1), 1024);
  EXPECT_EQ(needs.granted(1024, 128), 128);
  EXPECT_EQ(needs.granted(1024, 100'000), 64);
  EXPECT_EQ(needs.granted(2, 100'000), 2);
}

TEST(ContactNeedsTest, StayTheUsualWithoutAdaption) {
  const ContactNeeds needs(Substepping{.adapts = false});
  EXPECT_EQ(needs.least(), 4);
  EXPECT_EQ(after(needs, {100 * kWeight, 100 * kWeight, 100 * kWeight}), 4);
  EXPECT_EQ(needs.for_turn(1), 4);
}

}  // namespace
}  // namespace tessera
