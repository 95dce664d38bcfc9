// What contacts and joints connect in a sector, and what of it reaches over a border.
#include "lpss/tick/components.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::IsEmpty;

// The bodies of each component that live in the sector.
std::vector<std::vector<std::uint64_t>> bodies_of_components(const Sector& sector) {
  std::vector<std::vector<std::uint64_t>> result;
  for (const Component& component : sector.components) {
    std::vector<std::uint64_t>& ids = result.emplace_back();
    for (std::uint32_t i = component.bodies_begin; i < component.bodies_end; ++i) {
      ids.push_back(sector.component_bodies[i]->id.value);
    }
  }
  return result;
}

// The same of clones.
std::vector<std::vector<BodyId>> clones_of_components(const Sector& sector) {
  std::vector<std::vector<BodyId>> result;
  for (const Component& component : sector.components) {
    std::vector<BodyId>& ids = result.emplace_back();
    for (std::uint32_t i = component.clones_begin; i < component.clones_end; ++i) {
      ids.push_back(sector.component_clones[i]->replica->id);
    }
  }
  return result;
}

TEST(Components, BoxesThatTouchAreOneInTheOrderOfTheirSmallestBodies) {
  TestWorld world;
  world.add(box(3, kHigh, {0, 0, 0}));
  world.add(box(1, kHigh, {0, 0, 0.984375}));
  world.add(box(2, kHigh, {5, 0, 0}));
  world.exchange();
  world.detect();
  world.connect();
  EXPECT_THAT(bodies_of_components(world.sector(kHigh)), ElementsAre(ElementsAre(1, 3), ElementsAre(2)));
  EXPECT_EQ(world.sector(kHigh).components[0].part, Component::kInterior);
  EXPECT_THAT(world.seams[0].sectors, IsEmpty());
}

TEST(Components, AStaticBodyConnectsNothing) {
  TestWorld world;
  world.add(box(1, kHigh, {-0.45, 0, 0.984375}));
  world.add(box(2, kHigh, {0.6, 0, 0.984375}));
  world.add(box(3, kHigh, {0, 0, 0}, Motion::kStatic));
  world.exchange();
  world.detect();
  ASSERT_EQ(world.sector(kHigh).world->contacts().size(), 2u);
  world.connect();
  EXPECT_THAT(bodies_of_components(world.sector(kHigh)), ElementsAre(ElementsAre(1), ElementsAre(2)));
}

TEST(Components, OverABorderBothSidesNameTheBodyThatIsCloned) {
  TestWorld world(2);
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
  world.exchange();
  world.detect();
  world.connect();
  ASSERT_EQ(world.seams[0].sectors.size(), 1u);
  ASSERT_EQ(world.seams[1].sectors.size(), 1u);
  const std::vector<IslandPart>& low = world.seams[0].sectors[0].parts;
  const std::vector<IslandPart>& high = world.seams[1].sectors[0].parts;
  ASSERT_EQ(low.size(), 1u);
  ASSERT_EQ(high.size(), 1u);
  EXPECT_THAT(low[0].shared, ElementsAre(BodyId{2}));
  EXPECT_THAT(high[0].shared, ElementsAre(BodyId{2}));
  EXPECT_EQ(low[0].first, BodyId{1});
  EXPECT_EQ(low[0].contacts, 1u);
  EXPECT_EQ(high[0].first, BodyId{2});
  EXPECT_EQ(high[0].contacts, 0u);
}

TEST(Components, AJointConnectsInASectorAndOverABorderByBothNames) {
  TestWorld world(2);
  world.add(box(1, kLow, {0, 0, 0}));
  world.add(box(2, kLow, {1, 0, 0}));
  world.add(box(3, kHigh, {0, 0, 0}));
  world.add(hinge(1, 1, 2));
  world.add(hinge(2, 2, 3));
  world.exchange();
  world.detect();
  world.connect();
  EXPECT_THAT(bodies_of_components(world.sector(kLow)), ElementsAre(ElementsAre(1, 2)));
  EXPECT_THAT(world.seams[0].sectors.at(0).parts.at(0).shared, ElementsAre(BodyId{2}, BodyId{3}));
  EXPECT_THAT(world.seams[1].sectors.at(0).parts.at(0).shared, ElementsAre(BodyId{2}, BodyId{3}));
}

TEST(Components, ASectorSaysOnceThatNothingReachesOverItsBorderAnyLonger) {
  TestWorld world(2);
  world.add(box(1, kHigh, kBehindBorder));
  const auto said = [&] {
    world.exchange();
    world.detect();
    world.connect();
    return world.seams[1].sectors;
  };
  EXPECT_EQ(said().at(0).parts.size(), 1u);
  put(world[1], 1, {0, 0, 0});
  EXPECT_THAT(said().at(0).parts, IsEmpty());
  EXPECT_THAT(said(), IsEmpty());
  world.contexts[1].vacated.sectors = {kHigh};
  EXPECT_EQ(said().at(0).sector, kHigh);
}

TEST(Components, WhatAKinematicBodyOnItsWayTouchesStaysAwake) {
  for (const Activity pusher : {Activity::kAwake, Activity::kAsleep}) {
    TestWorld world;
    world.add(in_state(box(1, kHigh, {0, 0, 0}), Activity::kWantsSleep));
    world.add(in_state(box(2, kHigh, {0, 0, -0.984375}, Motion::kKinematic), pusher));
    world.exchange();
    world.detect();
    world.connect();
    const Sector& high = world.sector(kHigh);
    ASSERT_EQ(high.components.size(), 1u);
    EXPECT_EQ(high.components[0].all_want_sleep, pusher == Activity::kAsleep);
  }
}

TEST(Components, UnderThePolicyCloneNothingReachesOverABorder) {
  TestWorld world(2, clone_settings());
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
  world.exchange();
  world.detect();
  world.connect();
  for (const Rank rank : {0, 1}) {
    const Sector& sector = world.sector(rank == 0 ? kLow : kHigh);
    EXPECT_THAT(clones_of_components(sector), ElementsAre(ElementsAre(BodyId{rank == 0 ? 2u : 1u})));
    EXPECT_EQ(sector.components.at(0).part, Component::kInterior);
    EXPECT_THAT(world.seams[rank].sectors, IsEmpty());
  }
}

TEST(Components, OnlyUnderThePolicyCloneAJointConnectsWithTheClone) {
  for (const bool clone : {false, true}) {
    TestWorld world(1, clone ? clone_settings() : test_settings());
    world.add(box(1, kLow, kBeforeBorder));
    world.add(box(2, kHigh, {-7.25, 0, 0}));
    world.add(hinge(1, 1, 2));
    world.exchange();
    world.detect();
    world.connect();
    const Sector& low = world.sector(kLow);
    ASSERT_EQ(low.placed.size(), 1u);
    ASSERT_THAT(low.world->contacts(), IsEmpty());
    EXPECT_THAT(clones_of_components(low).at(0),
                ElementsAreArray(clone ? std::vector{BodyId{2}} : std::vector<BodyId>{}));
  }
}

TEST(Components, UnderThePolicyCloneACloneThatIsAwakeKeepsAwakeWhatItTouches) {
  for (const bool clone : {false, true}) {
    TestWorld world(1, clone ? clone_settings() : test_settings());
    world.add(in_state(box(1, kLow, kBeforeBorder), Activity::kAsleep));
    world.add(box(2, kHigh, kBehindBorder));
    world.exchange();
    world.detect();
    world.connect();
    const Sector& low = world.sector(kLow);
    ASSERT_EQ(low.components.size(), 1u);
    EXPECT_THAT(clones_of_components(low), ElementsAre(ElementsAre(BodyId{2})));
    EXPECT_EQ(low.components[0].any_awake, clone);
    EXPECT_EQ(low.components[0].all_want_sleep, !clone);
  }
}

}  // namespace
}  // namespace tessera
