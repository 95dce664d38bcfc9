#include "simulator/tick_gaps.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

TEST(TickGapsTest, TheLongestTimeWithoutATickWithinAStepCounts) {
  TickGaps gaps;
  gaps.tick(5);  // of a world that runs by itself
  gaps.begin(100);
  gaps.tick(130);
  EXPECT_EQ(gaps.longest_ns(), 30u) << "until the first";
  gaps.tick(140);
  gaps.end(190);
  EXPECT_EQ(gaps.longest_ns(), 50u) << "after the last";
  gaps.begin(1000);
  gaps.end(1010);
  EXPECT_EQ(gaps.longest_ns(), 50u) << "nothing runs between two steps";
}

}  // namespace
}  // namespace tessera
