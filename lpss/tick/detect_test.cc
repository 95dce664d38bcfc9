// Sectors in which something is awake find their contacts, near their own origins.
#include "lpss/tick/detect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/model/gravity.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;

TEST(Detect, OnlySectorsInWhichSomethingIsAwakeTakePart) {
  TestPartition partition;
  add_body(*partition, box(1, kHigh, {0, 0, 0}));
  add_body(*partition, in_state(box(2, {5, 0, 0}, {0, 0, 0}), Activity::kAsleep));
  add_body(*partition, box(3, kLow, {0, 0, 0}));
  EXPECT_THAT(detect(*partition, {}), ElementsAre(&sector(*partition, kHigh), &sector(*partition, kLow)));
  EXPECT_TRUE(sector(*partition, kLow).awake);
  EXPECT_FALSE(sector(*partition, {5, 0, 0}).awake);
}

TEST(Detect, FindsAContactOverABorderInTheLowerSectorOnly) {
  TestWorld world;
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
  world.exchange();
  world.detect();
  const std::span<const ContactPair> pairs = world.sector(kLow).world->contacts();
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].a, BodyId{1});
  EXPECT_EQ(pairs[0].b, BodyId{2});
  EXPECT_TRUE(world.sector(kHigh).world->contacts().empty());
  EXPECT_EQ(world[0].clone_count, 1u);
}

TEST(Detect, APlanetPullsEachBodyFromWhereItIs) {
  WorldSettings settings = test_settings();
  settings.gravity = CentralGravity{{{0, 0, -1000}, {0, 0, 0}}, 9.81, 10000};
  TestPartition partition(settings);
  add_body(*partition, box(1, kHigh, {0, 0, 0}));
  put(*partition, 1, {7, 0, 0});
  detect(*partition, {});
  const Sector& high = sector(*partition, kHigh);
  const Wrench pull = high.world->total_wrench(body(*partition, 1).slot);
  const Eigen::Vector3d expected = acceleration_at(settings.gravity, kHigh, {7, 0, 0}, 16);
  ASSERT_LT(expected.x(), 0);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(static_cast<float>(pull.force[axis]), static_cast<float>(expected[axis]));
  }
}

}  // namespace
}  // namespace tessera
