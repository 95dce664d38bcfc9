// Eq. (1) and Eq. (2) of the paper as properties: positions lose nothing, wherever they are.
#include "lpss/grid/world_position.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace tessera {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kIndexMin = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kIndexMax = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kFar = std::int64_t{1} << 62;

const std::vector<double> kSectorSizes = {0.5, 1, 8, 10, 100.1, 128, 1.0 / 3, 788.3};

bool inside(const Eigen::Vector3d& local, double sector_size) {
  return (local.array() >= -sector_size / 2).all() && (local.array() < sector_size / 2).all();
}

// Displacements of all magnitudes, and those around borders where rounding decides.
std::vector<double> displacements(double sector_size) {
  std::vector<double> result = {0.0, -0.0, sector_size, -sector_size, 5e-324, -5e-324};
  for (double sectors : {0.5, 1.5, 2.5, 1e3 + 0.5, 1e9 + 0.5, 1e15 + 0.5}) {
    const double border = sectors * sector_size;
    for (double x : {border, std::nextafter(border, 0), std::nextafter(border, INFINITY)}) {
      result.push_back(x);
      result.push_back(-x);
    }
  }
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> mantissa(-1, 1);
  for (int exponent = -40; exponent <= 50; ++exponent) {
    for (int n = 0; n < 50; ++n) result.push_back(std::ldexp(mantissa(random), exponent) * sector_size);
  }
  return result;
}

TEST(WorldPosition, LocalDisplacementIsAlwaysInsideTheSector) {
  for (double sector_size : kSectorSizes) {
    for (double x : displacements(sector_size)) {
      const auto position = canonical({}, {x, -x, x / 3}, sector_size);
      ASSERT_TRUE(position.ok()) << position.status();
      EXPECT_TRUE(inside(position->local, sector_size)) << "x = " << x << " L = " << sector_size;
    }
  }
}

TEST(WorldPosition, RoundTripIsExact) {
  for (double sector_size : kSectorSizes) {
    for (double x : displacements(sector_size)) {
      const auto position = canonical({}, {x, 0, -x}, sector_size);
      ASSERT_TRUE(position.ok()) << position.status();
      const Eigen::Vector3d back = relative_to(*position, {}, sector_size);
      EXPECT_EQ(back.x(), x) << "L = " << sector_size;
      EXPECT_EQ(back.z(), -x) << "L = " << sector_size;
    }
  }
}

TEST(WorldPosition, EquationOneAndTwoAgree) {
  for (double x : {-1000.0, -192.0, -191.5, -64.0, -63.75, 0.0, 63.75, 64.0, 191.5, 192.0, 1e6}) {
    const auto sectors = sectors_from({x, x, x}, 128);
    ASSERT_TRUE(sectors.ok());
    EXPECT_EQ(sectors->i, static_cast<std::int64_t>(std::floor(x / 128 + 0.5)));
    const auto position = canonical({}, {x, x, x}, 128);
    ASSERT_TRUE(position.ok());
    EXPECT_EQ(position->sector.j, sectors->j);
    EXPECT_EQ(position->local.y(), x - static_cast<double>(sectors->j) * 128);
  }
}

TEST(WorldPosition, CanonicalPositionComesBackBitForBit) {
  for (double sector_size : kSectorSizes) {
    const double half = sector_size / 2;
    for (double x : {-half, std::nextafter(half, 0), -0.0, half / 3, 5e-324}) {
      const auto position = canonical({7, -kFar, kFar}, {x, x, x}, sector_size);
      ASSERT_TRUE(position.ok());
      EXPECT_EQ(position->sector, (SectorIndex{7, -kFar, kFar}));
      EXPECT_EQ(position->local, Eigen::Vector3d(x, x, x));
      EXPECT_EQ(std::signbit(position->local.x()), std::signbit(x));
    }
  }
}

TEST(WorldPosition, UpperEndOfASectorBelongsToTheNextOne) {
  const auto position = canonical({}, {64, -64, 192}, 128);
  ASSERT_TRUE(position.ok());
  EXPECT_EQ(position->sector, (SectorIndex{1, 0, 2}));
  EXPECT_EQ(position->local, Eigen::Vector3d(-64, -64, -64));
}

TEST(WorldPosition, DoesNotDependOnWhereInTheWorldItIs) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> metres(-1e4, 1e4);
  std::uniform_int_distribution<std::int64_t> index(-kFar, kFar);
  for (int n = 0; n < 2000; ++n) {
    const Eigen::Vector3d x(metres(random), metres(random), metres(random));
    const SectorIndex far{index(random), n % 2 == 0 ? kFar : -kFar, index(random)};
    const auto near_position = canonical({}, x, 100.1);
    const auto far_position = canonical(far, x, 100.1);
    ASSERT_TRUE(near_position.ok() && far_position.ok());
    EXPECT_EQ(far_position->local, near_position->local);
    EXPECT_EQ(relative_to(*far_position, far, 100.1), x);
    EXPECT_EQ(metres_between(far, far_position->sector, 100.1),
              metres_between({}, near_position->sector, 100.1));
  }
}

TEST(WorldPosition, RefusesWhatIsNotFinite) {
  for (double bad : {std::nan(""), static_cast<double>(INFINITY), -static_cast<double>(INFINITY)}) {
    const auto position = canonical({}, {0, bad, 0}, 128);
    EXPECT_EQ(position.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(position.status().message()), HasSubstr("position y"));
  }
}

TEST(WorldPosition, RefusesToLeaveTheRange) {
  for (double bad : {1e30, -1e30, 1e308, 9.3e18 * 128}) {
    const auto position = canonical({}, {0, 0, bad}, 128);
    EXPECT_EQ(position.status().code(), absl::StatusCode::kOutOfRange) << bad;
    EXPECT_THAT(std::string(position.status().message()), HasSubstr("position z"));
  }
  // The displacement is small, but the sector has no neighbour.
  EXPECT_EQ(canonical({kIndexMax, 0, 0}, {64, 0, 0}, 128).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(canonical({kIndexMin, 0, 0}, {-65, 0, 0}, 128).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_TRUE(canonical({kIndexMax, kIndexMin, 0}, {63, -64, 0}, 128).ok());
}

TEST(WorldPosition, ReachesTheEndsOfTheRange) {
  const double edge = std::ldexp(1.0, 63);  // sectors of 1 m
  const auto lowest = canonical({}, {-edge, 0, 0}, 1);
  ASSERT_TRUE(lowest.ok()) << lowest.status();
  EXPECT_EQ(lowest->sector.i, kIndexMin);
  EXPECT_FALSE(canonical({}, {edge, 0, 0}, 1).ok());
  const auto highest = canonical({}, {std::nextafter(edge, 0), 0, 0}, 1);
  ASSERT_TRUE(highest.ok()) << highest.status();
  EXPECT_EQ(highest->sector.i, kIndexMax - 1023);
}

TEST(SectorIndex, MovesAndComesBack) {
  const SectorIndex sector{5, -7, kFar};
  const SectorOffset offset{-kFar, kFar, -3};
  const auto moved = translated(sector, offset);
  ASSERT_TRUE(moved.ok());
  const auto between = offset_between(sector, *moved);
  ASSERT_TRUE(between.ok());
  EXPECT_EQ(*between, offset);
}

TEST(SectorIndex, RefusesToOverflowAndNamesTheAxis) {
  const auto i = translated({kIndexMax, 0, 0}, {1, 0, 0});
  EXPECT_EQ(i.status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(i.status().message()), HasSubstr("component i"));
  const auto j = translated({0, kIndexMin, 0}, {0, -1, 0});
  EXPECT_THAT(std::string(j.status().message()), HasSubstr("component j"));
  const auto k = offset_between({0, 0, kIndexMin}, {0, 0, kIndexMax});
  EXPECT_EQ(k.status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(k.status().message()), HasSubstr("component k"));
}

TEST(SectorIndex, DistanceSaturates) {
  EXPECT_EQ(chebyshev_distance({1, 2, 3}, {1, 2, 3}), 0);
  EXPECT_EQ(chebyshev_distance({1, 2, 3}, {0, 3, 2}), 1);
  EXPECT_EQ(chebyshev_distance({kIndexMin, 0, 0}, {kIndexMax, 0, 0}), kIndexMax);
}

TEST(SectorIndex, MetresBetweenFarSectorsAreExact) {
  EXPECT_EQ(metres_between({kIndexMax - 1, kIndexMin, kFar}, {kIndexMax, kIndexMin + 2, kFar - 3}, 128),
            Eigen::Vector3d(128, 256, -384));
}

TEST(WorldPose, ComposesAcrossBorders) {
  const WorldPose frame{{{kFar, 0, 0}, {60, 0, 0}},
                        Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ()))};
  const auto pose = compose(frame, {{0, -10, 0}, Eigen::Quaterniond::Identity()}, 128);
  ASSERT_TRUE(pose.ok()) << pose.status();
  EXPECT_EQ(pose->position.sector, (SectorIndex{kFar + 1, 0, 0}));
  EXPECT_NEAR(pose->position.local.x(), -58, 1e-12);
  EXPECT_FALSE(compose({{{kIndexMax, 0, 0}, {60, 0, 0}}, Eigen::Quaterniond::Identity()},
                       {{10, 0, 0}, Eigen::Quaterniond::Identity()}, 128)
                   .ok());
}

TEST(Pose, InverseUndoes) {
  const Pose pose{{1, 2, 3}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
  const Pose none = pose * pose.inverse();
  EXPECT_LT(none.position.norm(), 1e-15);
  EXPECT_LT(none.orientation.angularDistance(Eigen::Quaterniond::Identity()), 1e-15);
  EXPECT_TRUE(Pose{}.is_identity());
}

}  // namespace
}  // namespace tessera
