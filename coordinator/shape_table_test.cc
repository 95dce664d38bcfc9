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
  ShapeTable table({ball_of(1), ball_of(2)});
  table.take(0);
  table.take(1);
  table.take(1);
  EXPECT_TRUE(table.has_one_body(0));
  EXPECT_FALSE(table.has_one_body(1));
  table.give_back(1, 5);
  EXPECT_EQ(table.find_equal(ball_of(2)), 1u);
  table.give_back(1, 7);
  EXPECT_EQ(table.find(1), nullptr);
  EXPECT_EQ(table.find_equal(ball_of(2)), std::nullopt);
  EXPECT_NE(table.find(0), nullptr);
}

TEST(ShapeTable, AnEqualOneThatComesLaterHasAnotherId) {
  ShapeTable table({ball_of(1)});
  table.take(0);
  table.give_back(0, 3);
  table.drop_before(3);
  EXPECT_EQ(table.size(), 0u);
  EXPECT_EQ(table.add(ball_of(1), 4), 1u);
  EXPECT_EQ(table.find_equal(ball_of(1)), 1u);
}

TEST(ShapeTable, TellsWhatServersHadAtATick) {
  ShapeTable table({ball_of(1)});
  table.take(0);
  table.take(table.add(ball_of(2), 10));
  table.give_back(0, 12);
  table.take(table.add(ball_of(3), 12));
  table.give_back(1, 20);
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
  ShapeTable table({});
  for (int n = 0; n < 10; ++n) table.take(table.add(ball_of(1 + n), 1));
  EXPECT_EQ(table.find_equal(ball_of(50)), std::nullopt);
  const std::size_t bytes = table.bytes();
  EXPECT_GT(bytes, 0u);
  for (ShapeId id = 0; id < 10; ++id) table.give_back(id, 2);
  EXPECT_EQ(table.bytes(), bytes);
  table.drop_before(2);
  EXPECT_EQ(table.bytes(), 0u);
  EXPECT_THAT(table.at(2), IsEmpty());
}

TEST(ShapeTable, AShapeThatGoesBeforeItIsLookedForLeavesNothing) {
  ShapeTable table({});
  table.take(table.add(ball_of(1), 1));
  table.give_back(0, 1);
  table.drop_before(1);
  EXPECT_EQ(table.find_equal(ball_of(1)), std::nullopt);
  EXPECT_EQ(table.bytes(), 0u);
}

}  // namespace
}  // namespace tessera
