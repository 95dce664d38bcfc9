#include "lpss/base/nearest_word.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace tessera {
namespace {

TEST(NearestWord, TakesTheFewestLetters) {
  constexpr std::array<absl::string_view, 3> kKnown = {"inertial", "inertia", "mass"};
  EXPECT_EQ(nearest_word("inertal", kKnown), "inertial");
  EXPECT_EQ(nearest_word("inertya", kKnown), "inertia");
  EXPECT_EQ(nearest_word("mas", kKnown), "mass");
}

TEST(NearestWord, IsEmptyWhereAllAreFar) {
  constexpr std::array<absl::string_view, 1> kKnown = {"mass"};
  EXPECT_EQ(nearest_word("collision", kKnown), "");
  EXPECT_EQ(nearest_word(std::string(100'000, 'm'), kKnown), "");
  EXPECT_EQ(nearest_word("mass", {}), "");
}

}  // namespace
}  // namespace tessera
