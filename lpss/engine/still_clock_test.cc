#include "lpss/engine/still_clock.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(StillLimitsTest, SmallAndLargeBodiesMustMoveSlower) {
  const WorldSettings settings;
  const auto limits = [&](double extent, double radius) {
    return still_limits<double>(settings, extent, radius);
  };
  EXPECT_EQ(limits(1, 0.9).linear, settings.sleep_linear_speed);
  EXPECT_EQ(limits(1, 0.9).angular, settings.sleep_angular_speed);
  EXPECT_LT(limits(0.001, 0.001).linear, 0.001);
  EXPECT_LT(limits(0.1, 50).angular * 50, 0.2);
}

}  // namespace
}  // namespace tessera
