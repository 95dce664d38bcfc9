#include "lpss/base/arithmetic_fingerprint.h"

#include <gmock/gmock.h>

namespace tessera {
namespace {

// A golden value. It changes with the list of operations and with the version of SLEEF, and with nothing
// else; this test also runs with the C library's functions for older processors.
TEST(ArithmeticFingerprint, IsTheSameOnEveryProcessor) {
  EXPECT_EQ(arithmetic_fingerprint(), 0xee811557f84b1490) << std::hex << arithmetic_fingerprint();
}

TEST(ArithmeticFingerprint, NamesThePartsThatDiffer) {
  std::array<std::uint64_t, kArithmeticParts> others = arithmetic_parts();
  EXPECT_EQ(differing_arithmetic(others), "");
  others[1] ^= 1;
  others[4] ^= 1;
  EXPECT_EQ(differing_arithmetic(others),
            "operations in double precision (compiler flags), SLEEF's functions (the version of libsleef)");
  EXPECT_EQ(differing_arithmetic(std::span(others).first(1)), "");
}

}  // namespace
}  // namespace tessera
