// Cubes of the curve are runs of it.
#include "lpss/grid/curve.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

namespace tessera {
namespace {

constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
constexpr SectorIndex kAnchors[] = {{0, 0, 0}, {3, -5, 7}, {kMost, kLeast, 0}};

std::vector<SectorIndex> some_sectors() {
  std::vector<SectorIndex> sectors = {{0, 0, 0}, {-1, 0, 0}, {kLeast, kLeast, kLeast}, {kMost, kMost, kMost}};
  std::mt19937_64 random(5);
  for (int n = 0; n < 60; ++n) {
    const auto draw = [&] { return static_cast<std::int64_t>(random()) >> (random() % 64); };
    sectors.push_back({draw(), draw(), draw(), static_cast<FrameNumber>(n % 3)});
  }
  return sectors;
}

TEST(CurveCube, IsAllBetweenItsFirstSectorAndTheFirstOneAfterIt) {
  const std::vector<SectorIndex> sectors = some_sectors();
  for (const SectorIndex& anchor : kAnchors) {
    for (const unsigned level : {0u, 1u, 2u, 7u, 40u, 63u, 64u}) {
      for (const SectorIndex& a : sectors) {
        const SectorIndex first = first_of_cube(a, level, anchor);
        const std::optional<SectorIndex> after = first_after_cube(a, level, anchor);
        for (const SectorIndex& b : sectors) {
          const bool is_inside = first_of_cube(b, level, anchor) == first;
          EXPECT_EQ(is_inside, !comes_before_on_curve(b, first, anchor) &&
                                   (!after || comes_before_on_curve(b, *after, anchor)))
              << to_string(a) << " and " << to_string(b) << " on level " << level;
          EXPECT_EQ(is_inside, common_level(a, b, anchor) <= level);
        }
        if (!after) continue;
        EXPECT_EQ(first_of_cube(*after, level, anchor), *after);
        EXPECT_NE(*after, first);
      }
    }
  }
}

TEST(CurveCube, OneFollowsTheOther) {
  SectorIndex at;
  for (int n = 0; n < 8; ++n) at = *first_after_cube(at, 0, {});
  EXPECT_EQ(at, *first_after_cube({}, 1, {}));
  EXPECT_EQ(at, (SectorIndex{0, 0, 2})) << "the next cube of two sectors: the last axis comes first";
  constexpr FrameNumber kLast = std::numeric_limits<FrameNumber>::max();
  EXPECT_EQ(first_after_cube({kMost, kMost, kMost, kLast}, 0, {}), std::nullopt);
  EXPECT_EQ(first_after_cube({5, 6, 7, kLast}, kCurveLevelMax, {}), std::nullopt);
  const SectorIndex next{kLeast, kLeast, kLeast, 3};
  EXPECT_EQ(first_after_cube({kMost, kMost, kMost, 2}, 0, {}), next) << "the curve of the next frame";
  EXPECT_EQ(first_after_cube({5, 6, 7, 2}, kCurveLevelMax, {1, 1, 1}), next) << "whose anchor is its origin";
  EXPECT_EQ(common_level({-1, 0, 0}, {0, 0, 0}, {}), kCurveLevelMax);
}

}  // namespace
}  // namespace tessera
