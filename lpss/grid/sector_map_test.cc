// Every sector of the world has exactly one owner, wherever it is, and all servers come to the same one.
#include "lpss/grid/sector_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::Lt;

constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();

// Sectors near the origin, at the ends of the range, and anywhere.
std::vector<SectorIndex> sectors_of_all_magnitudes() {
  std::vector<SectorIndex> result;
  for (const std::int64_t i : {kMin, kMin + 1, std::int64_t{-1}, std::int64_t{0}, std::int64_t{1}, kMax}) {
    for (const std::int64_t j : {kMin, std::int64_t{-2}, std::int64_t{0}, kMax}) {
      for (const std::int64_t k : {kMin, std::int64_t{0}, std::int64_t{3}, kMax}) result.push_back({i, j, k});
    }
  }
  std::mt19937_64 random(7);
  for (int n = 0; n < 200; ++n) {
    const auto draw = [&] { return static_cast<std::int64_t>(random()) >> (random() % 64); };
    result.push_back({draw(), draw(), draw()});
  }
  return result;
}

std::vector<std::pair<SectorIndex, double>> cube_of_sectors(std::int64_t edge) {
  std::vector<std::pair<SectorIndex, double>> load;
  for (std::int64_t i = 0; i < edge; ++i) {
    for (std::int64_t j = 0; j < edge; ++j) {
      for (std::int64_t k = 0; k < edge; ++k) load.push_back({{i, j, k}, 1});
    }
  }
  return load;
}

SectorIndex moved(const SectorIndex& sector, const SectorOffset& by) { return *translated(sector, by); }

// The order of the interleaved bits, from the highest ones, i before j before k.
bool interleaved_before(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor) {
  const auto bits = [&](std::int64_t value, std::int64_t origin) {
    return (static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(origin)) ^
           (std::uint64_t{1} << 63);
  };
  const std::uint64_t x[] = {bits(a.i, anchor.i), bits(a.j, anchor.j), bits(a.k, anchor.k)};
  const std::uint64_t y[] = {bits(b.i, anchor.i), bits(b.j, anchor.j), bits(b.k, anchor.k)};
  for (int bit = 63; bit >= 0; --bit) {
    for (int axis = 0; axis < 3; ++axis) {
      const bool in_x = (x[axis] >> bit) & 1;
      const bool in_y = (y[axis] >> bit) & 1;
      if (in_x != in_y) return in_y;
    }
  }
  return false;
}

TEST(MortonCurve, IsTheOrderOfInterleavedBitsAroundAnyAnchor) {
  const std::vector<SectorIndex> sectors = sectors_of_all_magnitudes();
  for (const SectorIndex& anchor :
       {SectorIndex{}, SectorIndex{kMax, kMin, 5}, SectorIndex{-(std::int64_t{1} << 62), 1, 0}}) {
    for (const SectorIndex& a : sectors) {
      for (const SectorIndex& b : sectors) {
        ASSERT_EQ(comes_before_on_curve(a, b, anchor), interleaved_before(a, b, anchor))
            << to_string(a) << " and " << to_string(b) << " around " << to_string(anchor);
      }
    }
  }
}

TEST(MortonCurve, PassesThroughOneBlockAfterTheOther) {
  std::vector<std::pair<SectorIndex, double>> load = cube_of_sectors(4);
  std::sort(load.begin(), load.end(),
            [](const auto& a, const auto& b) { return comes_before_on_curve(a.first, b.first, {}); });
  for (std::size_t n = 0; n < load.size(); ++n) {
    const SectorIndex& first_of_block = load[n / 8 * 8].first;
    EXPECT_EQ(chebyshev_distance({load[n].first.i / 2, load[n].first.j / 2, load[n].first.k / 2},
                                 {first_of_block.i / 2, first_of_block.j / 2, first_of_block.k / 2}),
              0);
  }
}

TEST(SectorMap, OneServerOwnsEverything) {
  const SectorMap map({3, 4, 5}, {}, 9);
  EXPECT_EQ(map.servers(), 1u);
  EXPECT_EQ(map.epoch(), 9u);
  EXPECT_EQ(map.anchor(), (SectorIndex{3, 4, 5}));
  for (const SectorIndex& sector : sectors_of_all_magnitudes()) EXPECT_EQ(map.owner(sector), 0u);
}

TEST(SectorMap, RunsBeginAtTheirSplittersAndFollowTheCurve) {
  const std::vector<SectorIndex> splitters = {{-1, 0, 0}, {0, 0, 0}, {0, 2, 0}};
  const SectorMap map({}, splitters, 1);
  EXPECT_EQ(map.servers(), 4u);
  for (Rank rank = 0; rank < 3; ++rank) EXPECT_EQ(map.owner(splitters[rank]), rank + 1);
  std::vector<SectorIndex> sectors = sectors_of_all_magnitudes();
  std::sort(sectors.begin(), sectors.end(),
            [](const SectorIndex& a, const SectorIndex& b) { return comes_before_on_curve(a, b, {}); });
  Rank last = 0;
  for (const SectorIndex& sector : sectors) {
    const Rank owner = map.owner(sector);
    EXPECT_GE(owner, last) << to_string(sector);
    EXPECT_LT(owner, 4u);
    last = owner;
  }
  EXPECT_EQ(map.owner({kMin, kMin, kMin}), 0u);
  EXPECT_EQ(map.owner({kMax, kMax, kMax}), 3u);
}

TEST(SectorMap, RunsMayHaveAnyOwners) {
  const std::vector<SectorIndex> splitters = {{-1, 0, 0}, {0, 0, 0}, {0, 2, 0}};
  const SectorMap map({}, splitters, {2, 0, 2, 1}, 4, 7);
  EXPECT_EQ(map.servers(), 4u);
  EXPECT_EQ(map.epoch(), 7u);
  EXPECT_EQ(map.splitters(), splitters);
  EXPECT_THAT(map.owners(), ElementsAre(2, 0, 2, 1));
  const SectorMap runs({}, splitters, 1);
  for (const SectorIndex& sector : sectors_of_all_magnitudes()) {
    EXPECT_EQ(map.owner(sector), map.owners()[runs.owner(sector)]) << to_string(sector);
  }
}

TEST(SectorMap, NeighboursOfOneOwnerAreOneRun) {
  const std::vector<SectorIndex> splitters = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  const SectorMap map({}, splitters, {0, 0, 1, 1, 1, 0}, 2, 1);
  EXPECT_THAT(map.splitters(), ElementsAre(SectorIndex{1, 0, 0}, SectorIndex{3, 0, 0}));
  EXPECT_THAT(map.owners(), ElementsAre(0, 1, 0));
  const SectorMap empty_run({}, {{1, 0, 0}, {1, 0, 0}}, {0, 1, 0}, 2, 1);
  EXPECT_THAT(empty_run.splitters(), testing::IsEmpty());
  EXPECT_EQ(empty_run.owner({5, 0, 0}), 0u);
}

TEST(SectorMap, OneRunPerServerInTheOrderOfRanksNeedsNoOwners) {
  const SectorMap map({}, {{0, 0, 0}, {2, 0, 0}}, {0, 1, 1}, 2, 1);
  EXPECT_THAT(map.splitters(), ElementsAre(SectorIndex{0, 0, 0}));
  EXPECT_THAT(map.owners(), testing::IsEmpty());
}

TEST(SectorMap, WhatComesFromElsewhereIsChecked) {
  const std::vector<SectorIndex> two = {{0, 0, 0}, {2, 0, 0}};
  EXPECT_TRUE(SectorMap::checked({}, two, {}, 3, 1).ok());
  EXPECT_TRUE(SectorMap::checked({}, two, {1, 0, 1}, 2, 1).ok());
  EXPECT_TRUE(SectorMap::checked({}, {}, {4}, 5, 1).ok());
  const auto refusal = [](const std::vector<SectorIndex>& splitters, const std::vector<Rank>& owners,
                          std::size_t servers) {
    return std::string(SectorMap::checked({}, splitters, owners, servers, 1).status().message());
  };
  EXPECT_THAT(refusal(two, {}, 2), testing::HasSubstr("3 runs for 2 servers"));
  EXPECT_THAT(refusal(two, {0, 1}, 2), testing::HasSubstr("3 runs, and owners for 2"));
  EXPECT_THAT(refusal(two, {0, 1, 2}, 2), testing::HasSubstr("none of the 2 servers"));
  EXPECT_THAT(refusal(two, {0, 1, 0xffffffff}, 2), testing::HasSubstr("none of the 2 servers"));
  EXPECT_THAT(refusal({{2, 0, 0}, {0, 0, 0}}, {0, 1, 0}, 2), testing::HasSubstr("must ascend"));
  const std::vector<SectorIndex> many(kMapRunsMax, SectorIndex{1, 1, 1});
  EXPECT_THAT(refusal(many, std::vector<Rank>(kMapRunsMax + 1), 2), testing::HasSubstr("at most 4096"));
}

TEST(SectorMapDeathTest, SplittersThatDoNotAscendAreABrokenInvariant) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(SectorMap({}, {{1, 0, 0}, {0, 0, 0}}, 1), "ascend on the curve");
}

TEST(BalancedMap, EqualLoadsAreCutIntoEqualRuns) {
  for (const std::uint32_t servers : {1u, 2u, 4u, 8u, 16u}) {
    const auto load = cube_of_sectors(4);
    const SectorMap map = SectorMap::balanced({}, load, servers, 1);
    ASSERT_EQ(map.servers(), servers);
    std::vector<int> count(servers);
    for (const auto& [sector, weight] : load) ++count[map.owner(sector)];
    EXPECT_THAT(count, testing::Each(static_cast<int>(load.size() / servers)));
  }
}

TEST(BalancedMap, NoServerHasMoreThanItsShareAndAHalfOfOneSectorAtEachEnd) {
  std::mt19937_64 random(3);
  std::vector<std::pair<SectorIndex, double>> load = cube_of_sectors(5);
  double total = 0;
  double heaviest = 0;
  for (auto& [sector, weight] : load) {
    weight = 1 + static_cast<double>(random() % 16);
    total += weight;
    heaviest = std::max(heaviest, weight);
  }
  for (const std::uint32_t servers : {2u, 3u, 7u}) {
    const SectorMap map = SectorMap::balanced({}, load, servers, 1);
    std::vector<double> sum(servers);
    for (const auto& [sector, weight] : load) sum[map.owner(sector)] += weight;
    for (const double each : sum) EXPECT_NEAR(each, total / servers, heaviest);
  }
}

TEST(BalancedMap, AHeavySectorIsAlone) {
  const std::vector<std::pair<SectorIndex, double>> load = {
      {{0, 0, 0}, 100}, {{0, 0, 1}, 1}, {{0, 1, 0}, 1}, {{1, 0, 0}, 1}};
  const SectorMap map = SectorMap::balanced({}, load, 2, 1);
  EXPECT_EQ(map.owner({0, 0, 0}), 0u);
  EXPECT_EQ(map.owner({0, 0, 1}), 1u);
  EXPECT_EQ(map.owner({1, 0, 0}), 1u);
}

TEST(BalancedMap, ASectorAtACutBelongsWhereItsMiddleIs) {
  const auto owners = [](double first, double second, double third) {
    const SectorMap map =
        SectorMap::balanced({}, {{{0, 0, 0}, first}, {{0, 0, 1}, second}, {{0, 1, 0}, third}}, 2, 1);
    return std::vector<Rank>{map.owner({0, 0, 0}), map.owner({0, 0, 1}), map.owner({0, 1, 0})};
  };
  EXPECT_THAT(owners(2, 4, 1), ElementsAre(0, 1, 1));
  EXPECT_THAT(owners(1, 4, 1), ElementsAre(0, 1, 1)) << "just in the middle";
  EXPECT_THAT(owners(1, 4, 2), ElementsAre(0, 0, 1));
}

TEST(BalancedMap, DoesNotDependOnTheOrderOfTheLoad) {
  std::vector<std::pair<SectorIndex, double>> load = cube_of_sectors(3);
  for (std::size_t n = 0; n < load.size(); ++n) load[n].second = 1 + static_cast<double>(n % 4);
  const SectorMap map = SectorMap::balanced({1, 1, 1}, load, 4, 1);
  std::reverse(load.begin(), load.end());
  EXPECT_EQ(SectorMap::balanced({1, 1, 1}, load, 4, 1).splitters(), map.splitters());
}

TEST(BalancedMap, MoreServersThanSectorsLeaveNoSectorWithoutAnOwner) {
  const std::vector<std::pair<SectorIndex, double>> two = {{{0, 0, 0}, 1}, {{0, 0, 1}, 1}};
  for (const auto& load : {two, {}}) {
    const SectorMap map = SectorMap::balanced({}, load, 5, 1);
    EXPECT_EQ(map.servers(), 5u);
    EXPECT_EQ(map.splitters().size(), 4u);
    for (const SectorIndex& sector : sectors_of_all_magnitudes()) EXPECT_LT(map.owner(sector), 5u);
  }
  const SectorMap map = SectorMap::balanced({}, two, 5, 1);
  EXPECT_NE(map.owner({0, 0, 0}), map.owner({0, 0, 1}));
}

TEST(BalancedMap, IsTheSameForAWorldThatIsMoved) {
  const SectorOffset by{std::int64_t{1} << 62, -(std::int64_t{1} << 62), 12345};
  const auto load = cube_of_sectors(3);
  auto load_there = load;
  for (auto& [sector, weight] : load_there) sector = moved(sector, by);
  const SectorMap here = SectorMap::balanced({1, 0, 2}, load, 3, 1);
  const SectorMap there = SectorMap::balanced(moved({1, 0, 2}, by), load_there, 3, 1);
  for (const auto& [sector, weight] : load) EXPECT_EQ(here.owner(sector), there.owner(moved(sector, by)));
}

TEST(ScatteredMap, UsesAllServersAndKeepsNoNeighbourhood) {
  const SectorMap map = SectorMap::scattered({}, 4, 17, 6);
  EXPECT_EQ(map.servers(), 4u);
  EXPECT_EQ(map.epoch(), 6u);
  std::vector<int> count(4);
  for (const auto& [sector, weight] : cube_of_sectors(10)) ++count.at(map.owner(sector));
  for (const int each : count) EXPECT_NEAR(each, 250, 60);
  for (const SectorIndex& sector : sectors_of_all_magnitudes()) EXPECT_THAT(map.owner(sector), Lt(4u));
}

TEST(ScatteredMap, FollowsFromTheSeedAndThePlaceRelativeToTheAnchor) {
  const SectorOffset by{kMax, 3, kMin};
  const SectorMap map = SectorMap::scattered({}, 5, 4, 1);
  const SectorMap again = SectorMap::scattered({}, 5, 4, 2);
  const SectorMap there = SectorMap::scattered(moved({}, by), 5, 4, 1);
  const SectorMap other = SectorMap::scattered({}, 5, 6, 1);
  int differences = 0;
  for (const auto& [sector, weight] : cube_of_sectors(5)) {
    EXPECT_EQ(map.owner(sector), again.owner(sector));
    const SectorIndex negative{-sector.i, sector.j, sector.k};
    EXPECT_EQ(map.owner(negative), there.owner(moved(negative, by)));
    differences += map.owner(sector) != other.owner(sector) ? 1 : 0;
  }
  EXPECT_GT(differences, 60);
}

TEST(Scrambled, IsSplitmix64) {
  // The first numbers of the reference implementation for the seed 0: each state is a multiple of the step.
  constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15;
  EXPECT_THAT((std::vector<std::uint64_t>{scrambled(0), scrambled(kStep), scrambled(2 * kStep)}),
              ElementsAre(0xe220a8397b1dcdaf, 0x6e789e6aa1b965f4, 0x06c45d188009454f));
}

}  // namespace
}  // namespace tessera
