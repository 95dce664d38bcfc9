#include "lpss/base/portable_math.h"

#include <sleef.h>

#include <cmath>
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

double asin(double x) { return Sleef_cinz_asind1_u10purec(x); }
double atan2(double y, double x) { return Sleef_cinz_atan2d1_u10purec(y, x); }
double pow(double base, double exponent) { return Sleef_cinz_powd1_u10purec(base, exponent); }

}  // namespace tessera::portable
