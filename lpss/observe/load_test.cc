// What a server says of its load.
#include "lpss/observe/load.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::AllOf;
using testing::DoubleEq;
using testing::Ge;
using testing::IsEmpty;
using testing::Le;
using testing::SizeIs;

double work_at(const std::vector<LoadPiece>& pieces, const SectorIndex& sector) {
  for (const LoadPiece& piece : pieces) {
    if (piece.first == sector) return piece.work;
  }
  return 0;
}

double work_of(const std::vector<LoadPiece>& pieces) {
  double sum = 0;
  for (const LoadPiece& piece : pieces) sum += piece.work;
  return sum;
}

TEST(Load, APartitionWithoutBodiesHasNone) {
  TestWorld world;
  EXPECT_THAT(load_along_curve(world[0], 0, kLoadPiecesMax), IsEmpty());
}

TEST(Load, CountsAwakeBodiesAndWhatTouches) {
  TestWorld world;
  world.add(box(1, kLow, {0, 0, 0}));
  world.add(box(2, kLow, {0.984375, 0, 0}));
  world.add(box(3, kHigh, {0, 0, 0}));
  world.run_to_solved();
  const std::vector<LoadPiece> pieces = load_along_curve(world[0], 0, kLoadPiecesMax);
  ASSERT_THAT(pieces, SizeIs(2));
  EXPECT_EQ(pieces[0].first, kLow);
  EXPECT_EQ(pieces[0].bodies, 2u);
  EXPECT_EQ(pieces[0].sectors, 1u);
  EXPECT_THAT(pieces[0].work - pieces[1].work, DoubleEq(1 + 2)) << "a body and a pair";
}

TEST(Load, IsWhereBodiesAreGoingToBe) {
  TestWorld world;
  world.add(moving(box(1, kLow, {0, 0, 0}), {16, 0, 0}));
  world.add(box(2, kLow, {4, 4, 4}));
  const double now = work_of(load_along_curve(world[0], 0, kLoadPiecesMax));
  const std::vector<LoadPiece> then = load_along_curve(world[0], 1, kLoadPiecesMax);
  EXPECT_THAT(work_at(then, kLow), DoubleEq(now / 2));
  EXPECT_THAT(work_at(then, kHigh), DoubleEq(now / 2));
  const auto low = std::ranges::find(then, kLow, &LoadPiece::first);
  EXPECT_EQ(low->bodies, 2u) << "what a move moves is where it is";
}

TEST(Load, OfManySectorsIsToldInFewPieces) {
  TestWorld world;
  for (std::uint64_t n = 0; n < 100; ++n)
    world.add(box(n + 1, {static_cast<std::int64_t>(n), 0, 0}, {0, 0, 0}));
  const std::vector<LoadPiece> all = load_along_curve(world[0], 0, kLoadPiecesMax);
  ASSERT_THAT(all, SizeIs(100));
  const std::vector<LoadPiece> few = load_along_curve(world[0], 0, 8);
  ASSERT_THAT(few, SizeIs(AllOf(Ge(7), Le(8))));
  EXPECT_THAT(work_of(few), DoubleEq(work_of(all)));
  std::uint64_t sectors = 0;
  for (const LoadPiece& piece : few) {
    EXPECT_LE(piece.sectors, 16u) << "cubes: these are a power of two long";
    EXPECT_EQ(first_of_cube(piece.first, piece.level, world[0].anchor), piece.first);
    sectors += piece.sectors;
  }
  EXPECT_EQ(sectors, 100u);
  EXPECT_TRUE(std::is_sorted(few.begin(), few.end(), [&](const LoadPiece& a, const LoadPiece& b) {
    return comes_before_on_curve(a.first, b.first, world[0].anchor);
  }));
}

}  // namespace
}  // namespace tessera
