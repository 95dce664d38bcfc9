// The nodes of a sector's graph: who is in it, in which order, and how they are found.
#include "lpss/tick/contact_graph.h"

#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

TEST(ContactGraph, HasTheBodiesThatLiveHereAndThenThePlacedClonesEachById) {
  TestWorld world;
  world.add(box(4, kLow, kBeforeBorder));
  world.add(in_state(box(2, kLow, {0, 0, 0}, Motion::kKinematic), Activity::kAsleep));
  world.add(in_state(box(3, kHigh, kBehindBorder), Activity::kWantsSleep));
  world.add(box(1, kHigh, kBehindBorder + Eigen::Vector3d(0, 0.9, 0)));
  world.add(box(5, kHigh, kBehindBorder + Eigen::Vector3d(0, 4, 0)));  // a replica, too far for a clone
  world.add(box(6, kLow, {0, 0, -1}, Motion::kStatic));
  world.exchange();
  const Sector& low = world.sector(kLow);
  ASSERT_EQ(low.clones.size(), 3u);
  const ContactGraph graph(low);
  ASSERT_EQ(graph.size(), 4u);
  EXPECT_EQ(graph.homes(), 2u);
  const std::uint64_t ids[] = {2, 4, 1, 3};
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_EQ(graph[n].id, BodyId{ids[n]});
    EXPECT_EQ(graph.named(BodyId{ids[n]}), &graph[n]);
    EXPECT_EQ(graph.in_slot(graph[n].slot), &graph[n]);
    EXPECT_EQ(graph.index(&graph[n]), n);
    EXPECT_EQ(graph[n].home != nullptr, n < 2);
  }
  EXPECT_EQ(graph.named(BodyId{5}), nullptr);
  EXPECT_EQ(graph.in_slot(low.statics.at(BodyId{6})), nullptr);
  EXPECT_FALSE(graph[0].dynamic);
  EXPECT_FALSE(graph[0].awake);
  EXPECT_TRUE(graph[3].awake);
  EXPECT_TRUE(graph[3].wants_sleep);
  EXPECT_FALSE(graph[1].wants_sleep);
}

}  // namespace
}  // namespace tessera
