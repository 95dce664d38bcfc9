// Who is near a border, who is cloned where, and who changes home: at borders, edges and corners, on all axes
// and both sides.
#include "lpss/partition/near_seam.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kSize = 16;
constexpr double kHalf = kSize / 2;
constexpr double kLittle = 1e-9;  // m: just beside a border

// Bodies of 0.5 m radius, ticks of 1/64 s: hysteresis 1/32 m, reach 0.5 + 1/32 + 2/64 * 50 m, all exact.
const SeamMargins kMargins = seam_margins(kSize, 1.0 / 64, 0.5);

const Eigen::Vector3d kStill = Eigen::Vector3d::Zero();

std::vector<SectorOffset> members(const OffsetSet& set) {
  std::vector<SectorOffset> result;
  set.for_each([&](const SectorOffset& offset) { result.push_back(offset); });
  return result;
}

OffsetSet all_around() {
  const Eigen::Vector3d corner = Eigen::Vector3d::Constant(2 * kSize);
  return sectors_within_reach({-corner, corner}, kStill, kMargins);
}

Eigen::AlignedBox3d point(const Eigen::Vector3d& p) { return {p, p}; }

SectorOffset along(int axis, std::int64_t sectors) {
  SectorOffset offset;
  (axis == 0 ? offset.i : axis == 1 ? offset.j : offset.k) = sectors;
  return offset;
}

TEST(SeamMargins, AddUpRadiusHysteresisAndTheWayOfALateChange) {
  EXPECT_EQ(kMargins.sector_size, kSize);
  EXPECT_EQ(kMargins.hysteresis, 1.0 / 32);
  EXPECT_EQ(kMargins.reach, 0.5 + 1.0 / 32 + 100.0 / 64);
}

TEST(SeamMargins, AreBoundedByTheSector) {
  const SeamMargins margins = seam_margins(kSize, 0.1, 100);
  EXPECT_EQ(margins.reach, kSize / 2 + margins.hysteresis + kSize / 4);
}

TEST(SectorsWithinReach, AreNoneInTheMiddle) {
  EXPECT_THAT(members(sectors_within_reach(point({0, 0, 0}), kStill, kMargins)), IsEmpty());
}

TEST(SectorsWithinReach, BeginAtTheReachFromEachBorder) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      const Eigen::Vector3d out = side * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d limit = out * (kHalf - kMargins.reach);
      EXPECT_THAT(members(sectors_within_reach(point(limit), kStill, kMargins)),
                  ElementsAre(along(axis, side)));
      EXPECT_THAT(members(sectors_within_reach(point(limit - kLittle * out), kStill, kMargins)), IsEmpty());
    }
  }
}

TEST(SectorsWithinReach, AreThreeAtAnEdgeAndSevenAtACorner) {
  EXPECT_THAT(members(sectors_within_reach(point({7.9, -7.9, 0}), kStill, kMargins)),
              ElementsAre(SectorOffset{0, -1, 0}, SectorOffset{1, -1, 0}, SectorOffset{1, 0, 0}));
  EXPECT_THAT(members(sectors_within_reach(point({-7.9, -7.9, 7.9}), kStill, kMargins)),
              ElementsAre(SectorOffset{-1, -1, 0}, SectorOffset{-1, -1, 1}, SectorOffset{-1, 0, 0},
                          SectorOffset{-1, 0, 1}, SectorOffset{0, -1, 0}, SectorOffset{0, -1, 1},
                          SectorOffset{0, 0, 1}));
}

TEST(SectorsWithinReach, FollowABodyThatIsLateToLeaveItsHome) {
  EXPECT_THAT(members(sectors_within_reach(point({12, 0, 0}), kStill, kMargins)),
              ElementsAre(SectorOffset{1, 0, 0}));
}

TEST(SectorsWithinReach, AreTwoAwayAtMost) {
  const double second = 1.5 * kSize - kMargins.reach;
  EXPECT_TRUE(sectors_within_reach(point({0, second, 0}), kStill, kMargins).contains(0, 2, 0));
  EXPECT_FALSE(sectors_within_reach(point({0, second - kLittle, 0}), kStill, kMargins).contains(0, 2, 0));
  const OffsetSet all = all_around();
  EXPECT_EQ(members(all).size(), 124u);
  EXPECT_FALSE(all.contains(0, 0, 0)) << "the home itself";
}

TEST(SectorsWithinReach, AreThoseWhoseCubeTheGrownBoxMeets) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(-30, 30);
  std::uniform_real_distribution<double> extent(0, 12);
  for (int n = 0; n < 500; ++n) {
    const Eigen::Vector3d low(place(random), place(random), place(random));
    const Eigen::AlignedBox3d box(low, low + Eigen::Vector3d(extent(random), extent(random), extent(random)));
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(kMargins.reach);
    const Eigen::AlignedBox3d grown(box.min() - reach, box.max() + reach);
    const OffsetSet found = sectors_within_reach(box, kStill, kMargins);
    all_around().for_each([&](const SectorOffset& o) {
      const Eigen::Vector3d centre = kSize * Eigen::Vector3d(o.i, o.j, o.k);
      const Eigen::AlignedBox3d cube(centre - Eigen::Vector3d::Constant(kHalf),
                                     centre + Eigen::Vector3d::Constant(kHalf));
      ASSERT_EQ(found.contains(static_cast<int>(o.i), static_cast<int>(o.j), static_cast<int>(o.k)),
                grown.intersects(cube))
          << "(" << o.i << ", " << o.j << ", " << o.k << ")";
    });
  }
}

TEST(CloneTargets, AreAllOfThemForKinematicBodies) {
  const OffsetSet all = all_around();
  EXPECT_EQ(clone_targets(all, Motion::kKinematic, false), all);
}

TEST(CloneTargets, OfADynamicBodyAreOneOfEachPairOfOppositeSectors) {
  const OffsetSet down = clone_targets(all_around(), Motion::kDynamic, false);
  EXPECT_EQ(members(down).size(), 62u);
  down.for_each([&](const SectorOffset& o) {
    EXPECT_LT(o, SectorOffset{});
    EXPECT_FALSE(down.contains(-static_cast<int>(o.i), -static_cast<int>(o.j), -static_cast<int>(o.k)));
  });
}

TEST(SectorsWithinReach, OfAFastBodyAreThoseAlongItsWay) {
  const Eigen::AlignedBox3d start = point({1, -2, 3});
  const Eigen::Vector3d way(20.3 * kSize, -20.3 * kSize, 7.1 * kSize);
  Eigen::AlignedBox3d swept = start;
  swept.extend(start.min() + way);
  const OffsetSet found = sectors_within_reach(swept, way, kMargins);
  EXPECT_FALSE(found.contains(0, 0, 0)) << "the home itself";
  EXPECT_FALSE(found.contains(20, 0, 0)) << "off the way";
  EXPECT_LT(members(found).size(), 400u);
  for (int n = 0; n <= 1000; ++n) {
    const Eigen::Vector3d at = start.min() + way * (n / 1000.0);
    const SectorOffset sector = *sectors_from(at, kSize);
    EXPECT_TRUE(sector == SectorOffset{} || found.contains(sector)) << n;
  }
}

// A set that has one twice is refused by whoever is told of it.
TEST(SectorsWithinReach, OfAFastBodyAreEachOfThemOnce) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&](double size) {
    return Eigen::Vector3d(size * number(random), size * number(random), size * number(random));
  };
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d corner = vector(kSize / 2);
    const Eigen::AlignedBox3d start(corner, corner + vector(3 * kSize).cwiseAbs());
    Eigen::Vector3d way = vector(n % 2 == 0 ? 8 * kSize : 400 * kSize);
    if (n % 3 == 0) way[n % 2] = 0;
    Eigen::AlignedBox3d swept = start;
    swept.extend(start.translated(way));
    const OffsetSet found = sectors_within_reach(swept, way, kMargins);
    EXPECT_TRUE(OffsetSet::are_far(found.far())) << n;
  }
}

// Straight ways of two bodies that meet.
TEST(HomesOfSlower, HoldTheHomeOfEveryBodyThatMayBeMet) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> share(-1, 1);
  const auto direction = [&] {
    return Eigen::Vector3d(share(random), share(random), share(random)).normalized();
  };
  for (int n = 0; n < 2000; ++n) {
    const Eigen::Vector3d start = kHalf * Eigen::Vector3d(share(random), share(random), share(random));
    const Eigen::Vector3d way = direction() * std::abs(share(random)) * kChaseMax * kSize;
    Eigen::AlignedBox3d swept = point(start);
    swept.extend(start + way);
    const OffsetSet found = homes_of_slower(swept, way, kMargins);
    const Eigen::Vector3d slower = direction() * std::abs(share(random)) * way.norm();
    const double when = std::abs(share(random));
    const SectorOffset home = *sectors_from(start + when * (way - slower), kSize);
    EXPECT_TRUE(home == SectorOffset{} || found.contains(home)) << n;
  }
}

TEST(HomesOfSlower, AreFewAndNoneOfWhatGoesOverManySectors) {
  const Eigen::Vector3d way(kSize, 0, 0);
  EXPECT_LT(members(homes_of_slower({Eigen::Vector3d::Zero(), way}, way, kMargins)).size(), 30u);
  const Eigen::Vector3d far = 1.01 * kChaseMax * way;
  EXPECT_THAT(members(homes_of_slower({Eigen::Vector3d::Zero(), far}, far, kMargins)), IsEmpty());
}

TEST(CloneTargets, OfAFastBodyAreAllOfThem) {
  EXPECT_EQ(clone_targets(all_around(), Motion::kDynamic, true), all_around());
  EXPECT_FALSE(is_fast({kSeamSpeed / 64, 0, 0}, kMargins));
  EXPECT_TRUE(is_fast({0, kSeamSpeed / 63, 0}, kMargins));
}

TEST(CloneTargets, AddNothingThatIsNotWithinReach) {
  const OffsetSet near = sectors_within_reach(point({-7.9, 7.9, 0}), kStill, kMargins);
  EXPECT_THAT(members(clone_targets(near, Motion::kDynamic, false)),
              ElementsAre(SectorOffset{-1, 0, 0}, SectorOffset{-1, 1, 0}));
}

TEST(DetectingSector, IsTheLowerHomeOfTwoDynamicBodies) {
  const SectorIndex low{0, 0, -1};
  const SectorIndex high{0, 0, 0};
  EXPECT_EQ(detecting_sector(Motion::kDynamic, low, Motion::kDynamic, high), low);
  EXPECT_EQ(detecting_sector(Motion::kDynamic, high, Motion::kDynamic, low), low);
  EXPECT_EQ(detecting_sector(Motion::kDynamic, {-1, 9, 9}, Motion::kDynamic, {0, -9, -9}),
            (SectorIndex{-1, 9, 9}));
}

TEST(DetectingSector, IsTheHomeOfTheDynamicBodyWhereTheOtherOneIsNot) {
  const SectorIndex low{0, 0, -1};
  const SectorIndex high{0, 0, 0};
  for (const Motion other : {Motion::kStatic, Motion::kKinematic}) {
    EXPECT_EQ(detecting_sector(other, low, Motion::kDynamic, high), high);
    EXPECT_EQ(detecting_sector(Motion::kDynamic, high, other, low), high);
    EXPECT_EQ(detecting_sector(other, high, Motion::kDynamic, low), low);
  }
}

// What finds a contact must have a clone of the body that lives elsewhere.
TEST(DetectingSector, IsACloneTargetOfThePartner) {
  const SectorIndex home{100, -100, 3};
  const OffsetSet all = all_around();
  all.for_each([&](const SectorOffset& o) {
    const SectorIndex other = *translated(home, o);
    for (const Motion motion : {Motion::kDynamic, Motion::kKinematic}) {
      const SectorIndex& detecting = detecting_sector(Motion::kDynamic, home, motion, other);
      const bool here = detecting == home;
      const SectorOffset to = *offset_between(here ? other : home, detecting);
      const Motion cloned = here ? motion : Motion::kDynamic;
      EXPECT_TRUE(clone_targets(all, cloned, false)
                      .contains(static_cast<int>(to.i), static_cast<int>(to.j), static_cast<int>(to.k)));
    }
  });
}

TEST(LeavesHome, OnlyBeyondTheHysteresisOnEachAxisAndSide) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      const Eigen::Vector3d out = side * Eigen::Vector3d::Unit(axis);
      const double limit = kHalf + kMargins.hysteresis;
      EXPECT_EQ(leaves_home(out * kHalf, kMargins), std::nullopt);
      EXPECT_EQ(leaves_home(out * limit, kMargins), std::nullopt);
      EXPECT_EQ(leaves_home(out * (limit + kLittle), kMargins), along(axis, side));
    }
  }
}

TEST(LeavesHome, ABodyThatHasMovedDoesNotMoveBackAtOnce) {
  const double out = kHalf + kMargins.hysteresis + kLittle;
  ASSERT_EQ(leaves_home({-out, 0, 0}, kMargins), (SectorOffset{-1, 0, 0}));
  const double seen_from_there = -out + kSize;
  EXPECT_EQ(leaves_home({seen_from_there, 0, 0}, kMargins), std::nullopt);
  const double back = 2 * kMargins.hysteresis;
  EXPECT_EQ(leaves_home({seen_from_there + back, 0, 0}, kMargins), std::nullopt);
  EXPECT_EQ(leaves_home({seen_from_there + back + 2 * kLittle, 0, 0}, kMargins), (SectorOffset{1, 0, 0}));
}

// Each axis goes by the nearest sector once one of them is out.
TEST(LeavesHome, ForTheSectorThatHoldsThePosition) {
  EXPECT_EQ(leaves_home({9, 8.01, 0}, kMargins), (SectorOffset{1, 1, 0}));
  EXPECT_EQ(leaves_home({100, -100, 0}, kMargins), (SectorOffset{6, -6, 0}));
  EXPECT_EQ(leaves_home({24, -24, -40}, kMargins), (SectorOffset{2, -1, -2}));
}

TEST(LeavesHome, AFastBodyMovesToWhereItIsGoingToBe) {
  const Eigen::Vector3d fast(4, 0, 0);
  const Eigen::Vector3d usual(0.5, 0, 0);
  EXPECT_EQ(leaves_home({7, 0, 0}, fast, Motion::kDynamic, kMargins), (SectorOffset{1, 0, 0}));
  EXPECT_EQ(leaves_home({-9, 0, 0}, fast, Motion::kDynamic, kMargins), std::nullopt) << "it comes back";
  EXPECT_EQ(leaves_home({7.9, 0, 0}, usual, Motion::kDynamic, kMargins), std::nullopt);
  EXPECT_EQ(leaves_home({8.1, 0, 0}, -usual, Motion::kDynamic, kMargins), (SectorOffset{1, 0, 0}));
  EXPECT_EQ(leaves_home({7, 0, 0}, fast, Motion::kKinematic, kMargins), std::nullopt)
      << "it may be told to stop";
}

TEST(LeavesHome, NotWithAPositionThatIsNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(leaves_home({nan, 0, 0}, kMargins), std::nullopt);
  EXPECT_EQ(leaves_home({0, 0, std::numeric_limits<double>::infinity()}, kMargins), std::nullopt);
  EXPECT_EQ(leaves_home({0, 1e300, 0}, kMargins), std::nullopt);
}

TEST(SeenFrom, MovesThePositionAndNothingElse) {
  BodyState state;
  state.position = {1, 2, -3};
  state.linear_velocity = {4, 5, 6};
  state.still_for = 0.5;
  state.activity = Activity::kWantsSleep;
  const BodyState moved = seen_from(state, {1, -2, 0}, kSize);
  EXPECT_THAT(moved.position, ElementsAre(1 - 16, 2 + 32, -3));
  EXPECT_EQ(moved.linear_velocity, state.linear_velocity);
  EXPECT_EQ(moved.rotation, state.rotation);
  EXPECT_EQ(moved.still_for, state.still_for);
  EXPECT_EQ(moved.activity, state.activity);
  EXPECT_EQ(seen_from(moved, {-1, 2, 0}, kSize).position, state.position);
}

TEST(SweptBall, IsTheBoxAroundTheBallAtRest) {
  BodyState state;
  state.position = {1, -2, 3};
  const Eigen::AlignedBox3d box = swept_ball(state, 0.5, 1.0 / 64);
  EXPECT_EQ(box.min(), Eigen::Vector3d(0.5, -2.5, 2.5));
  EXPECT_EQ(box.max(), Eigen::Vector3d(1.5, -1.5, 3.5));
}

TEST(SweptBall, HoldsTheBallAtTheBeginningAndTheEndOfTheTick) {
  BodyState state;
  state.position = {1, -2, 3};
  state.linear_velocity = {64, -128, 0};
  const Eigen::AlignedBox3d box = swept_ball(state, 0.5, 1.0 / 64);
  EXPECT_EQ(box.min(), Eigen::Vector3d(0.5, -4.5, 2.5));
  EXPECT_EQ(box.max(), Eigen::Vector3d(2.5, -1.5, 3.5));
}

}  // namespace
}  // namespace tessera
