#include "lpss/tick/recipients.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<Rank> listed(const Ranks& ranks) {
  std::vector<Rank> all;
  ranks.for_each([&](Rank rank) { all.push_back(rank); });
  return all;
}

TEST(Ranks, AreASetOfAnySize) {
  Ranks ranks{3, 63, 64, 700};
  EXPECT_THAT(listed(ranks), ElementsAre(3, 63, 64, 700));
  EXPECT_TRUE(ranks.contains(700));
  EXPECT_FALSE(ranks.contains(701));
  EXPECT_FALSE(ranks.contains(5000));
  EXPECT_THAT(listed(ranks - Ranks{3, 700, 900}), ElementsAre(63, 64));
  EXPECT_THAT(listed(Ranks{5} | ranks), ElementsAre(3, 5, 63, 64, 700));
  ranks.erase(5000);
  for (const Rank rank : listed(ranks)) ranks.erase(rank);
  EXPECT_TRUE(ranks.empty());
  EXPECT_THAT(listed(ranks), IsEmpty());
}

TEST(Ranks, TheFirstOnesEndWhereTheyAreTo) {
  for (const std::size_t n : {0, 1, 63, 64, 65, 128, 129, 1000}) {
    const Ranks ranks = Ranks::first(n);
    EXPECT_EQ(listed(ranks).size(), n);
    EXPECT_FALSE(ranks.contains(static_cast<Rank>(n)));
  }
}

}  // namespace
}  // namespace tessera
