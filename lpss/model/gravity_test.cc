// The pull depends on where a body is relative to the planet, and on nothing else.
#include "lpss/model/gravity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tessera {
namespace {

constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
constexpr double kSize = 16;

// 8 m/s^2 at 1024 m: numbers whose quotients are exact.
CentralGravity planet_at(const SectorIndex& sector) { return {{sector, {0, 0, 0}}, 8, 1024}; }

TEST(UniformGravity, IsTheSameEverywhere) {
  const Eigen::Vector3d down(0.5, -1, -9.81);
  const Gravity gravity = UniformGravity{down};
  for (const SectorIndex& home : {SectorIndex{}, SectorIndex{kMin, kMax, 7}}) {
    EXPECT_EQ(acceleration_at(gravity, home, {1, 2, 3}, kSize), down);
  }
}

TEST(CentralGravity, HasItsSurfaceValueAtItsRadiusFromAllSides) {
  const Gravity gravity = planet_at({});
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d up = side * Eigen::Vector3d::Unit(axis);
      EXPECT_EQ(acceleration_at(gravity, {}, 1024 * up, kSize), -8 * up);
    }
  }
}

TEST(CentralGravity, FallsOffWithTheSquareOutsideAndLinearlyInside) {
  const Gravity gravity = planet_at({});
  const auto pull_at = [&](double x) { return acceleration_at(gravity, {}, {x, 0, 0}, kSize).x(); };
  EXPECT_EQ(pull_at(2048), -2);
  EXPECT_EQ(pull_at(4096), -0.5);
  EXPECT_EQ(pull_at(512), -4);
  EXPECT_EQ(pull_at(64), -0.5);
  EXPECT_EQ(pull_at(0), 0);
  EXPECT_NEAR(pull_at(1024 - 1e-9), -8, 1e-9);
}

TEST(CentralGravity, CountsSectorsAndDisplacementsTogether) {
  CentralGravity planet = planet_at({10, 0, -4});
  planet.centre.local = {2, -3, 1};
  // 64 sectors of 16 m are 1024 m.
  EXPECT_EQ(acceleration_at(planet, {74, 0, -4}, {2, -3, 1}, kSize), Eigen::Vector3d(-8, 0, 0));
  EXPECT_EQ(acceleration_at(planet, {10, -64, -4}, {2, -3, 1}, kSize), Eigen::Vector3d(0, 8, 0));
  EXPECT_EQ(acceleration_at(planet, {10, 0, 59}, {2, -3, 17}, kSize), Eigen::Vector3d(0, 0, -8));
}

TEST(CentralGravity, IsTheSameBitForBitWhereverInTheWorldThePlanetIs) {
  const Eigen::Vector3d position(1.0 / 3, -0.7, 5.1);
  const SectorOffset up{50, -41, 7};
  const Eigen::Vector3d here = acceleration_at(planet_at({}), {up.i, up.j, up.k}, position, kSize);
  for (const SectorIndex& centre : {SectorIndex{std::int64_t{1} << 62, 3, -(std::int64_t{1} << 62)},
                                    SectorIndex{kMax - 50, kMin + 41, kMax - 7}}) {
    const SectorIndex home = *translated(centre, up);
    EXPECT_EQ(acceleration_at(planet_at(centre), home, position, kSize), here);
  }
}

// One sector more is felt at a distance at which an absolute coordinate would not show it.
TEST(CentralGravity, DifferencesOfFarSectorsAreExact) {
  const CentralGravity planet = planet_at({kMax - 64, 0, 0});
  EXPECT_EQ(acceleration_at(planet, {kMax, 0, 0}, {0, 0, 0}, kSize).x(), -8);
  EXPECT_EQ(acceleration_at(planet, {kMax - 32, 0, 0}, {0, 0, 0}, kSize).x(), -4);
  EXPECT_EQ(acceleration_at(planet, {kMax - 128, 0, 0}, {0, 0, 0}, kSize).x(), 8);
}

TEST(CentralGravity, ReachesAcrossTheWholeWorld) {
  const Eigen::Vector3d pull = acceleration_at(planet_at({kMax, 0, 0}), {kMin, 0, 0}, {0, 0, 0}, kSize);
  const double distance = std::ldexp(kSize, 64);
  EXPECT_DOUBLE_EQ(pull.x(), 8 * (1024 / distance) * (1024 / distance));
  EXPECT_EQ(pull.y(), 0);
}

// In leapfrog, whose velocity changes by half of the pull before a tick and half of that after it.
TEST(CentralGravity, TheMeanPullOfAFlightIsThatOfLeapfrog) {
  const CentralGravity planet = planet_at({});
  constexpr double kStep = 0.5;
  const Eigen::Vector3d before(2000, 300, -100);
  const Eigen::Vector3d velocity(5, 60, 9);
  const Eigen::Vector3d pull = acceleration_from(planet, before);
  const Eigen::Vector3d now = before + velocity * kStep + pull * (kStep * kStep / 2);
  const Eigen::Vector3d mean = (pull + acceleration_from(planet, now)) / 2;
  EXPECT_LT((mean_pull(planet, now, velocity + mean * kStep, kStep) - mean).norm(), 1e-15);
  EXPECT_LT((mean_pull(planet, before, Eigen::Vector3d::Zero(), 0) - pull).norm(), 1e-15) << "at rest";
}

TEST(CentralGravity, ItsGradientIsTheFirstOrderOfDifferences) {
  const CentralGravity planet = planet_at({});
  const Eigen::Vector3d beyond(1e-3, -2e-3, 3e-3);
  for (const double distance : {300.0, 3000.0}) {
    const Eigen::Vector3d place = distance * Eigen::Vector3d(2, -1, 2) / 3;
    const Eigen::Vector3d exact = difference_from(planet, place, beyond);
    EXPECT_LT((gradient_at(planet, place) * beyond - exact).norm(), 1e-5 * exact.norm()) << distance;
  }
}

}  // namespace
}  // namespace tessera
