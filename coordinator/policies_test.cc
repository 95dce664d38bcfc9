// Who gets what by each policy, of loads that are made up.
#include "coordinator/policies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <set>

namespace tessera {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

using Cost = std::function<double(std::int64_t i, std::int64_t j)>;

// A square of single sectors with these costs, of which server 0 has all, or each the one that is told.
Division square(std::int64_t edge, std::uint32_t servers, const Cost& cost,
                const std::function<Rank(std::int64_t, std::int64_t)>& owner = {}) {
  Division division;
  division.parts.assign(servers, 1.0 / servers);
  for (std::int64_t i = 0; i < edge; ++i) {
    for (std::int64_t j = 0; j < edge; ++j) {
      division.cells.push_back({.first = {i, j, 0},
                                .cost = cost(i, j),
                                .sectors = 1,
                                .bodies = 2,
                                .owner = owner ? owner(i, j) : 0});
    }
  }
  std::ranges::sort(division.cells,
                    [](const Cell& a, const Cell& b) { return comes_before_on_curve(a.first, b.first, {}); });
  return division;
}

// Two towns of unequal size on an even plain.
double towns(std::int64_t i, std::int64_t j) {
  const auto near = [&](double a, double b, double size) {
    const double far = ((static_cast<double>(i) - a) * (static_cast<double>(i) - a) +
                        (static_cast<double>(j) - b) * (static_cast<double>(j) - b)) /
                       (size * size);
    return std::exp(-far);
  };
  return 1 + 20 * near(5, 4, 3) + 10 * near(11, 12, 2);
}

double even(std::int64_t, std::int64_t) { return 1; }

// The largest strain by the mean.
double imbalance(const Division& division, const std::vector<Rank>& owners) {
  const std::vector<double> all = strains(division, owners);
  const double sum = std::accumulate(all.begin(), all.end(), 0.0);
  return *std::max_element(all.begin(), all.end()) * static_cast<double>(all.size()) / sum;
}

std::size_t changed(const Division& division, const std::vector<Rank>& owners) {
  std::size_t cells = 0;
  for (std::size_t n = 0; n < owners.size(); ++n) cells += owners[n] != division.cells[n].owner ? 1 : 0;
  return cells;
}

Division settled(Division division, const std::vector<Rank>& owners) {
  for (std::size_t n = 0; n < owners.size(); ++n) division.cells[n].owner = owners[n];
  return division;
}

// The faces between cells of different servers.
std::uint64_t borders(const Division& division, const std::vector<Rank>& owners) {
  std::uint64_t sum = 0;
  const std::vector<std::vector<CellBorder>> neighbours = neighbours_of(division);
  for (std::size_t n = 0; n < owners.size(); ++n) {
    for (const CellBorder& other : neighbours[n]) sum += owners[n] != owners[other.cell] ? other.border : 0;
  }
  return sum / 2;
}

class FollowingPolicies : public ::testing::TestWithParam<BalancePolicy> {
 protected:
  std::vector<Rank> divided(const Division& division) const {
    std::vector<Rank> owners = divide(GetParam(), division);
    EXPECT_EQ(owners.size(), division.cells.size());
    for (const Rank owner : owners) EXPECT_LT(owner, division.servers());
    EXPECT_EQ(owners, divide(GetParam(), division)) << "the same again";
    return owners;
  }
};

TEST_P(FollowingPolicies, ShareOutWhatOneServerHas) {
  for (const std::uint32_t servers : {2u, 3u, 4u, 7u}) {
    const Division division = square(16, servers, towns);
    EXPECT_LT(imbalance(division, divided(division)), servers < 7 ? 1.15 : 1.2) << servers;
  }
}

TEST_P(FollowingPolicies, KeepWhatIsEven) {
  const Division division = square(8, 4, even, [](auto i, auto j) { return i / 4 * 2 + j / 4; });
  EXPECT_EQ(changed(division, divided(division)), 0u);
}

TEST_P(FollowingPolicies, MoveLittleWhereLittleHasChanged) {
  const Division before = square(16, 4, towns);
  const Division now =
      settled(square(16, 4, [](auto i, auto j) { return towns(i, j - 1); }), divided(before));
  const std::vector<Rank> then = divided(now);
  EXPECT_LT(imbalance(now, then), 1.15);
  // METIS starts anew each time.
  const double part = GetParam() == BalancePolicy::kGraph ? 0.6 : 0.3;
  EXPECT_LT(static_cast<double>(changed(now, then)), part * 256);
}

TEST_P(FollowingPolicies, KeepNeighboursTogether) {
  const Division division = square(16, 4, towns);
  EXPECT_LT(borders(division, divided(division)), 100u) << "of 480; straight cuts have 32";
}

TEST_P(FollowingPolicies, ACellThatIsHeavierThanAllOthersIsAlone) {
  const Division division = square(4, 3, [](auto i, auto j) { return i == 1 && j == 2 ? 1000 : 1; });
  const std::vector<Rank> owners = divided(division);
  const auto heavy = std::ranges::find(division.cells, SectorIndex{1, 2, 0}, &Cell::first);
  const Rank alone = owners[static_cast<std::size_t>(heavy - division.cells.begin())];
  EXPECT_LE(std::ranges::count(owners, alone), 6) << "of 16";
}

TEST_P(FollowingPolicies, SixtyFourServersAllHaveSomethingToDo) {
  const Division division = square(32, 64, towns);
  const std::vector<Rank> owners = divided(division);
  EXPECT_THAT(strains(division, owners), Each(::testing::Gt(0)));
  EXPECT_LT(imbalance(division, owners), 1.6);
}

TEST_P(FollowingPolicies, MoreServersThanCells) {
  const Division division = square(2, 7, even);
  std::vector<Rank> owners = divided(division);
  std::ranges::sort(owners);
  EXPECT_EQ(std::unique(owners.begin(), owners.end()), owners.end()) << "each cell is alone";
}

TEST_P(FollowingPolicies, OneServerAndNoCells) {
  EXPECT_THAT(divided(square(3, 1, towns)), Each(0u));
  EXPECT_THAT(divided(square(0, 4, towns)), ::testing::IsEmpty());
  const Division idle = square(
      3, 4, [](auto, auto) { return 0; }, [](auto i, auto) { return i; });
  EXPECT_EQ(changed(idle, divided(idle)), 0u);
}

TEST_P(FollowingPolicies, AServerMayBeThereForMoreThanAnother) {
  Division division = square(16, 3, towns);
  division.parts = {0.5, 0.2, 0.3};
  const std::vector<Rank> owners = divided(division);
  EXPECT_LT(imbalance(division, owners), 1.2);
}

TEST_P(FollowingPolicies, TownsFarApart) {
  Division division = square(4, 4, even);
  for (const SectorIndex& town : {SectorIndex{1'000'000, 0, 0}, SectorIndex{0, std::int64_t{1} << 62, 5}}) {
    for (std::int64_t i = 0; i < 4; ++i) {
      for (std::int64_t j = 0; j < 4; ++j) {
        division.cells.push_back({.first = {town.i + i, town.j + j, town.k}, .cost = 1, .sectors = 1});
      }
    }
  }
  std::ranges::sort(division.cells,
                    [](const Cell& a, const Cell& b) { return comes_before_on_curve(a.first, b.first, {}); });
  EXPECT_LE(imbalance(division, divided(division)), 1.4);
}

// Loads of all kinds: owners that are servers, at least.
TEST_P(FollowingPolicies, AnyLoad) {
  std::mt19937 random(7);
  for (int n = 0; n < 300; ++n) {
    const auto servers = static_cast<std::uint32_t>(1 + random() % 9);
    const SectorMap map(SectorIndex{}, {}, {0}, servers, 1);
    std::vector<ServerLoad> loads(servers);
    for (std::size_t p = random() % 80; p > 0; --p) {
      const auto coordinate = [&] { return static_cast<std::int64_t>(random() % 24) - 12; };
      LoadPiece piece{.first = {coordinate(), coordinate(), coordinate() / 6}};
      if (random() % 3 == 0) piece.level = static_cast<unsigned>(random() % 66) % 65;
      if (random() % 3 != 0)
        piece.work = static_cast<double>(random() % 1000) * (random() % 9 == 0 ? 1e9 : 1);
      piece.sectors = random() % 3;
      loads[random() % servers].pieces.push_back(piece);
    }
    for (ServerLoad& load : loads) load.tick_us = static_cast<double>(random() % 5000);
    const Division division = division_of(map, loads);
    const std::vector<Rank> owners = divide(GetParam(), division);
    ASSERT_EQ(owners.size(), division.cells.size());
    for (const Rank owner : owners) ASSERT_LT(owner, servers);
    const SectorMap made = map_of(division, owners, 2);
    ASSERT_TRUE(SectorMap::checked({}, made.splitters(), made.owners(), servers, 2).ok());
  }
}

INSTANTIATE_TEST_SUITE_P(Policies, FollowingPolicies,
                         ::testing::Values(BalancePolicy::kCurve, BalancePolicy::kKMeans,
                                           BalancePolicy::kHulls, BalancePolicy::kGraph),
                         [](const auto& instance) {
                           std::string name(name_of(instance.param));
                           std::erase(name, '-');
                           return name;
                         });

TEST(GridPolicy, HasEqualBoxesWhateverTheyCost) {
  for (const Cost& cost : {Cost(even), Cost(towns)}) {
    const Division division = square(8, 4, cost);
    const std::vector<Rank> owners = divide_grid(division);
    for (std::size_t n = 0; n < owners.size(); ++n) {
      const SectorIndex& at = division.cells[n].first;
      EXPECT_EQ(owners[n], 2 * (at.i / 4) + at.j / 4) << to_string(at);
    }
  }
}

TEST(GridPolicy, BoxesAreNotThinnerThanSectors) {
  Division street;
  street.parts.assign(6, 1.0 / 6);
  for (std::int64_t i = 0; i < 12; ++i) street.cells.push_back({.first = {i, 0, 0}, .cost = 1, .sectors = 1});
  const std::vector<Rank> owners = divide_grid(street);
  EXPECT_THAT(owners, ElementsAre(0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5));
}

TEST(BalancePolicies, HaveNames) {
  for (const BalancePolicy policy : kBalancePolicies) {
    EXPECT_EQ(parse_balance_policy(name_of(policy)), policy);
  }
  EXPECT_EQ(parse_balance_policy("round-robin"), std::nullopt);
  EXPECT_THAT(balance_policy_names(), ElementsAre("curve", "k-means", "hulls", "graph", "grid"));
}

TEST(Matched, LeavesEachPartWhereMostOfItIs) {
  EXPECT_THAT(matched({{1, 9, 0}, {2, 1, 0}}), ElementsAre(1, 0));
  EXPECT_THAT(matched({{8, 9}, {1, 9}}), ElementsAre(0, 1)) << "the sum counts";
  EXPECT_THAT(matched({{0, 0}, {0, 0}}), UnorderedElementsAre(0, 1));
}

TEST(Matched, HasTheLargestSum) {
  std::mt19937 random(11);
  for (int n = 0; n < 200; ++n) {
    const std::size_t servers = 1 + random() % 5;
    const std::size_t parts = 1 + random() % servers;
    std::vector<std::vector<double>> kept(parts, std::vector<double>(servers));
    for (auto& row : kept) {
      for (double& value : row) value = static_cast<double>(random() % 20);
    }
    std::vector<Rank> order(servers);
    std::iota(order.begin(), order.end(), 0);
    double best = 0;
    do {
      double sum = 0;
      for (std::size_t part = 0; part < parts; ++part) sum += kept[part][order[part]];
      best = std::max(best, sum);
    } while (std::next_permutation(order.begin(), order.end()));
    const std::vector<Rank> found = matched(kept);
    double sum = 0;
    for (std::size_t part = 0; part < parts; ++part) sum += kept[part][found[part]];
    ASSERT_EQ(sum, best);
    ASSERT_EQ(std::set<Rank>(found.begin(), found.end()).size(), parts);
  }
}

TEST(Cells, OfOneCubeAreOne) {
  const SectorMap map({}, {{4, 0, 0}}, 1);
  const std::vector<ServerLoad> loads = {
      {{{.first = {1, 0, 0}, .level = 1, .work = 1, .sectors = 2, .bodies = 5}}, 1000},
      {{{.first = {0, 1, 0}, .level = 1, .work = 1}, {.first = {4, 0, 0}, .work = 3, .sectors = 1}}, 2000}};
  const Division division = division_of(map, loads);
  ASSERT_EQ(division.cells.size(), 2u);
  EXPECT_EQ(division.cells[0].first, (SectorIndex{0, 0, 0}));
  EXPECT_EQ(division.cells[0].cost, 1500);
  EXPECT_EQ(division.cells[0].sectors, 2u);
  EXPECT_EQ(division.cells[0].owner, 0u);
  EXPECT_EQ(division.cells[1].cost, 1500);
  EXPECT_EQ(division.cells[1].owner, 1u);
}

TEST(Cells, AMapGoesAroundThoseThatAreInOthers) {
  Division division;
  division.parts.assign(3, 1.0 / 3);
  division.cells = {
      {.first = {0, 0, 0}, .level = 3}, {.first = {2, 2, 2}, .level = 1}, {.first = {8, 0, 0}, .level = 0}};
  const SectorMap map = map_of(division, {0, 1, 2}, 5);
  EXPECT_EQ(map.epoch(), 5u);
  for (std::int64_t i = 0; i < 8; ++i) {
    for (std::int64_t j = 0; j < 8; ++j) {
      const bool is_inner = i / 2 == 1 && j / 2 == 1;
      EXPECT_EQ(map.owner({i, j, 3}), is_inner ? 1u : 0u);
      EXPECT_EQ(map.owner({i, j, 4}), 0u);
    }
  }
  EXPECT_EQ(map.owner({8, 0, 0}), 2u);
  EXPECT_EQ(map.owner({9, 9, 9}), 2u);
  EXPECT_EQ(map.owner({-1, 0, 0}), 0u);
}

TEST(Cells, AMapHasABoundedNumberOfRuns) {
  // A board of black and white, with a few fields that count.
  Division division = square(80, 2, [](auto i, auto j) { return i < 8 && j < 8 ? 1000 : 0.001; });
  std::vector<Rank> owners;
  for (const Cell& cell : division.cells)
    owners.push_back(static_cast<Rank>(cell.first.i + cell.first.j) % 2);
  const SectorMap map = map_of(division, owners, 1);
  EXPECT_LE(map.owners().size(), kMapRunsMax);
  for (std::size_t n = 0; n < owners.size(); ++n) {
    if (division.cells[n].cost > 1) {
      EXPECT_EQ(map.owner(division.cells[n].first), owners[n]);
    }
  }
}

TEST(Cells, KnowTheirNeighbours) {
  Division division;
  division.parts = {1};
  division.cells = {{.first = {0, 0, 0}, .level = 1, .sectors = 4},
                    {.first = {0, 2, 0}, .sectors = 1},  // beside it
                    {.first = {0, 3, 0}, .sectors = 1},  // beside that
                    {.first = {2, 0, 0}, .level = 1, .sectors = 4},
                    {.first = {2, 0, 0}, .sectors = 1}};  // in that
  const std::vector<std::vector<CellBorder>> neighbours = neighbours_of(division);
  const auto cells_beside = [&](std::size_t cell) {
    std::vector<std::size_t> cells;
    for (const CellBorder& neighbour : neighbours[cell]) cells.push_back(neighbour.cell);
    return cells;
  };
  EXPECT_THAT(cells_beside(0), ElementsAre(1, 3, 4));
  EXPECT_THAT(cells_beside(1), ElementsAre(0, 2));
  EXPECT_THAT(cells_beside(2), ElementsAre(1));
  EXPECT_THAT(cells_beside(3), ElementsAre(0, 4));
  EXPECT_EQ(neighbours[0][1].border, 4u);
  EXPECT_EQ(neighbours[0][0].border, 1u);
}

}  // namespace
}  // namespace tessera
