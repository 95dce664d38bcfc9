// Plans of who hosts what.
#include "coordinator/balance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "coordinator/limits.h"

namespace tessera {
namespace {

using testing::AllOf;
using testing::DoubleNear;
using testing::Each;
using testing::ElementsAre;
using testing::Ge;
using testing::Le;

constexpr SectorIndex kAnchor{};

// Sectors in a row, on the curve in the order of `i` where none is negative.
LoadPiece piece(std::int64_t i, double work, std::uint64_t bodies = 1) {
  return {.first = {i, 0, 0}, .level = 0, .work = work, .sectors = 1, .bodies = bodies};
}

ServerLoad load(std::vector<LoadPiece> pieces, double tick_us) {
  return {.pieces = std::move(pieces), .tick_us = tick_us};
}

TEST(Balance, OneServerHasAll) {
  const BalancePlan plan =
      plan_balance(SectorMap(kAnchor, {}, 1), std::vector{load({piece(0, 5), piece(1, 5)}, 1000)});
  EXPECT_FALSE(plan.moves());
  EXPECT_EQ(plan.map.epoch(), 1u);
}

TEST(Balance, EvenServersAreLeftAlone) {
  const SectorMap map(kAnchor, {{2, 0, 0}}, 1);
  const BalancePlan plan = plan_balance(
      map, std::vector{load({piece(0, 1), piece(1, 1)}, 1000), load({piece(2, 1), piece(3, 1)}, 1000)});
  EXPECT_FALSE(plan.moves());
  EXPECT_FALSE(plan.is_worth_it());
}

TEST(Balance, TheBusyServerGivesSectorsToItsNeighbourOnTheCurve) {
  const SectorMap map(kAnchor, {{4, 0, 0}}, 7);
  const BalancePlan plan =
      plan_balance(map, std::vector{load({piece(0, 1), piece(1, 1), piece(2, 1), piece(3, 1)}, 4000),
                                    load({piece(4, 0.5), piece(5, 0.5)}, 1200)});
  EXPECT_TRUE(plan.is_worth_it());
  EXPECT_THAT(plan.map.splitters(), ElementsAre(SectorIndex{3, 0, 0}));
  EXPECT_EQ(plan.map.epoch(), 8u);
  EXPECT_EQ(plan.moved_sectors, 1u);
  EXPECT_EQ(plan.moved_bodies, 1u);
  EXPECT_THAT(plan.tick_us, ElementsAre(4000, 1200));
  EXPECT_THAT(plan.tick_us_then, ElementsAre(3000, 2200));
}

TEST(Balance, ASlowServerHasLessToDo) {
  const SectorMap map(kAnchor, {{4, 0, 0}}, 1);
  std::vector<LoadPiece> first;
  std::vector<LoadPiece> second;
  for (int i = 0; i < 4; ++i) {
    first.push_back(piece(i, 1));
    second.push_back(piece(i + 4, 1));
  }
  const BalancePlan plan = plan_balance(map, std::vector{load(first, 3000), load(second, 1000)});
  EXPECT_TRUE(plan.is_worth_it());
  EXPECT_LT(plan.map.splitters()[0].i, 4);
}

// Of four sectors that take it 1 ms each, one is to go: the other, which has nothing, needs 3 ms for it.
TEST(Balance, AStrongServerHasMoreToDo) {
  const SectorMap map(kAnchor, {{4, 0, 0}}, 1);
  ServerLoad strong = load({piece(0, 1), piece(1, 1), piece(2, 1), piece(3, 1)}, 4000);
  strong.capacity = 3;
  const BalancePlan plan = plan_balance(map, std::vector{strong, load({}, 0)});
  EXPECT_TRUE(plan.moves());
  EXPECT_THAT(plan.map.splitters(), ElementsAre(SectorIndex{3, 0, 0}));
  EXPECT_THAT(plan.tick_us, ElementsAre(4000, 0));
  EXPECT_THAT(plan.tick_us_then, ElementsAre(DoubleNear(3000, 1e-6), DoubleNear(3000, 1e-6)));
  EXPECT_NEAR(plan.imbalance, 4.0 / 3, 1e-6) << "where all was shared out, both would take 3 ms";
}

TEST(Balance, TheLoadOfAWorldIsDividedByCapacity) {
  std::vector<std::pair<SectorIndex, double>> sectors;
  for (std::int64_t i = 0; i < 100; ++i) sectors.push_back({{i, 0, 0}, 1.0});
  for (const BalancePolicy policy : {BalancePolicy::kCurve, BalancePolicy::kKMeans}) {
    const SectorMap map = first_map(kAnchor, sectors, std::vector{1.0, 6.0, 3.0}, 1, policy);
    EXPECT_THAT(map.splitters(), ElementsAre(SectorIndex{10, 0, 0}, SectorIndex{70, 0, 0}));
  }
}

// By any policy that follows the load: 64 sectors alike, on servers that differ by up to four times.
TEST(Balance, ServersTakeEquallyLongWhateverTheirCapacity) {
  const SectorMap map(kAnchor, {{16, 0, 0}, {32, 0, 0}, {48, 0, 0}}, 1);
  const double capacities[] = {1, 2, 4, 1};
  std::vector<ServerLoad> loads;
  for (int rank = 0; rank < 4; ++rank) {
    std::vector<LoadPiece> pieces;
    for (int i = 0; i < 16; ++i) pieces.push_back(piece(16 * rank + i, 1));
    loads.push_back({std::move(pieces), 16'000 / capacities[rank], capacities[rank]});
  }
  for (const BalancePolicy policy : kBalancePolicies) {
    if (!follows_load(policy)) continue;
    const BalancePlan plan = plan_balance(map, loads, policy);
    EXPECT_THAT(plan.tick_us_then, Each(AllOf(Ge(7000), Le(9000)))) << name_of(policy);
  }
}

TEST(Balance, LittleIsGainedByLittleWork) {
  const SectorMap map(kAnchor, {{4, 0, 0}}, 1);
  const BalancePlan plan = plan_balance(
      map, std::vector{load({piece(0, 1), piece(1, 1), piece(2, 1), piece(3, 1)}, 100), load({}, 0)});
  EXPECT_TRUE(plan.moves()) << "on demand";
  EXPECT_FALSE(plan.is_worth_it());
}

TEST(Balance, BeforeAnyMeasurementWorkCounts) {
  const SectorMap map(kAnchor, {{4, 0, 0}}, 1);
  const BalancePlan plan = plan_balance(
      map, std::vector{load({piece(0, 1), piece(1, 1), piece(2, 1), piece(3, 1)}, 0), load({}, 0)});
  EXPECT_THAT(plan.map.splitters(), ElementsAre(SectorIndex{2, 0, 0}));
  EXPECT_FALSE(plan.is_worth_it());
}

TEST(Balance, EveryPolicyMovesABoundedNumberAtATime) {
  for (const BalancePolicy policy : kBalancePolicies) {
    SectorMap map(kAnchor, {{100, 0, 0}}, 1);
    std::uint64_t most = 0;
    int plans = 0;
    for (; plans < 100; ++plans) {
      std::vector<ServerLoad> loads(2);
      for (int i = 0; i < 20; ++i) {
        ServerLoad& owner = loads[map.owner({i, 0, 0})];
        owner.pieces.push_back(piece(i, 1, kMovedAtOnceMax / 4));
        owner.tick_us += 1000;
      }
      const BalancePlan plan = plan_balance(map, loads, policy);
      if (!plan.moves()) break;
      most = std::max(most, plan.moved_sectors + plan.moved_bodies);
      map = plan.map;
    }
    EXPECT_LE(most, kMovedAtOnceMax) << name_of(policy);
    EXPECT_GE(plans, 3) << name_of(policy);
    EXPECT_LE(plans, 6) << name_of(policy);
  }
}

TEST(Balance, AWorldIsLoadedInRunsOfTheCurveOrInTheBoxesOfTheGrid) {
  std::vector<std::pair<SectorIndex, double>> load;
  for (std::int64_t i = 0; i < 6; ++i) {
    for (std::int64_t j = 0; j < 6; ++j) load.push_back({{i, j, 0}, i < 2 && j < 2 ? 100.0 : 1.0});
  }
  const SectorMap grid = first_map(kAnchor, load, std::vector(4, 1.0), 3, BalancePolicy::kGrid);
  EXPECT_EQ(grid.epoch(), 3u);
  for (const auto& [sector, weight] : load) {
    EXPECT_EQ(grid.owner(sector), 2 * (sector.i / 3) + sector.j / 3) << to_string(sector);
  }
  for (const BalancePolicy policy : {BalancePolicy::kCurve, BalancePolicy::kGraph}) {
    EXPECT_EQ(first_map(kAnchor, load, std::vector(4, 2.0), 3, policy).splitters(),
              SectorMap::balanced(kAnchor, load, 4, 3).splitters());
  }
}

TEST(Balance, ManyBodiesMoveInSeveralPlansThatEachGoTheSameWay) {
  const std::uint64_t bodies = kMovedAtOnceMax / 4;
  const SectorMap start(kAnchor, {{20, 0, 0}}, 1);
  SectorMap map = start;
  int plans = 0;
  for (double slowest = 20'000; plans < 20; ++plans) {
    std::vector<ServerLoad> loads(2);
    for (int i = 0; i < 20; ++i) {
      ServerLoad& owner = loads[map.owner({i, 0, 0})];
      owner.pieces.push_back(piece(i, 1, bodies));
      owner.tick_us += 1000;
    }
    const BalancePlan plan = plan_balance(map, loads);
    if (!plan.moves()) break;
    EXPECT_THAT(plan.moved_sectors + plan.moved_bodies, Le(kMovedAtOnceMax));
    const double next = *std::max_element(plan.tick_us_then.begin(), plan.tick_us_then.end());
    EXPECT_LT(next, slowest);
    slowest = next;
    map = plan.map;
  }
  EXPECT_EQ(plans, 4);
  EXPECT_THAT(map.splitters(), ElementsAre(SectorIndex{10, 0, 0}));
}

// Loads of any kind give maps that are maps, and none makes the slowest server slower.
TEST(Balance, NeverMakesItWorse) {
  std::mt19937 random(3);
  for (int n = 0; n < 2000; ++n) {
    const auto servers = static_cast<std::uint32_t>(1 + random() % 6);
    std::vector<SectorIndex> splitters;
    for (std::uint32_t s = 1; s < servers; ++s)
      splitters.push_back(
          {static_cast<std::int64_t>(random() % 40), static_cast<std::int64_t>(random() % 4), 0});
    std::sort(splitters.begin(), splitters.end(), [](const SectorIndex& a, const SectorIndex& b) {
      return comes_before_on_curve(a, b, kAnchor);
    });
    const SectorMap map(kAnchor, splitters, 1);
    std::vector<ServerLoad> loads(servers);
    for (int p = static_cast<int>(random() % 60); p > 0; --p) {
      const SectorIndex first{static_cast<std::int64_t>(random() % 40),
                              static_cast<std::int64_t>(random() % 4), 0};
      // Projected load may be another server's.
      ServerLoad& from = loads[random() % 4 == 0 ? random() % servers : map.owner(first)];
      const auto level = static_cast<unsigned>(random() % 4 == 0 ? random() % 4 : 0);
      from.pieces.push_back({first, level, static_cast<double>(random() % 5), 1, random() % 2000});
    }
    for (ServerLoad& load : loads) {
      for (const LoadPiece& piece : load.pieces) load.tick_us += 100 * piece.work;
    }
    for (const BalancePolicy policy : kBalancePolicies) {
      const BalancePlan plan = plan_balance(map, loads, policy);
      ASSERT_EQ(plan.map.servers(), servers);
      ASSERT_TRUE(SectorMap::checked(kAnchor, plan.map.splitters(), plan.map.owners(), servers, 1).ok());
      if (follows_load(policy)) {
        ASSERT_LE(plan.slowest_then, 1) << name_of(policy);
      }
      ASSERT_EQ(plan.map.epoch(), plan.moves() ? 2u : 1u);
      const auto sum = [](const std::vector<double>& us) {
        return std::accumulate(us.begin(), us.end(), 0.0);
      };
      ASSERT_NEAR(sum(plan.tick_us), sum(plan.tick_us_then), 1e-6);
    }
  }
}

// What the others have stays where it is.
TEST(Departure, GivesWhatAServerHasToTheOthers) {
  const SectorMap map(kAnchor, {{2, 0, 0}, {4, 0, 0}}, 3);
  const std::vector loads{load({piece(0, 1), piece(1, 1)}, 2000), load({piece(2, 1), piece(3, 1)}, 2000),
                          load({piece(4, 1), piece(5, 1)}, 2000)};
  for (const BalancePolicy policy : kBalancePolicies) {
    const DeparturePlan plan = plan_departure(map, loads, 1, policy, /*at_once=*/true);
    EXPECT_TRUE(plan.is_last);
    EXPECT_EQ(plan.moved_sectors, 2u);
    EXPECT_EQ(plan.moved_bodies, 2u);
    EXPECT_EQ(plan.map.epoch(), 4u);
    for (const std::int64_t i : {0, 1}) EXPECT_EQ(plan.map.owner({i, 0, 0}), 0u) << name_of(policy);
    for (const std::int64_t i : {2, 3}) EXPECT_NE(plan.map.owner({i, 0, 0}), 1u) << name_of(policy);
    for (const std::int64_t i : {4, 5}) EXPECT_EQ(plan.map.owner({i, 0, 0}), 2u) << name_of(policy);
  }
}

TEST(Departure, OfAServerWithoutSectorsIsDoneAtOnce) {
  const SectorMap map = with_another(SectorMap(kAnchor, {{2, 0, 0}}, 1));
  const std::vector loads{load({piece(0, 1)}, 1000), load({piece(2, 1)}, 1000), load({}, 0)};
  const DeparturePlan plan = plan_departure(map, loads, 2, BalancePolicy::kCurve, /*at_once=*/false);
  EXPECT_TRUE(plan.is_last);
  EXPECT_EQ(plan.moved_sectors, 0u);
  EXPECT_EQ(without(plan.map, 2).servers(), 2u);
}

// Whatever the loads and the policy: in steps of bounded size, until nothing in the world is the leaver's.
TEST(Departure, EndsInAMapWithoutTheServer) {
  std::mt19937 random(5);
  for (int n = 0; n < 500; ++n) {
    const auto servers = static_cast<std::uint32_t>(2 + random() % 5);
    SectorMap map = SectorMap::scattered(kAnchor, servers, random(), 1);
    if (n % 2 == 0) {
      std::vector<SectorIndex> splitters;
      for (std::uint32_t s = 1; s < servers; ++s)
        splitters.push_back({static_cast<std::int64_t>(6 * s), 0, 0});
      map = SectorMap(kAnchor, splitters, 1);
    }
    const Rank leaver = static_cast<Rank>(random() % servers);
    const BalancePolicy policy = kBalancePolicies[random() % std::size(kBalancePolicies)];
    std::vector<std::uint64_t> bodies(40);
    for (std::uint64_t& of_sector : bodies) of_sector = random() % 3 == 0 ? 0 : random() % 4000;
    for (int steps = 0;; ++steps) {
      ASSERT_LT(steps, 100);
      std::vector<ServerLoad> loads(servers);
      for (int i = 0; i < 40; ++i) {
        if (bodies[i] > 0) loads[map.owner({i, 0, 0})].pieces.push_back(piece(i, 1, bodies[i]));
      }
      const DeparturePlan plan = plan_departure(map, loads, leaver, policy, /*at_once=*/false);
      ASSERT_TRUE(
          SectorMap::checked(kAnchor, plan.map.splitters(), plan.map.owners(), servers, plan.map.epoch())
              .ok());
      for (int i = 0; i < 40; ++i) {
        const Rank before = map.owner({i, 0, 0});
        if (bodies[i] > 0 && before != leaver) {
          ASSERT_EQ(plan.map.owner({i, 0, 0}), before) << name_of(policy);
        }
      }
      map = plan.map;
      if (plan.is_last) break;
      ASSERT_GT(plan.moved_sectors, 0u);
    }
    for (int i = 0; i < 40; ++i) ASSERT_NE(map.owner({i, 0, 0}), leaver);
    EXPECT_EQ(without(map, leaver).servers(), servers - 1);
  }
}

}  // namespace
}  // namespace tessera
