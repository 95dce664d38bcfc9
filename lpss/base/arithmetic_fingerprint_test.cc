#include "lpss/base/arithmetic_fingerprint.h"

#include <gmock/gmock.h>

namespace tessera {
namespace {

// A golden value. It changes with the list of operations and with the version of SLEEF, and with nothing
// else; this test also runs with the C library's functions for older processors.
TEST(ArithmeticFingerprint, IsTheSameOnEveryProcessor) {
  EXPECT_EQ(arithmetic_fingerprint(), 0xee811557f84b1490) << std::hex << arithmetic_fingerprint();
}

}  // namespace
}  // namespace tessera
