#include "coordinator/consolidation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "coordinator/limits.h"

namespace tessera {
namespace {

constexpr std::chrono::duration<double> kTimeStep(1.0 / 60);

// A world of sectors in a row that take equally long, on servers that the map divides it among.
struct World {
  double alone_us = 800;  // a tick on one server
  double doubled = 1.6;   // the work of all servers by that, divided
  double wait_us = 600;   // divided, of each server
  int servers = 2;
  std::uint64_t bodies_per_sector = 10;
  double capacity_of_last = 1;
  std::optional<std::chrono::duration<double>> period{};

  SectorMap map = SectorMap({}, {{8, 0, 0}}, 1);
  Consolidation consolidation{};
  int moves = 0;

  bool is_divided() const {
    for (std::int64_t i = 1; i < kSectors; ++i) {
      if (map.owner({i, 0, 0}) != map.owner({0, 0, 0})) return true;
    }
    return false;
  }

  std::vector<ServerLoad> loads() const {
    std::vector<ServerLoad> loads(servers);
    loads.back().capacity = capacity_of_last;
    const double sector_us = alone_us * (is_divided() ? doubled : 1) / kSectors;
    for (std::int64_t i = 0; i < kSectors; ++i) {
      const Rank owner = map.owner({i, 0, 0});
      loads[owner].pieces.push_back(
          {.first = {i, 0, 0}, .work = 1, .sectors = 1, .bodies = bodies_per_sector});
      loads[owner].tick_us += sector_us / loads[owner].capacity;
      if (is_divided()) loads[owner].wait_us = wait_us;
    }
    // One that works less waits for the others' work, too.
    double slowest = 0;
    for (const ServerLoad& load : loads) slowest = std::max(slowest, load.tick_us);
    if (is_divided()) {
      for (ServerLoad& load : loads) load.wait_us += slowest - load.tick_us;
    }
    return loads;
  }

  double tick_us() const {
    double tick = 0;
    for (const ServerLoad& load : loads()) tick = std::max(tick, load.tick_us);
    return is_divided() ? tick + wait_us : tick;
  }

  BalancePlan look() {
    BalancePlan plan = consolidation.next(map, loads(), BalancePolicy::kCurve, kTimeStep, period);
    if (plan.moves()) ++moves;
    map = plan.map;
    return plan;
  }

  void look_often(int times) {
    for (int n = 0; n < times; ++n) look();
  }

  static constexpr std::int64_t kSectors = 16;
};

TEST(Consolidation, AWorldThatIsDoneSoonerOnOneServerGoesThereAndStays) {
  World world;
  EXPECT_NEAR(world.tick_us(), 1240, 1);
  const BalancePlan plan = world.look();
  EXPECT_TRUE(plan.consolidates);
  EXPECT_EQ(plan.moved_sectors, 8u);
  EXPECT_EQ(plan.moved_bodies, 80u);
  EXPECT_EQ(plan.wait_us, 600);
  EXPECT_EQ(plan.map.epoch(), 2u);
  EXPECT_FALSE(world.is_divided());
  EXPECT_EQ(world.tick_us(), 800);
  world.look_often(50);
  EXPECT_EQ(world.moves, 1);
}

TEST(Consolidation, ItIsDividedAgainOnceItHasMoreToDo) {
  World world;
  world.look_often(3);
  world.alone_us = 4000;
  world.wait_us = 300;
  world.doubled = 1.1;
  world.look();
  EXPECT_TRUE(world.is_divided());
  world.look_often(50);
  EXPECT_EQ(world.moves, 2);
}

// That servers waited long may have been due to something else, such as another process on their machine.
TEST(Consolidation, WhatIsOnOneServerIsDividedAgainNowAndThen) {
  World world;
  world.alone_us = 2000;
  world.wait_us = 5000;
  world.look();
  EXPECT_FALSE(world.is_divided());
  world.wait_us = 50;
  world.doubled = 1;
  world.look_often(300);
  EXPECT_TRUE(world.is_divided());
  EXPECT_EQ(world.moves, 2);
}

// Its work seems to be done twice in part, so that it is tried once.
TEST(Consolidation, WhatIsNotDoneSoonerOnOneServerComesBackForGood) {
  World world{.alone_us = 2000, .doubled = 1, .wait_us = 600};
  EXPECT_EQ(world.tick_us(), 1600);
  EXPECT_TRUE(world.look().consolidates);
  EXPECT_EQ(world.tick_us(), 2000);
  world.look();
  EXPECT_TRUE(world.is_divided());
  world.look_often(100);
  EXPECT_EQ(world.moves, 2);
}

TEST(Consolidation, WhatOneServerWouldHaveALotToDoWithIsNotTried) {
  World world{.alone_us = 20'000, .doubled = 1, .wait_us = 6000};
  world.look_often(20);
  EXPECT_EQ(world.moves, 0);
  world.doubled = 1.5;
  world.wait_us = 20'000;
  EXPECT_TRUE(world.look().consolidates) << "in no case longer than now";
}

TEST(Consolidation, WhatKeepsItsPaceEasilyStaysWhereItIs) {
  World world;
  world.period = kTimeStep;
  world.look_often(3);
  EXPECT_EQ(world.moves, 0);
  world.period = kTimeStep / 4;  // of which a tick takes a third
  EXPECT_TRUE(world.look().consolidates);
}

TEST(Consolidation, AWorldThatGainsByBeingDividedStaysSo) {
  World world{.alone_us = 5000, .doubled = 1.1, .wait_us = 300};
  world.look_often(20);
  EXPECT_EQ(world.moves, 0);
}

// One server has nearly all of the work. The rest waits for it, and it for nobody.
TEST(Consolidation, AnUnevenWorldIsDividedAnewInstead) {
  World world{.alone_us = 5000, .doubled = 1, .wait_us = 100};
  world.map = SectorMap({}, {{15, 0, 0}}, 1);
  EXPECT_FALSE(world.look().consolidates);
  EXPECT_EQ(world.map.splitters().front().i, 8);
}

TEST(Consolidation, AllGoesToTheStrongestServer) {
  World world;
  world.capacity_of_last = 4;
  EXPECT_TRUE(world.look().consolidates);
  EXPECT_EQ(world.map.owner({0, 0, 0}), 1u);
}

TEST(Consolidation, OfManyServersToo) {
  World world{.doubled = 2.5, .wait_us = 1500, .servers = 4};
  world.map = SectorMap({}, {{4, 0, 0}, {8, 0, 0}, {12, 0, 0}}, 1);
  EXPECT_TRUE(world.look().consolidates);
  EXPECT_FALSE(world.is_divided());
}

TEST(Consolidation, WhatIsAtRestStaysWhereItIs) {
  World world;
  std::vector<ServerLoad> loads = world.loads();
  loads[0].pieces[3].work = 0;
  loads[1].pieces[7].work = 0;
  const BalancePlan plan = world.consolidation.next(world.map, loads, BalancePolicy::kCurve, kTimeStep, {});
  EXPECT_TRUE(plan.consolidates);
  EXPECT_EQ(plan.moved_sectors, 7u);
  EXPECT_NE(plan.map.owner({3, 0, 0}), plan.map.owner({15, 0, 0}));
}

TEST(Consolidation, NothingMovesThatIsTooMuchForOneTickOrTooLittleToCare) {
  World large{.bodies_per_sector = kMovedAtOnceMax / 4};
  large.look_often(5);
  EXPECT_EQ(large.moves, 0);
  World small{.alone_us = 20, .wait_us = 100};
  small.look_often(5);
  EXPECT_EQ(small.moves, 0);
}

TEST(Consolidation, NothingMovesWithoutWorkOrMeasurements) {
  World world;
  world.alone_us = 0;
  world.look_often(3);
  EXPECT_EQ(world.moves, 0);
  const std::vector<ServerLoad> asleep(2);
  EXPECT_FALSE(world.consolidation.next(world.map, asleep, BalancePolicy::kCurve, kTimeStep, {}).moves());
}

}  // namespace
}  // namespace tessera
