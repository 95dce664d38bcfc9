// What happens at seams, as those see it who watch.
#include "lpss/observe/seams.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

void run_to_planned(TestWorld& world) {
  world.exchange();
  world.detect();
  world.connect();
  world.plan();
}

TEST(Seams, ClonesAreThoseInEngineWorlds) {
  TestWorld world(2);
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder + Eigen::Vector3d(0, 4, 0)));
  world.add(box(3, kHigh, kBehindBorder));
  world.exchange();
  const std::vector<CloneAt> clones = clones_of(world[0]);
  ASSERT_EQ(clones.size(), 1u);
  EXPECT_EQ(clones[0].body, BodyId{3});
  EXPECT_EQ(clones[0].position.sector, kLow);
  EXPECT_EQ(clones[0].position.local, kBehindBorder + Eigen::Vector3d(16, 0, 0));
  EXPECT_THAT(clones_of(world[1]), IsEmpty());
}

TEST(Seams, EachServerNamesItsBodiesOfAnIslandOverABorder) {
  TestWorld world(2);
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(4, kLow, kBeforeBorder - Eigen::Vector3d(0.984375, 0, 0)));
  world.add(box(2, kHigh, kBehindBorder));
  world.add(box(3, kHigh, kBehindBorder + Eigen::Vector3d(0, 4, 0)));
  run_to_planned(world);
  const std::vector<IslandHere> low = islands_across_seams(world[0]);
  const std::vector<IslandHere> high = islands_across_seams(world[1]);
  ASSERT_EQ(low.size(), 1u);
  ASSERT_EQ(high.size(), 1u);
  EXPECT_EQ(low[0].id, BodyId{1});
  EXPECT_EQ(high[0].id, BodyId{1});
  EXPECT_THAT(low[0].bodies, ElementsAre(BodyId{1}, BodyId{4}));
  EXPECT_THAT(high[0].bodies, ElementsAre(BodyId{2}));
}

TEST(Seams, AnIslandThatSleepsIsNotListed) {
  TestWorld world;
  world.add(in_state(box(1, kLow, kBeforeBorder), Activity::kWantsSleep));
  world.add(in_state(box(2, kHigh, kBehindBorder), Activity::kWantsSleep));
  run_to_planned(world);
  world.exchange();
  EXPECT_THAT(islands_across_seams(world[0]), IsEmpty());
}

}  // namespace
}  // namespace tessera
