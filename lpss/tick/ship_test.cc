// A part of an island travels to another server, and what comes back is what one process computes.
#include "lpss/tick/ship.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

WorldSettings heavy() {
  WorldSettings settings = test_settings();
  settings.gravity = UniformGravity{};
  return settings;
}

// A heap over the border, of which one box turns; one touches a kinematic box, one a static one.
void add_heap(TestWorld& world) {
  BodyRecord first = moving(box(1, kLow, kBeforeBorder), {2, 0.5, 0});
  first.state.angular_velocity = {0, 1, 0};
  world.add(first);
  world.add(box(2, kHigh, kBehindBorder));
  world.add(moving(box(3, kHigh, kBehindBorder + Eigen::Vector3d(0.5, 0, 0.984375)), {-1, 0, -1}));
  world.add(moving(box(4, kHigh, kBehindBorder + Eigen::Vector3d(0, 0, -0.984375), Motion::kKinematic),
                   {0, 0.25, 0}));
  world.add(box(5, kHigh, kBehindBorder + Eigen::Vector3d(0.984375, 0, 0), Motion::kStatic));
}

TEST(Ship, WhatComesBackIsWhatOneProcessComputes) {
  TestWorld alone(1, heavy());
  TestWorld shared(2, heavy());
  for (TestWorld* world : {&alone, &shared}) {
    add_heap(*world);
    world->run_to_solved();
  }
  ASSERT_EQ(shared.contexts[0].counts.islands_shipped + shared.contexts[1].counts.islands_shipped, 1u);
  for (const std::uint64_t id : {1, 2, 3}) {
    EXPECT_EQ(bits(shared.state(id)), bits(alone.state(id))) << "body " << id;
  }
  EXPECT_NE(alone.state(1).linear_velocity[0], 2) << "it was solved";
  for (const SectorIndex& index : {kLow, kHigh}) {
    SectorWorld& here = *shared.sector(index).world;
    SectorWorld& there = *alone.sector(index).world;
    ASSERT_EQ(here.contacts().size(), there.contacts().size());
    for (std::size_t n = 0; n < here.contacts().size(); ++n) {
      EXPECT_EQ(here.export_manifold(n).points, there.export_manifold(n).points) << "with the same impulses";
    }
  }
}

TEST(Ship, AParcelHasBodiesThatCanBePushedAndTheirContacts) {
  TestWorld world(2);
  add_heap(world);
  world.exchange();
  world.detect();
  world.connect();
  const Sector& high = world.sector(kHigh);
  ASSERT_THAT(high.components, SizeIs(1));
  ShippedIsland parcel;
  ship_part(world[1], high, high.components[0], parcel);
  std::vector<std::uint64_t> ids;
  for (const ShippedBody& body : parcel.bodies) ids.push_back(body.id.value);
  EXPECT_THAT(ids, ElementsAre(2, 3));
  EXPECT_EQ(parcel.bodies[0].home, kHigh);
  ASSERT_THAT(parcel.pairs, SizeIs(high.world->contacts().size()));
  for (std::size_t n = 0; n < parcel.pairs.size(); ++n) EXPECT_FALSE(numbers_of_pair(parcel, n).empty());
  EXPECT_EQ(parcel.pairs.back().numbers_end, parcel.pair_numbers.size());
  parcel.pairs.back().numbers_end += 1;
  EXPECT_TRUE(numbers_of_pair(parcel, parcel.pairs.size() - 1).empty()) << "beyond the end";
}

TEST(Ship, AParcelHasTheJointsOfItsBodies) {
  TestWorld world(2);
  add_heap(world);
  world.add(hinge(1, 1, 2));
  world.add(hinge(2, 2, 3));
  world.add(hinge(3, 3, 1));
  world.exchange();
  world.detect();
  world.connect();
  const Sector& high = world.sector(kHigh);
  ShippedIsland parcel;
  ship_part(world[1], high, high.components[0], parcel);
  std::vector<std::uint64_t> ids;
  for (const JointRecord& joint : parcel.joints) ids.push_back(joint.id.value);
  EXPECT_THAT(ids, ElementsAre(1, 2)) << "and not the one whose child lives elsewhere";
}

TEST(ShipDeathTest, ASolutionOfAStrangerStopsTheProcess) {
  EXPECT_DEATH(take_solution({}, {{{BodyId{7}, {}, {}}}, {}}), "of an island that was shipped");
}

}  // namespace
}  // namespace tessera
