#include "lpss/grid/offset_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<SectorOffset> members(const OffsetSet& set) {
  std::vector<SectorOffset> result;
  set.for_each([&](const SectorOffset& offset) { result.push_back(offset); });
  return result;
}

template <typename Visit>
void for_each_offset(Visit&& visit) {
  for (int i = -OffsetSet::kReach; i <= OffsetSet::kReach; ++i) {
    for (int j = -OffsetSet::kReach; j <= OffsetSet::kReach; ++j) {
      for (int k = -OffsetSet::kReach; k <= OffsetSet::kReach; ++k) visit(i, j, k);
    }
  }
}

TEST(OffsetSet, IsEmptyAtFirst) {
  const OffsetSet set;
  EXPECT_TRUE(set.empty());
  EXPECT_THAT(members(set), IsEmpty());
  for_each_offset([&](int i, int j, int k) { EXPECT_FALSE(set.contains(i, j, k)); });
}

TEST(OffsetSet, EachOffsetIsAMemberOfItsOwn) {
  for_each_offset([](int i, int j, int k) {
    OffsetSet set;
    set.insert(i, j, k);
    set.insert(i, j, k);
    EXPECT_FALSE(set.empty());
    EXPECT_THAT(members(set), ElementsAre(SectorOffset{i, j, k}));
    for_each_offset(
        [&](int a, int b, int c) { EXPECT_EQ(set.contains(a, b, c), a == i && b == j && c == k); });
  });
}

TEST(OffsetSet, MembersComeInLexicographicOrder) {
  OffsetSet set;
  for_each_offset([&](int i, int j, int k) { set.insert(-i, -j, -k); });
  const std::vector<SectorOffset> all = members(set);
  EXPECT_EQ(all.size(), 125u);
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end()));
}

TEST(OffsetSet, MergingKeepsTheMembersOfBoth) {
  OffsetSet a;
  a.insert(-2, -2, -2);
  a.insert(0, 1, 0);
  OffsetSet b;
  b.insert(0, 1, 0);
  b.insert(2, 2, 2);
  a.merge(b);
  EXPECT_THAT(members(a),
              ElementsAre(SectorOffset{-2, -2, -2}, SectorOffset{0, 1, 0}, SectorOffset{2, 2, 2}));
  EXPECT_THAT(members(b), ElementsAre(SectorOffset{0, 1, 0}, SectorOffset{2, 2, 2}));
}

TEST(OffsetSet, FarOffsetsAreMembersToo) {
  OffsetSet set;
  set.insert(3, 0, 0);
  set.insert(1, 0, 0);
  set.insert(-40, 7, 0);
  set.insert(3, 0, 0);
  EXPECT_FALSE(set.empty());
  EXPECT_TRUE(set.contains(3, 0, 0));
  EXPECT_FALSE(set.contains(0, 3, 0));
  EXPECT_THAT(members(set),
              ElementsAre(SectorOffset{-40, 7, 0}, SectorOffset{1, 0, 0}, SectorOffset{3, 0, 0}));
  EXPECT_THAT(members(set.lower()), ElementsAre(SectorOffset{-40, 7, 0}));
  OffsetSet other;
  other.insert(0, 0, -9);
  EXPECT_FALSE(set == other);
  other.merge(set);
  other.merge(set);
  EXPECT_EQ(members(other).size(), 4u);
  EXPECT_EQ(OffsetSet(set.near(), {set.far().begin(), set.far().end()}), set);
}

TEST(OffsetSet, EqualityIsThatOfTheMembers) {
  OffsetSet a;
  a.insert(1, 0, 0);
  a.insert(0, 0, -1);
  OffsetSet b;
  b.insert(0, 0, -1);
  EXPECT_FALSE(a == b);
  b.insert(1, 0, 0);
  EXPECT_EQ(a, b);
}

}  // namespace
}  // namespace tessera
