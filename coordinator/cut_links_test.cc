#include "coordinator/cut_links.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr NodeId kA{10};
constexpr NodeId kB{20};
constexpr NodeId kC{30};
constexpr NodeId kD{40};
constexpr NodeId kE{50};

std::vector<NodeId> dropped(const std::vector<CutLink>& links) { return servers_to_drop(links); }

TEST(CutLinksTest, WhereAllHearEachOtherAllStay) { EXPECT_THAT(dropped({}), IsEmpty()); }

TEST(CutLinksTest, OfTwoTheOneWithTheLargerNodeGoes) {
  EXPECT_THAT(dropped({{kA, kB}, {kB, kA}}), ElementsAre(kB)) << "a cut both ways";
  EXPECT_THAT(dropped({{kA, kB}}), ElementsAre(kB)) << "nothing of the one arrives";
  EXPECT_THAT(dropped({{kB, kA}}), ElementsAre(kB)) << "the loss of either is as good";
}

TEST(CutLinksTest, TheThirdGoesOnWithOneOfTwoThatAreCut) {
  EXPECT_THAT(dropped({{kA, kC}, {kC, kA}}), ElementsAre(kC));
  EXPECT_THAT(dropped({{kB, kC}}), ElementsAre(kC));
}

TEST(CutLinksTest, AServerThatNobodyHearsGoes) {
  EXPECT_THAT(dropped({{kB, kA}, {kC, kA}, {kD, kA}}), ElementsAre(kA));
  EXPECT_THAT(dropped({{kA, kB}, {kC, kB}, {kB, kA}, {kB, kC}}), ElementsAre(kB));
}

TEST(CutLinksTest, OneThatHearsNobodyGoes) {
  EXPECT_THAT(dropped({{kA, kB}, {kA, kC}, {kA, kD}}), ElementsAre(kA));
}

TEST(CutLinksTest, OfAChainTheMiddleGoes) {
  EXPECT_THAT(dropped({{kA, kB}, {kB, kC}}), ElementsAre(kB));
  EXPECT_THAT(dropped({{kA, kB}, {kB, kC}, {kC, kD}, {kD, kE}}), ElementsAre(kB, kD));
}

TEST(CutLinksTest, TheLargerPartOfADividedNetworkGoesOn) {
  EXPECT_THAT(dropped({{kA, kC}, {kA, kD}, {kA, kE}, {kB, kC}, {kB, kD}, {kB, kE}, {kC, kA}, {kD, kB}}),
              ElementsAre(kA, kB));
}

TEST(CutLinksTest, OneIsLeftWhereEverythingIsCut) {
  std::vector<CutLink> links;
  for (const NodeId waits : {kA, kB, kC, kD, kE}) {
    for (const NodeId awaited : {kA, kB, kC, kD, kE}) {
      if (waits != awaited) links.push_back({waits, awaited});
    }
  }
  EXPECT_THAT(dropped(links), ElementsAre(kB, kC, kD, kE));
}

TEST(CutLinksTest, TheOrderOfReportsDoesNotMatter) {
  const std::vector<CutLink> links = {{kA, kB}, {kC, kB}, {kD, kE}, {kE, kA}};
  const std::vector<CutLink> other_order = {{kE, kA}, {kD, kE}, {kC, kB}, {kA, kB}};
  EXPECT_EQ(dropped(links), dropped(other_order));
}

}  // namespace
}  // namespace tessera
