// Contact points are sent to the sector that detects their pair next, with all that a solver starts from.
#include "lpss/tick/contact_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/partition/sectors.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::IsEmpty;

// Two boxes that touch in one sector, the first of which has its change of home announced.
void add_touching_pair(TestWorld& world, const SectorIndex& home, const SectorIndex& next_home) {
  world.add(box(1, home, {0, 0, 0}));
  world.add(box(2, home, {0.984375, 0, 0}));
  world.exchange();
  world.detect();
  Partition& partition = world.host(home);
  ASSERT_EQ(world.sector(home).world->contacts().size(), 1u);
  world.sector(home).touching.insert({BodyId{1}, BodyId{2}});
  body(partition, 1).next_home = next_home;
  partition.leaving = {BodyId{1}};
}

TEST(ContactPoints, GoToTheServerWhoseSectorDetectsNext) {
  TestWorld world(2);
  add_touching_pair(world, kHigh, kLow);
  const std::string points = world.sector(kHigh).world->export_manifold(0).points;
  std::vector<Exchange> outbox(2);
  send_contact_points(world[1], outbox);
  EXPECT_THAT(outbox[1].manifolds, IsEmpty());
  ASSERT_EQ(outbox[0].manifolds.size(), 1u);
  const ManifoldTransfer& sent = outbox[0].manifolds[0];
  EXPECT_EQ(sent.to, kLow);
  EXPECT_EQ(std::pair(sent.manifold.a, sent.manifold.b), std::pair(BodyId{1}, BodyId{2}));
  EXPECT_EQ(sent.manifold.points, points);
  EXPECT_TRUE(sent.was_touching);
  EXPECT_THAT(world.sector(kHigh).touching, IsEmpty()) << "the contact does not end here";
}

TEST(ContactPoints, StayInTheSectorWhereABodyBecomesAClone) {
  TestWorld world(2);
  add_touching_pair(world, kLow, kHigh);
  std::vector<Exchange> outbox(2);
  send_contact_points(world[0], outbox);
  EXPECT_THAT(outbox[1].manifolds, IsEmpty()) << "the lower home goes on detecting";
  ASSERT_EQ(outbox[0].manifolds.size(), 1u);
  EXPECT_EQ(outbox[0].manifolds[0].to, kLow);
}

TEST(ContactPoints, OfPairsThatStayAreNotSent) {
  TestWorld world(2);
  add_touching_pair(world, kHigh, kLow);
  world[1].leaving.clear();
  std::vector<Exchange> outbox(2);
  send_contact_points(world[1], outbox);
  EXPECT_THAT(outbox[0].manifolds, IsEmpty());
  EXPECT_THAT(outbox[1].manifolds, IsEmpty());
}

TEST(ContactPoints, UnderThePolicyCloneOnlyAContactThatHasBegunIsHandedOver) {
  for (const bool touching : {false, true}) {
    TestWorld world(2, clone_settings());
    add_touching_pair(world, kHigh, kLow);
    if (!touching) world.sector(kHigh).touching.clear();
    std::vector<Exchange> outbox(2);
    send_contact_points(world[1], outbox);
    ASSERT_EQ(outbox[0].manifolds.size(), touching ? 1u : 0u);
    if (!touching) continue;
    EXPECT_TRUE(outbox[0].manifolds[0].was_touching);
    EXPECT_THAT(outbox[0].manifolds[0].manifold.points, IsEmpty()) << "both sectors have points of their own";
  }
}

TEST(ContactPoints, AreTakenOverWhereTheSectorHasAWorld) {
  TestWorld world;
  add_touching_pair(world, kHigh, kLow);
  const ManifoldState manifold = world.sector(kHigh).world->export_manifold(0);
  TestPartition other;
  add_body(*other, box(1, kLow, {0, 0, 0}));
  add_body(*other, box(2, kLow, {0.984375, 0, 0}));
  std::vector<Exchange> inbox(1);
  inbox[0].manifolds = {{kLow, true, manifold}, {SectorIndex{9, 9, 9}, true, manifold}};
  take_contact_points(*other, inbox);
  const Sector& low = sector(*other, kLow);
  ASSERT_EQ(low.world->contacts().size(), 1u);
  EXPECT_EQ(low.world->export_manifold(0).points, manifold.points);
  EXPECT_TRUE(low.touching.contains({BodyId{1}, BodyId{2}}));
  EXPECT_FALSE(other->sectors.contains({9, 9, 9}));
}

}  // namespace
}  // namespace tessera
