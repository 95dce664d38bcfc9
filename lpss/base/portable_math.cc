#include "lpss/base/portable_math.h"

#include <sleef.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tessera::portable {

SinCos sincos(double angle) {
  const Sleef_double_2 both = Sleef_cinz_sincosd1_u10purec(angle);
  return {both.x, both.y};
}

SinCos sincos_degrees(double angle) {
  int quarters = 0;
  const double rest = std::remquo(angle, 90, &quarters);  // exact; the last bits of the quotient suffice
  const SinCos turned = sincos(rest * (std::numbers::pi / 180));
  switch (quarters & 3) {
    case 0:
      return turned;
    case 1:
      return {turned.cos, -turned.sin};
    case 2:
      return {-turned.sin, -turned.cos};
    default:
      return {-turned.cos, turned.sin};
  }
}

double hypot(double x, double y) {
  const double a = std::max(std::abs(x), std::abs(y));
  const double b = std::min(std::abs(x), std::abs(y));
  if (std::isinf(x) || std::isinf(y)) return std::numeric_limits<double>::infinity();
  if (b == 0 || std::isnan(x) || std::isnan(y)) return std::abs(x) + std::abs(y);
  // Scaled by a power of two, neither square leaves the range. A side that is lost in it changes nothing.
  const int exponent = std::ilogb(a);
  const double p = std::ldexp(a, -exponent);
  const double q = std::ldexp(b, -exponent);
  // The corrected algorithm without fused operations of Borges ("An Improved Algorithm for hypot(a,b)",
  // 2019).
  const double root = std::sqrt(p * p + q * q);
  const bool is_wide = root <= 2 * q;
  const double more = root - (is_wide ? q : p);
  const double first = is_wide ? p * (2 * more - p) : 2 * more * (p - 2 * q);
  const double second = is_wide ? (more - 2 * (p - q)) * more : (4 * more - q) * q + more * more;
  return std::ldexp(root - (first + second) / (2 * root), exponent);
}

double asin(double x) { return Sleef_cinz_asind1_u10purec(x); }
double atan2(double y, double x) { return Sleef_cinz_atan2d1_u10purec(y, x); }
double pow(double base, double exponent) { return Sleef_cinz_powd1_u10purec(base, exponent); }

}  // namespace tessera::portable
