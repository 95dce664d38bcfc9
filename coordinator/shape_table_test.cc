// Shapes come and go with their bodies, and no id comes back.
#include "coordinator/shape_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Shape ball_of(double radius) { return Shape{{{Sphere{radius}, {}}}}; }

std::vector<ShapeId> ids_at(const ShapeTable& table, Tick tick) {
  std::vector<ShapeId> ids;
  for (const ShapeEntry& entry : table.at(tick)) ids.push_back(entry.id);
  return ids;
}

TEST(ShapeTable, GoesWithTheLastBody) {
  Undo undo;
  ShapeTable table({ball_of(1), ball_of(2)});
  table.take(0);
  table.take(1);
  table.take(1);
  EXPECT_TRUE(table.has_one_body(0));
  EXPECT_FALSE(table.has_one_body(1));
  table.give_back(1, 5, undo);
  EXPECT_EQ(table.find_equal(ball_of(2)), 1u);
  table.give_back(1, 7, undo);
  EXPECT_EQ(table.find(1), nullptr);
  EXPECT_EQ(table.find_equal(ball_of(2)), std::nullopt);
  EXPECT_NE(table.find(0), nullptr);
}

TEST(ShapeTable, AnEqualOneThatComesLaterHasAnotherId) {
  Undo undo;
  ShapeTable table({ball_of(1)});
  table.take(0);
  table.give_back(0, 3, undo);
  table.drop_before(3);
  EXPECT_EQ(table.size(), 0u);
  EXPECT_EQ(table.add(ball_of(1), 4, undo), 1u);
  EXPECT_EQ(table.find_equal(ball_of(1)), 1u);
}

TEST(ShapeTable, TellsWhatServersHadAtATick) {
  Undo undo;
  ShapeTable table({ball_of(1)});
  table.take(0);
  table.take(table.add(ball_of(2), 10, undo));
  table.give_back(0, 12, undo);
  table.take(table.add(ball_of(3), 12, undo));
  table.give_back(1, 20, undo);
  EXPECT_THAT(ids_at(table, 9), ElementsAre(0));
  EXPECT_THAT(ids_at(table, 10), ElementsAre(0, 1));
  EXPECT_THAT(ids_at(table, 12), ElementsAre(1, 2));
  EXPECT_THAT(ids_at(table, 20), ElementsAre(2));
  table.drop_before(12);
  EXPECT_EQ(table.size(), 2u);
  EXPECT_THAT(ids_at(table, 12), ElementsAre(1, 2));
  table.drop_before(19);
  EXPECT_EQ(table.size(), 2u) << "whoever goes back to tick 19 needs it";
}

TEST(ShapeTable, CountsBytesOfThoseThatItKeeps) {
  Undo undo;
  ShapeTable table({});
  for (int n = 0; n < 10; ++n) table.take(table.add(ball_of(1 + n), 1, undo));
  EXPECT_EQ(table.find_equal(ball_of(50)), std::nullopt);
  const std::size_t bytes = table.bytes();
  EXPECT_GT(bytes, 0u);
  for (ShapeId id = 0; id < 10; ++id) table.give_back(id, 2, undo);
  EXPECT_EQ(table.bytes(), bytes);
  table.drop_before(2);
  EXPECT_EQ(table.bytes(), 0u);
  EXPECT_THAT(table.at(2), IsEmpty());
}

TEST(ShapeTable, AShapeThatGoesBeforeItIsLookedForLeavesNothing) {
  Undo undo;
  ShapeTable table({});
  table.take(table.add(ball_of(1), 1, undo));
  table.give_back(0, 1, undo);
  table.drop_before(1);
  EXPECT_EQ(table.find_equal(ball_of(1)), std::nullopt);
  EXPECT_EQ(table.bytes(), 0u);
}

// As if nothing had been: ids, what equal shapes are found, and bytes.
TEST(ShapeTable, TakesBackWhatCameAndWhatWent) {
  Undo undo;
  ShapeTable table({ball_of(1), ball_of(2)});
  for (const ShapeId id : {0, 1}) table.take(id);
  ASSERT_EQ(table.find_equal(ball_of(2)), 1u);
  const std::size_t bytes = table.bytes();
  table.take(table.add(ball_of(3), 4, undo));
  EXPECT_EQ(table.find_equal(ball_of(3)), 2u);
  table.give_back(1, 4, undo);
  EXPECT_EQ(table.find(1), nullptr);
  undo.roll_back();
  EXPECT_EQ(table.bytes(), bytes);
  EXPECT_EQ(table.next_id(), 2u);
  EXPECT_EQ(table.find_equal(ball_of(3)), std::nullopt);
  EXPECT_EQ(table.find_equal(ball_of(2)), 1u);
  EXPECT_TRUE(table.has_one_body(1));
  EXPECT_THAT(ids_at(table, 4), ElementsAre(0, 1));
  table.drop_before(10);
  EXPECT_EQ(table.size(), 2u) << "it does not go when it was to";
  EXPECT_EQ(table.add(ball_of(4), 5, undo), 2u);
  EXPECT_EQ(table.find_equal(ball_of(4)), 2u);
}

// One that was never looked for has no place in the index yet.
TEST(ShapeTable, TakesBackTheLeaveOfAShapeThatNobodyHasLookedFor) {
  Undo undo;
  ShapeTable table({ball_of(1)});
  table.take(0);
  table.give_back(0, 4, undo);
  EXPECT_EQ(table.find_equal(ball_of(1)), std::nullopt);
  undo.roll_back();
  EXPECT_EQ(table.find_equal(ball_of(1)), 0u);
}

}  // namespace
}  // namespace tessera
