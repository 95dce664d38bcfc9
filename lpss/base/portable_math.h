// Elementary functions with the same bits on every processor.
//
// The C library has several versions of sin, atan2, pow and most others, and chooses by processor; their last
// bits differ. Whatever takes part in the state of a world uses these instead. Addition, multiplication,
// division, sqrt, fma, remainder and rint are correctly rounded everywhere and need no replacement.
//
// Most are SLEEF's reproducible functions (Shibata and Petrogalli, "SLEEF: A Portable Vectorized Library of C
// Standard Mathematical Functions", 2020): arithmetic in a fixed order without fused multiply-add. The bits
// are those of the library's version, so all servers of a cluster need the same one; arithmetic_fingerprint()
// tells.
//
// Errors are below 1 ulp for every finite argument. Special values are those of the C standard.
#pragma once

namespace tessera::portable {

struct SinCos {
  double sin = 0;
  double cos = 1;
};

// `angle` in rad; NaN for infinite ones.
SinCos sincos(double angle);

// `angle` in degrees; exact at multiples of 90, elsewhere below 2.5 ulp.
SinCos sincos_degrees(double angle);

double hypot(double x, double y);  // sqrt(x^2 + y^2), below 1 ulp
double asin(double x);             // rad; NaN beyond -1 to 1
double atan2(double y, double x);  // rad, -pi to pi
double pow(double base, double exponent);

}  // namespace tessera::portable
