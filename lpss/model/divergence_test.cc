// What counts as divergence.
#include "lpss/model/divergence.h"

#include <gtest/gtest.h>

#include <limits>

#include "lpss/model/limits.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

TEST(Divergence, IsWhatIsNotFinite) {
  EXPECT_EQ(divergence_of({0, kNoNumber, 0}, Vector3d::Zero(), 1), DivergenceKind::kVelocity);
  EXPECT_EQ(divergence_of({0, 0, -kEndless}, Vector3d::Zero(), 1), DivergenceKind::kVelocity);
  EXPECT_EQ(divergence_of(Vector3d::Zero(), {kNoNumber, 0, 0}, 1), DivergenceKind::kVelocity);
}

TEST(Divergence, IsEnergyThatJointsGainWhereASolverSaysSo) {
  const Vector3d gained = velocity_of_gained_energy();
  EXPECT_EQ(divergence_of(gained, gained, 1), DivergenceKind::kEnergy);
  EXPECT_EQ(divergence_of(gained, Vector3d::Zero(), 1), DivergenceKind::kVelocity);
  EXPECT_EQ(divergence_of(gained, -gained, 1), DivergenceKind::kVelocity);
}

TEST(Divergence, IsWhatIsTooFast) {
  EXPECT_EQ(divergence_of({kSpeedMax, 0, 0}, Vector3d::Zero(), 1), std::nullopt);
  EXPECT_EQ(divergence_of({1.01 * kSpeedMax, 0, 0}, Vector3d::Zero(), 1), DivergenceKind::kSpeed);
  EXPECT_EQ(divergence_of({1e300, 0, 0}, Vector3d::Zero(), 1), DivergenceKind::kSpeed);
}

TEST(Divergence, ABodyMayTurnAsCommandsMaySay) {
  EXPECT_EQ(divergence_of(Vector3d::Zero(), {kAngularSpeedMax, 0, 0}, 500), std::nullopt);
  EXPECT_EQ(divergence_of(Vector3d::Zero(), {2 * kAngularSpeedMax, 0, 0}, 500), DivergenceKind::kSpeed);
}

TEST(Divergence, ASmallBodyMayTurnFaster) {
  EXPECT_EQ(divergence_of(Vector3d::Zero(), {1e9, 0, 0}, 1e-4), std::nullopt);
  EXPECT_EQ(divergence_of(Vector3d::Zero(), {1e11, 0, 0}, 1e-4), DivergenceKind::kSpeed);
}

}  // namespace
}  // namespace tessera
