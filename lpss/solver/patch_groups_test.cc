#include "lpss/solver/patch_groups.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

namespace tessera {
namespace {

using ::testing::ElementsAre;

constexpr std::uint32_t kNone = PatchGroups::kNone;

TEST(PatchGroupsTest, PatchesThatShareNoBodyFillALaneEach) {
  PatchGroups groups;
  groups.clear(8, 4);
  for (const std::uint32_t n : {0, 2, 4, 6}) groups.add(n, n + 1);
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_THAT(groups[0], ElementsAre(0, 1, 2, 3));
}

TEST(PatchGroupsTest, APatchWaitsForThoseBeforeIt) {
  PatchGroups groups;
  groups.clear(6, 2);
  groups.add(0, 1);
  groups.add(1, 2);
  groups.add(2, 3);
  groups.add(4, 5);
  ASSERT_EQ(groups.size(), 3U);
  EXPECT_THAT(groups[0], ElementsAre(0, 3));
  EXPECT_THAT(groups[1], ElementsAre(1, kNone));
  EXPECT_THAT(groups[2], ElementsAre(2, kNone));
}

TEST(PatchGroupsTest, NobodyWaitsForWhatCannotBePushed) {
  PatchGroups groups;
  groups.clear(3, 4);
  for (const std::uint32_t n : {0, 1, 2}) groups.add(n, kNone);
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_THAT(groups[0], ElementsAre(0, 1, 2, kNone));
}

TEST(PatchGroupsTest, RandomPatchesKeepTheirOrderAtEachBody) {
  std::mt19937 random(1);
  PatchGroups groups;
  for (const std::size_t lanes : {1, 4, 8}) {
    constexpr std::size_t kBodies = 200;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> patches;
    groups.clear(kBodies, lanes);
    for (int n = 0; n < 1000; ++n) {
      const auto a = static_cast<std::uint32_t>(random() % kBodies);
      const auto b = static_cast<std::uint32_t>((a + 1 + random() % (kBodies - 1)) % kBodies);
      patches.emplace_back(a, random() % 4 == 0 ? kNone : b);
      groups.add(patches.back().first, patches.back().second);
    }
    std::vector<std::size_t> group_of(patches.size(), groups.size());
    std::size_t found = 0;
    for (std::size_t group = 0; group < groups.size(); ++group) {
      for (const std::uint32_t patch : groups[group]) {
        if (patch == kNone) continue;
        group_of[patch] = group;
        ++found;
      }
    }
    ASSERT_EQ(found, patches.size());
    std::vector<std::ptrdiff_t> last(kBodies, -1);
    for (std::size_t n = 0; n < patches.size(); ++n) {
      for (const std::uint32_t body : {patches[n].first, patches[n].second}) {
        if (body == kNone) continue;
        EXPECT_LT(last[body], static_cast<std::ptrdiff_t>(group_of[n]));
        last[body] = static_cast<std::ptrdiff_t>(group_of[n]);
      }
    }
    EXPECT_LT(groups.size(), 2 * patches.size() / lanes + 20);
  }
}

}  // namespace
}  // namespace tessera
