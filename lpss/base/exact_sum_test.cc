#include "lpss/base/exact_sum.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace tessera {
namespace {

TEST(ExactSum, DoesNotDependOnTheOrder) {
  const std::vector<double> numbers = {1e18, -3.7e-9, 0.1, -1e18, 2.5, 1e-12, -0.1, 7e5};
  ExactSum forwards;
  ExactSum backwards;
  for (const double number : numbers) forwards.add(number);
  for (auto number = numbers.rbegin(); number != numbers.rend(); ++number) backwards.add(*number);
  EXPECT_EQ(forwards, backwards);
  EXPECT_NEAR(forwards.value(), 7e5 + 2.5 - 3.7e-9, 1e-11);
  ExactSum half;
  ExactSum other;
  for (std::size_t n = 0; n < numbers.size(); ++n) (n % 2 == 0 ? half : other).add(numbers[n]);
  half += other;
  EXPECT_EQ(half, forwards);
}

TEST(ExactSum, WhatIsNegativeIsExactToo) {
  ExactSum sum;
  for (int n = 0; n < 1000; ++n) sum.add(-0.5);
  EXPECT_EQ(sum.value(), -500);
}

TEST(ExactSum, BoundsWhatIsAdded) {
  ExactSum sum;
  sum.add(std::numeric_limits<double>::infinity());
  sum.add(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(sum.value(), 18446744073709551616.0);
  sum.add(-std::numeric_limits<double>::infinity());
  EXPECT_EQ(sum.value(), 0);
}

}  // namespace
}  // namespace tessera
