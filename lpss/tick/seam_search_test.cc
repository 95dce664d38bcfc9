// Which sectors need a replica of which body.
#include "lpss/tick/seam_search.h"

#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

OffsetSet only(int i) {
  OffsetSet set;
  set.insert(i, 0, 0);
  return set;
}

TEST(SeamSearch, DynamicBodiesAreWantedBelowABorderAndKinematicOnesOnBothSides) {
  TestPartition partition;
  add_body(*partition, box(1, kLow, {7, 0, 0}));
  add_body(*partition, box(2, kHigh, {-7, 0, 0}));
  add_body(*partition, box(3, kHigh, {0, 0, 0}));
  add_body(*partition, box(4, kLow, {7, 4, 0}, Motion::kKinematic));
  attend_borders(*partition);
  search_seams(*partition);
  EXPECT_EQ(body(*partition, 1).wanted_in, OffsetSet{});
  EXPECT_EQ(body(*partition, 2).wanted_in, only(-1));
  EXPECT_EQ(body(*partition, 3).wanted_in, OffsetSet{});
  EXPECT_EQ(body(*partition, 4).wanted_in, only(1));
}

TEST(SeamSearch, LooksAsFarAsABodyGoesInATick) {
  TestPartition partition;
  add_body(*partition, moving(box(1, kHigh, {0, 0, 0}), {-64 * 6, 0, 0}));
  attend_borders(*partition);
  search_seams(*partition);
  EXPECT_TRUE(body(*partition, 1).wanted_in.contains(-1, 0, 0));
  EXPECT_TRUE(body(*partition, 1).wanted_in.contains(-1, 1, 0)) << "where one may live that meets it";
  EXPECT_FALSE(body(*partition, 1).wanted_in.contains(1, 0, 0));
  EXPECT_LE(body(*partition, 1).swept.min().x(), -6.5);
}

TEST(SeamSearch, ASleepingBodyIsNotLookedAtUnlessItChanged) {
  TestPartition partition;
  add_body(*partition, in_state(box(1, kHigh, {-7, 0, 0}), Activity::kAsleep));
  body(*partition, 1).dirty = false;
  attend_borders(*partition);
  search_seams(*partition);
  EXPECT_EQ(body(*partition, 1).wanted_in, OffsetSet{});
  mark_dirty(body(*partition, 1));
  attend_borders(*partition);
  search_seams(*partition);
  EXPECT_EQ(body(*partition, 1).wanted_in, only(-1));
}

// A row of three boxes, of which the first is near the border: cloned as deep as the setting says.
TEST(SeamSearch, UnderThePolicyCloneADeeperCloneTakesAlongWhatItTouches) {
  for (int depth = 0; depth <= 3; ++depth) {
    TestWorld world(1, clone_settings(depth));
    world.add(box(1, kLow, {5.75, 0, 0}));
    world.add(box(2, kLow, {4.765625, 0, 0}));
    world.add(box(3, kLow, {3.78125, 0, 0}));
    world.detect();
    attend_borders(world[0]);
    search_seams(world[0]);
    for (int n = 1; n <= 3; ++n) {
      EXPECT_EQ(body(world[0], n).wanted_in, n <= depth ? only(1) : OffsetSet{}) << n << " of " << depth;
    }
  }
}

}  // namespace
}  // namespace tessera
