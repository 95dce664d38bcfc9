#include "lpss/base/portable_math.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace tessera {
namespace {

// Functions of 113 bits.
#if defined(__x86_64__)
using Quad = __float128;
extern "C" {  // in libquadmath, whose header only GCC finds
Quad asinq(Quad x);
Quad atanq(Quad x);
Quad atan2q(Quad y, Quad x);
Quad cosq(Quad x);
Quad fabsq(Quad x);
Quad hypotq(Quad x, Quad y);
Quad powq(Quad base, Quad exponent);
Quad sinq(Quad x);
}
#else
using Quad = long double;
static_assert(std::numeric_limits<Quad>::digits == 113);
Quad asinq(Quad x) { return std::asin(x); }
Quad atanq(Quad x) { return std::atan(x); }
Quad atan2q(Quad y, Quad x) { return std::atan2(y, x); }
Quad cosq(Quad x) { return std::cos(x); }
Quad fabsq(Quad x) { return std::abs(x); }
Quad hypotq(Quad x, Quad y) { return std::hypot(x, y); }
Quad powq(Quad base, Quad exponent) { return std::pow(base, exponent); }
Quad sinq(Quad x) { return std::sin(x); }
#endif

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kSamples = 100'000;

// The error of `got` in units of the last place of the exact value, which has 113 bits.
double ulps(double got, Quad exact) {
  const double rounded = std::abs(static_cast<double>(exact));
  const double ulp = std::nextafter(rounded, kInfinity) - rounded;
  return static_cast<double>(fabsq(got - exact)) / ulp;
}

// Of either sign, its magnitude spread evenly over the exponents from 2^low to 2^high.
class Spread {
 public:
  Spread(double low, double high) : exponent_(low, high) {}
  double operator()() {
    const double sign = (random_() & 1) != 0 ? -1 : 1;
    return sign * std::ldexp(1 + mantissa_(random_), static_cast<int>(std::floor(exponent_(random_))));
  }

 private:
  std::mt19937_64 random_{7};
  std::uniform_real_distribution<double> exponent_;
  std::uniform_real_distribution<double> mantissa_{0, 1};
};

void expect_sincos_below_one_ulp(double angle) {
  const portable::SinCos got = portable::sincos(angle);
  EXPECT_LT(ulps(got.sin, sinq(angle)), 1) << angle;
  EXPECT_LT(ulps(got.cos, cosq(angle)), 1) << angle;
}

TEST(PortableMath, SincosOfAnglesInUse) {
  Spread angles(-40, 6);
  for (int n = 0; n < kSamples; ++n) expect_sincos_below_one_ulp(angles());
}

TEST(PortableMath, SincosOfAllMagnitudes) {
  Spread angles(-1021, 1023);
  for (int n = 0; n < kSamples; ++n) expect_sincos_below_one_ulp(angles());
}

TEST(PortableMath, SincosNearMultiplesOfAQuarterTurn) {
  for (int quarters = -2000; quarters <= 2000; ++quarters) {
    double angle = quarters * (std::numbers::pi / 2);
    for (int step = 0; step < 3; ++step) angle = std::nextafter(angle, -kInfinity);
    for (int step = 0; step < 6; ++step) {
      if (angle != 0) expect_sincos_below_one_ulp(angle);
      angle = std::nextafter(angle, kInfinity);
    }
  }
  // The double that is nearest to a multiple of pi/2 (Muller et al., Handbook of Floating-Point Arithmetic).
  expect_sincos_below_one_ulp(std::ldexp(6381956970095103.0, 797));
}

TEST(PortableMath, SincosOfSpecialValues) {
  EXPECT_EQ(portable::sincos(0).sin, 0);
  EXPECT_EQ(portable::sincos(0).cos, 1);
  EXPECT_TRUE(std::signbit(portable::sincos(-0.0).sin));
  const double least = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(portable::sincos(least).sin, least);
  for (const double bad : {kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(std::isnan(portable::sincos(bad).sin));
    EXPECT_TRUE(std::isnan(portable::sincos(bad).cos));
  }
}

TEST(PortableMath, DegreesAreExactAtQuarterTurns) {
  for (int quarters = -8; quarters <= 8; ++quarters) {
    const portable::SinCos got = portable::sincos_degrees(90.0 * quarters);
    EXPECT_EQ(got.sin, (quarters % 2 == 0) ? 0 : ((quarters & 3) == 1 ? 1 : -1)) << quarters;
    EXPECT_EQ(got.cos, (quarters % 2 != 0) ? 0 : ((quarters & 3) == 0 ? 1 : -1)) << quarters;
  }
}

TEST(PortableMath, DegreesOfAnyAngle) {
  Spread angles(-30, 9);
  for (int n = 0; n < kSamples; ++n) {
    const double angle = angles();
    const Quad radians = angle * (atanq(1) / 45);
    const portable::SinCos got = portable::sincos_degrees(angle);
    // One rounding more: that of the conversion to rad.
    EXPECT_LT(ulps(got.sin, sinq(radians)), 2.5) << angle;
    EXPECT_LT(ulps(got.cos, cosq(radians)), 2.5) << angle;
  }
}

TEST(PortableMath, Asin) {
  Spread numbers(-60, 0);
  for (int n = 0; n < kSamples; ++n) {
    const double x = std::fmod(numbers(), 1);
    EXPECT_LT(ulps(portable::asin(x), asinq(x)), 1) << x;
  }
  EXPECT_EQ(portable::asin(1), std::numbers::pi / 2);
  EXPECT_EQ(portable::asin(-1), -std::numbers::pi / 2);
  EXPECT_TRUE(std::isnan(portable::asin(std::nextafter(1, 2))));
}

TEST(PortableMath, Atan2) {
  Spread numbers(-40, 40);
  for (int n = 0; n < kSamples; ++n) {
    const double y = numbers();
    const double x = numbers();
    EXPECT_LT(ulps(portable::atan2(y, x), atan2q(y, x)), 1) << y << ", " << x;
  }
}

TEST(PortableMath, Atan2OfSpecialValues) {
  const double pi = std::numbers::pi;
  EXPECT_EQ(portable::atan2(0, 1), 0);
  EXPECT_TRUE(std::signbit(portable::atan2(-0.0, 1)));
  EXPECT_EQ(portable::atan2(0, -1), pi);
  EXPECT_EQ(portable::atan2(-0.0, -1), -pi);
  EXPECT_EQ(portable::atan2(0, 0), 0);
  EXPECT_EQ(portable::atan2(0, -0.0), pi);
  EXPECT_EQ(portable::atan2(1, 0), pi / 2);
  EXPECT_EQ(portable::atan2(-1, 0), -pi / 2);
  EXPECT_EQ(portable::atan2(1, kInfinity), 0);
  EXPECT_EQ(portable::atan2(kInfinity, kInfinity), pi / 4);
  EXPECT_EQ(portable::atan2(kInfinity, -kInfinity), 3 * pi / 4);
  EXPECT_TRUE(std::isnan(portable::atan2(std::numeric_limits<double>::quiet_NaN(), 1)));
}

TEST(PortableMath, Hypot) {
  for (const double magnitude : {40.0, 1000.0}) {
    Spread numbers(-magnitude, magnitude);
    for (int n = 0; n < kSamples; ++n) {
      const double x = numbers();
      const double y = n % 2 == 0 ? numbers() : x * std::ldexp(numbers(), -1);
      if (std::isinf(y)) continue;
      EXPECT_LT(ulps(portable::hypot(x, y), hypotq(x, y)), 1) << x << ", " << y;
    }
  }
}

TEST(PortableMath, HypotOfSpecialValues) {
  const double least = std::numeric_limits<double>::denorm_min();
  const double most = std::numeric_limits<double>::max();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(portable::hypot(3, -4), 5);
  EXPECT_EQ(portable::hypot(0, 0), 0);
  EXPECT_FALSE(std::signbit(portable::hypot(-0.0, -0.0)));
  EXPECT_EQ(portable::hypot(-least, 0), least);
  EXPECT_EQ(portable::hypot(3 * least, 4 * least), 5 * least);
  EXPECT_EQ(portable::hypot(most, least), most);
  EXPECT_EQ(portable::hypot(most, most), kInfinity);
  EXPECT_EQ(portable::hypot(nan, -kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(portable::hypot(nan, 0)));
}

TEST(PortableMath, PowAsForDamping) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int n = 0; n < kSamples; ++n) {
    const double left = unit(random);
    const double step = unit(random) / 10;
    EXPECT_LT(ulps(portable::pow(left, step), powq(left, step)), 1) << left << ", " << step;
  }
  EXPECT_EQ(portable::pow(0, 0.01), 0);
  EXPECT_EQ(portable::pow(1, 0.01), 1);
  EXPECT_EQ(portable::pow(0.5, 0), 1);
}

}  // namespace
}  // namespace tessera
