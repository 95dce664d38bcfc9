// Whether two processes compute the same bits.
#pragma once

#include <cstdint>

namespace tessera {

// A hash of the results of operations that worlds are computed with: rounding, denormal numbers, contraction,
// the order of sums in Eigen's products, and the functions of portable_math.h. Processes whose fingerprints
// differ would take a world to other states. Differences come from compiler flags (FMA, AVX, -ffast-math),
// from the version of SLEEF, or from a thread that flushes denormal numbers to zero.
std::uint64_t arithmetic_fingerprint();

}  // namespace tessera
