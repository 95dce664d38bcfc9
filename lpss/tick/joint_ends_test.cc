#include "lpss/tick/joint_ends.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::IsEmpty;
using testing::UnorderedElementsAre;

// 1 and 2 live at the first server, 3 and 4 at the second; 5 is static.
TestWorld row() {
  TestWorld world(2);
  for (const std::uint64_t id : {1, 2}) world.add(box(id, kLow, Eigen::Vector3d(id, 0, 0)));
  for (const std::uint64_t id : {3, 4}) world.add(box(id, kHigh, Eigen::Vector3d(id, 0, 0)));
  world.add(box(5, kLow, Eigen::Vector3d(-5, 0, 0), Motion::kStatic));
  return world;
}

std::vector<JointEnd> ends_at(TestWorld& world, Rank rank,
                              const std::vector<Handover>& handed_to_other = {}) {
  std::vector<Exchange> outbox(2);
  outbox[1 - rank].handovers = handed_to_other;
  return joint_ends(world[rank], outbox);
}

TEST(JointEnds, AreThoseWhoseOtherEndIsNotHere) {
  TestWorld world = row();
  EXPECT_THAT(ends_at(world, 0), IsEmpty());
  world.add(hinge(1, 1, 2));
  EXPECT_THAT(ends_at(world, 0), IsEmpty());
  EXPECT_THAT(ends_at(world, 1), IsEmpty());
  world.add(hinge(2, 2, 3));
  EXPECT_THAT(ends_at(world, 0), UnorderedElementsAre(JointEnd{BodyId{2}, BodyId{3}, 0}));
  EXPECT_THAT(ends_at(world, 1), UnorderedElementsAre(JointEnd{BodyId{3}, BodyId{2}, 1}));
}

TEST(JointEnds, OfStaticBodiesAndTheWorldCountForNothing) {
  TestWorld world = row();
  JointRecord fixed = hinge(1, 5, 3);
  fixed.parent_motion = Motion::kStatic;
  world.add(fixed);
  JointRecord to_world = hinge(2, 0, 4);
  to_world.parent_motion = Motion::kStatic;
  world.add(to_world);
  EXPECT_THAT(ends_at(world, 0), IsEmpty());
  EXPECT_THAT(ends_at(world, 1), IsEmpty());
}

TEST(JointEnds, ThoseThatPartAreToldForBothSides) {
  TestWorld world = row();
  world.add(hinge(1, 1, 2));
  Handover handover;
  handover.record = remove_home(world[0], body(world[0], 2));
  EXPECT_THAT(ends_at(world, 0, {handover}),
              UnorderedElementsAre(JointEnd{BodyId{1}, BodyId{2}, 0}, JointEnd{BodyId{2}, BodyId{1}, 1}));
}

// An axis that follows another one ties the children of both.
TEST(JointEnds, AreThoseOfAxesThatFollowOthers) {
  TestWorld world = row();
  const JointRecord leader = hinge(1, 0, 1);
  world.add(leader);
  JointRecord follower = hinge(2, 0, 3);
  follower.properties.axes[0].mimic.leader = JointId{1};
  world.add(follower, {tie_of(leader)});
  EXPECT_THAT(ends_at(world, 0), testing::Contains(JointEnd{BodyId{1}, BodyId{3}, 0}));
  EXPECT_THAT(ends_at(world, 1), testing::Contains(JointEnd{BodyId{3}, BodyId{1}, 1}));
}

}  // namespace
}  // namespace tessera
