// Islands over borders: joined over links, the same list whoever looks and in whatever order things were
// said.
#include "lpss/partition/seam_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr SectorIndex kA{-1, 0, 0};
constexpr SectorIndex kB{0, 0, 0};
constexpr SectorIndex kC{0, 1, 0};
constexpr SectorIndex kD{7, 7, 7};

IslandPart part(std::uint64_t first, const std::vector<std::uint64_t>& shared) {
  IslandPart result;
  for (const std::uint64_t id : shared) result.shared.push_back(BodyId{id});
  result.first = BodyId{first};
  result.any_awake = true;
  result.all_want_sleep = false;
  return result;
}

IslandPart asleep(IslandPart part) {
  part.any_awake = false;
  part.all_want_sleep = true;
  return part;
}

IslandPart wants_sleep(IslandPart part) {
  part.all_want_sleep = true;
  return part;
}

std::uint64_t id_of(const SeamIsland& island) { return island.id.value; }

// The islands, those of a part that is alone included, each as the first bodies of its parts.
using Firsts = std::vector<std::vector<std::uint64_t>>;
Firsts firsts(const SeamGraph& graph, const std::vector<SectorIndex>& awake) {
  Firsts result;
  for (const SeamIsland& island : graph.awake_islands(awake)) {
    std::vector<std::uint64_t>& parts = result.emplace_back();
    for (const PartRef& ref : island.parts) parts.push_back(graph.part(ref).first.value);
    EXPECT_EQ(id_of(island), parts.front());
  }
  EXPECT_TRUE(std::is_sorted(result.begin(), result.end()));
  for (const SectorIndex& sector : std::set<SectorIndex>(awake.begin(), awake.end())) {
    for (const SeamPart& part : graph.parts_of(sector)) {
      if (part.is_alone() && part.said.any_awake) result.push_back({part.said.first.value});
    }
  }
  std::sort(result.begin(), result.end());
  return result;
}

TEST(SeamGraph, PartsOfTwoSectorsAreOneIslandOverALink) {
  SeamGraph graph;
  graph.replace({kA, {part(4, {9})}});
  graph.replace({kB, {part(9, {9})}});
  const std::vector<SeamIsland> islands = graph.awake_islands(std::vector{kA, kB});
  ASSERT_EQ(islands.size(), 1u);
  EXPECT_EQ(id_of(islands[0]), 4u);
  EXPECT_THAT(islands[0].parts, ElementsAre(PartRef{kA, 0}, PartRef{kB, 0}));
  EXPECT_FALSE(islands[0].all_want_sleep);
}

TEST(SeamGraph, LinksJoinOverAnyNumberOfSectors) {
  SeamGraph graph;
  graph.replace({kA, {part(8, {1})}});
  graph.replace({kB, {part(6, {1, 2})}});
  graph.replace({kC, {part(7, {2, 3})}});
  graph.replace({kD, {part(5, {3})}});
  EXPECT_THAT(firsts(graph, {kA}), ElementsAre(ElementsAre(5, 6, 7, 8)));
}

TEST(SeamGraph, PartsOfOneSectorAreJoinedOverAnother) {
  SeamGraph graph;
  graph.replace({kA, {part(3, {10}), part(5, {11}), part(4, {12})}});
  graph.replace({kB, {part(9, {10, 11})}});
  EXPECT_THAT(firsts(graph, {kA}), ElementsAre(ElementsAre(3, 5, 9), ElementsAre(4)));
}

TEST(SeamGraph, IslandsComeInTheOrderOfTheirSmallestBodies) {
  SeamGraph graph;
  graph.replace({kA, {part(30, {1}), part(10, {2})}});
  graph.replace({kB, {part(20, {3})}});
  EXPECT_THAT(firsts(graph, {kB, kA}), ElementsAre(ElementsAre(10), ElementsAre(20), ElementsAre(30)));
}

TEST(SeamGraph, AnIslandIsListedOnceHoweverManyOfItsSectorsAreAwake) {
  SeamGraph graph;
  graph.replace({kA, {part(1, {5, 5})}});
  graph.replace({kB, {part(2, {5}), part(3, {5})}});
  EXPECT_THAT(firsts(graph, {kA, kB, kA}), ElementsAre(ElementsAre(1, 2, 3)));
}

TEST(SeamGraph, NeitherTheOrderOfWhatWasSaidNorThatOfTheSectorsMatters) {
  const std::vector<SectorSeams> said = {{kA, {part(8, {1}), part(2, {4})}},
                                         {kB, {part(6, {1, 2})}},
                                         {kC, {part(7, {2, 3}), part(9, {})}},
                                         {kD, {part(5, {3, 4})}}};
  std::vector<std::size_t> order = {0, 1, 2, 3};
  do {
    SeamGraph graph;
    std::vector<SectorIndex> awake;
    for (const std::size_t n : order) {
      graph.replace(said[n]);
      awake.push_back(said[n].sector);
    }
    ASSERT_THAT(firsts(graph, awake), ElementsAre(ElementsAre(2, 5, 6, 7, 8), ElementsAre(9)));
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(SeamGraph, SleepingPartsAreFoundOnlyOverAnAwakeOne) {
  SeamGraph graph;
  graph.replace({kA, {asleep(part(1, {5}))}});
  graph.replace({kB, {asleep(part(2, {5}))}});
  EXPECT_THAT(firsts(graph, {kA, kB}), IsEmpty());
  graph.replace({kC, {part(3, {5})}});
  EXPECT_THAT(firsts(graph, {kC}), ElementsAre(ElementsAre(1, 2, 3)));
}

TEST(SeamGraph, AnIslandIsLookedForInTheAwakeSectorsAlone) {
  SeamGraph graph;
  graph.replace({kA, {part(1, {5})}});
  graph.replace({kB, {part(2, {6})}});
  EXPECT_THAT(firsts(graph, {kB}), ElementsAre(ElementsAre(2)));
  EXPECT_THAT(firsts(graph, {kD}), IsEmpty()) << "nothing was ever said of it";
  EXPECT_THAT(firsts(graph, {}), IsEmpty());
}

TEST(SeamGraph, AnIslandMaySleepWhenAllItsPartsMay) {
  SeamGraph graph;
  const std::vector<SectorIndex> awake = {kA, kB};
  graph.replace({kA, {wants_sleep(part(1, {5}))}});
  graph.replace({kB, {wants_sleep(part(2, {5}))}});
  graph.replace({kC, {asleep(part(3, {5}))}});
  ASSERT_EQ(graph.awake_islands(awake).size(), 1u);
  EXPECT_TRUE(graph.awake_islands(awake)[0].all_want_sleep);
  graph.replace({kB, {part(2, {5})}});
  EXPECT_FALSE(graph.awake_islands(awake)[0].all_want_sleep);
}

TEST(SeamGraph, WhatIsSaidOfASectorReplacesWhatWasSaidBefore) {
  SeamGraph graph;
  graph.replace({kA, {part(1, {5})}});
  graph.replace({kB, {part(2, {5}), part(3, {5})}});
  graph.replace({kC, {part(4, {6})}});
  graph.replace({kB, {part(3, {6})}});
  EXPECT_THAT(firsts(graph, {kA, kB, kC}), ElementsAre(ElementsAre(1), ElementsAre(3, 4)));
  graph.replace({kB, {part(3, {6})}});
  EXPECT_THAT(firsts(graph, {kA, kB, kC}), ElementsAre(ElementsAre(1), ElementsAre(3, 4)));
}

TEST(SeamGraph, ASectorWithoutPartsIsForgotten) {
  SeamGraph graph;
  graph.replace({kA, {part(1, {5})}});
  graph.replace({kB, {part(2, {5})}});
  graph.replace({kC, {part(3, {5})}});
  graph.replace({kB, {}});
  graph.replace({kD, {}});
  EXPECT_THAT(firsts(graph, {kA, kB, kC}), ElementsAre(ElementsAre(1, 3)));
  graph.replace({kB, {part(2, {7})}});
  EXPECT_THAT(firsts(graph, {kA, kB, kC}), ElementsAre(ElementsAre(1, 3), ElementsAre(2)));
}

}  // namespace
}  // namespace tessera
