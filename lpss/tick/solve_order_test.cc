#include "lpss/tick/solve_order.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>

namespace tessera {
namespace {

using ::testing::ElementsAre;

constexpr SectorIndex kOrigin{0, 0, 0};
constexpr std::uint32_t kFixed = ContactToOrder::kFixed;

TEST(SolveOrder, StagesAreByParityOfTheLowerHomeWhereHomesDiffer) {
  EXPECT_EQ(stage_of({3, 4, 5}, {3, 4, 5}, kOrigin), kInsideStage);
  EXPECT_EQ(stage_of({2, 5, 5}, {3, 5, 5}, kOrigin), kSeamStage);
  EXPECT_EQ(stage_of({4, 5, 5}, {3, 5, 5}, kOrigin), kSeamStage + 1);
  EXPECT_EQ(stage_of({3, -1, 7}, {3, 0, 7}, kOrigin), kSeamStage + 2) << "-1 is odd";
  EXPECT_EQ(stage_of({1, 1, 1}, {2, 2, 2}, kOrigin), kSeamStage + 7);
  EXPECT_EQ(stage_of({0, 0, 0}, {2, 0, 0}, kOrigin), kFarStage);
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(stage_of({-kMost, 0, 0}, {kMost, 0, 0}, kOrigin), kFarStage);
}

TEST(SolveOrder, AMovedWorldKeepsItsStages) {
  constexpr std::int64_t kFar = (std::int64_t{1} << 62) + 1;
  for (const SectorIndex& other : {SectorIndex{1, 0, 0}, SectorIndex{0, -1, 1}, SectorIndex{0, 0, 2}}) {
    const SectorIndex moved{other.i + kFar, other.j - kFar, other.k + kFar};
    EXPECT_EQ(stage_of({kFar, -kFar, kFar}, moved, {kFar, -kFar, kFar}), stage_of(kOrigin, other, kOrigin));
  }
}

TEST(SolveOrder, IsByStageThenColourThenIds) {
  // A chain 0-1-2-3 inside a sector, one contact over a seam, and two with the ground.
  const std::vector<ContactToOrder> contacts{{kFixedStage, kFixed, 0}, {kInsideStage, 0, 1},
                                             {kSeamStage, 0, 4},       {kInsideStage, 1, 2},
                                             {kInsideStage, 2, 3},     {kFixedStage, kFixed, 3}};
  SolveOrder order;
  EXPECT_THAT(order.of(contacts, 5), ElementsAre(1, 4, 3, 2, 0, 5));
}

// Contacts of one colour and stage may be solved in any order, and so may those of different blocks.
TEST(SolveOrder, NoBodyIsTwiceInAColourAndBlocksShareNoBody) {
  std::mt19937 random(7);
  std::vector<SectorIndex> homes;
  for (int n = 0; n < 60; ++n) {
    homes.push_back({static_cast<std::int64_t>(random() % 3), static_cast<std::int64_t>(random() % 3), 0});
  }
  for (std::size_t a = 0; a < homes.size(); ++a) {
    for (std::size_t b = a + 1; b < homes.size(); ++b) {
      const ContactStage stage = stage_of(homes[a], homes[b], kOrigin);
      if (stage < kSeamStage || stage >= kFarStage) continue;
      const auto block = [&](const SectorIndex& home) {
        const int bits = stage - kSeamStage;
        return std::pair((home.i + (bits & 1)) >> 1, (home.j + (bits >> 1 & 1)) >> 1);
      };
      EXPECT_EQ(block(homes[a]), block(homes[b]));
    }
  }
  std::vector<ContactToOrder> contacts;
  for (std::uint32_t a = 0; a < 60; ++a) {
    for (std::uint32_t b = a + 1; b < 60; ++b) {
      if (random() % 8 == 0) contacts.push_back({kInsideStage, a, b});
    }
  }
  // Where a body comes twice, a colour has ended: each run without repetition is at least one colour.
  std::size_t runs = 1;
  std::set<std::size_t> seen;
  SolveOrder order;
  for (const std::size_t n : order.of(contacts, 60)) {
    const bool fresh = !seen.contains(contacts[n].a) && !seen.contains(contacts[n].b);
    if (!fresh) {
      ++runs;
      seen.clear();
    }
    seen.insert({contacts[n].a, contacts[n].b});
  }
  std::vector<std::size_t> degree(60, 0);
  for (const ContactToOrder& contact : contacts) {
    ++degree[contact.a];
    ++degree[contact.b];
  }
  EXPECT_LE(runs, 2 * *std::max_element(degree.begin(), degree.end())) << "greedy: at most 2 d - 1 colours";
}

TEST(SolveOrder, ABodyWithMoreContactsThanColoursKeepsTheOrderOfIds) {
  std::vector<ContactToOrder> contacts;
  for (std::uint32_t n = 1; n <= 100; ++n) contacts.push_back({kInsideStage, 0, n});
  SolveOrder solve_order;
  const std::span<const std::uint32_t> order = solve_order.of(contacts, 101);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

}  // namespace
}  // namespace tessera
