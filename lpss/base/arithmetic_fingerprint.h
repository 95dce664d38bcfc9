// Whether two processes compute the same bits.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

namespace tessera {

// A hash of the results of operations that worlds are computed with: rounding, denormal numbers, contraction,
// the order of sums in Eigen's products, and the functions of portable_math.h. Processes whose fingerprints
// differ would take a world to other states. Differences come from compiler flags (FMA, AVX, -ffast-math),
// from the version of SLEEF, or from a thread that flushes denormal numbers to zero; not from the compiler or
// the architecture.
std::uint64_t arithmetic_fingerprint();

// The same by parts, in a fixed order.
inline constexpr std::size_t kArithmeticParts = 5;
const std::array<std::uint64_t, kArithmeticParts>& arithmetic_parts();

// The names of the parts in which `others`, those of another process, differ from the ones of this process,
// and what to look at: "SLEEF's functions (the version of libsleef)". Empty if none differs, or if there are
// not kArithmeticParts of them.
std::string differing_arithmetic(std::span<const std::uint64_t> others);

}  // namespace tessera
