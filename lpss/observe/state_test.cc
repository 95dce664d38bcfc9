// What is read of the bodies of a partition.
#include "lpss/observe/state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::UnorderedElementsAre;

void add_bodies(TestWorld& world) {
  world.add(box(3, kLow, {1, 2, 3}));
  world.add(box(1, kHigh, {4, 5, 6}, Motion::kKinematic));
  world.add(moving(box(2, kLow, {7, 0, 0}), {1, 0, 0}));
  world.add(box(4, kHigh, {0, 0, 0}, Motion::kStatic));
}

TEST(State, TheHashesOfAllServersAddUpToThatOfOne) {
  TestWorld alone;
  TestWorld shared(2);
  add_bodies(alone);
  add_bodies(shared);
  WorldHash sum = hash_of(shared[0]);
  sum.add(hash_of(shared[1]));
  EXPECT_EQ(sum, hash_of(alone[0]));
  put(alone[0], 2, {7, 0, 1.0 / 1024});
  EXPECT_NE(sum, hash_of(alone[0])) << "a body is elsewhere";
}

TEST(State, BodiesThatCanMoveAreVisitedInTheOrderOfTheirIds) {
  TestWorld world;
  add_bodies(world);
  std::vector<std::uint64_t> ids;
  for_each_body(world[0], [&](const BodyRecord& record) { ids.push_back(record.id.value); });
  EXPECT_THAT(ids, ElementsAre(1, 2, 3));
}

TEST(State, BodiesOfTheSectorsThatAreWanted) {
  TestWorld world;
  add_bodies(world);
  std::vector<std::uint64_t> ids;
  const auto visit = [&](const BodyView& view) {
    EXPECT_EQ(view.home, kLow);
    EXPECT_EQ(bits(view.state), bits(state_of(world[0], view.id.value)));
    ids.push_back(view.id.value);
  };
  for_each_body_in(
      world[0], [](const SectorIndex& index) { return index == kLow; }, false, visit);
  EXPECT_THAT(ids, ElementsAre(2, 3));
}

TEST(State, EachBodyOfAListIsToldByTheServerOfItsHome) {
  TestWorld world(2);
  add_bodies(world);
  const std::vector<BodyId> wanted{BodyId{4}, BodyId{2}, BodyId{9}, BodyId{1}, BodyId{3}};
  const auto told_by = [&](Rank rank) {
    std::vector<std::uint64_t> ids;
    for (const BodyRecord& record : bodies_of(world[rank], wanted)) ids.push_back(record.id.value);
    return ids;
  };
  EXPECT_THAT(told_by(0), ElementsAre(2, 3));
  EXPECT_THAT(told_by(1), ElementsAre(4, 1));
  const std::vector<BodyId> one{BodyId{1}};
  const BodyRecord record = bodies_of(world[1], one).at(0);
  EXPECT_EQ(record.home, kHigh);
  EXPECT_THAT(record.state.position, ElementsAre(4, 5, 6));
}

TEST(State, ABodyIsFoundWhereItLivesAndAStaticOneNowhere) {
  TestWorld world(2);
  add_bodies(world);
  ASSERT_TRUE(body_of(world[0], BodyId{3}));
  EXPECT_EQ(body_of(world[0], BodyId{3})->home, kLow);
  EXPECT_THAT(body_of(world[0], BodyId{3})->state.position, ElementsAre(1, 2, 3));
  EXPECT_FALSE(body_of(world[1], BodyId{3}));
  EXPECT_FALSE(body_of(world[1], BodyId{4}));
}

}  // namespace
}  // namespace tessera
