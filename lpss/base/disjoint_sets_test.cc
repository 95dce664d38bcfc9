#include "lpss/base/disjoint_sets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace tessera {
namespace {

TEST(DisjointSets, EachIsAloneAtFirst) {
  DisjointSets sets(5);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(sets.find(i), i);
}

TEST(DisjointSets, UnitingIsTransitive) {
  DisjointSets sets(6);
  sets.unite(4, 2);
  sets.unite(5, 4);
  sets.unite(1, 3);
  EXPECT_EQ(sets.find(2), sets.find(5));
  EXPECT_EQ(sets.find(1), sets.find(3));
  EXPECT_NE(sets.find(1), sets.find(2));
  EXPECT_EQ(sets.find(0), 0u);
  sets.unite(4, 4);
  sets.unite(5, 2);
  EXPECT_EQ(sets.find(4), 2u);
}

TEST(DisjointSets, TheRootIsTheSmallestMemberInWhateverOrderTheyWereUnited) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs = {{6, 3}, {3, 5}, {1, 6}, {4, 2}, {7, 4}};
  std::sort(pairs.begin(), pairs.end());
  do {
    DisjointSets sets(8);
    for (const auto& [a, b] : pairs) sets.unite(a, b);
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < 8; ++i) roots.push_back(sets.find(i));
    ASSERT_EQ(roots, (std::vector<std::size_t>{0, 1, 2, 1, 2, 1, 1, 2}));
  } while (std::next_permutation(pairs.begin(), pairs.end()));
}

TEST(DisjointSets, ALongChainHasOneRoot) {
  constexpr std::size_t kCount = 100'000;
  DisjointSets sets(kCount);
  for (std::size_t i = kCount - 1; i > 0; --i) sets.unite(i, i - 1);
  EXPECT_EQ(sets.find(kCount - 1), 0u);
  EXPECT_EQ(sets.find(kCount / 2), 0u);
}

}  // namespace
}  // namespace tessera
