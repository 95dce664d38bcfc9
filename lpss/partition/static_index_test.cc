// Which static bodies a sector needs: all that reach into it, none that are far from it.
#include "lpss/partition/static_index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kEdge = 16;
constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();

BodyRecord static_body(std::uint64_t id, const SectorIndex& home, const Eigen::Vector3d& position) {
  BodyRecord record;
  record.id = BodyId{id};
  record.home = home;
  record.properties.motion = Motion::kStatic;
  Eigen::Map<Eigen::Vector3d>(record.state.position.data()) = position;
  return record;
}

Eigen::AlignedBox3d cube(double half, const Eigen::Vector3d& centre = {0, 0, 0}) {
  return {centre - Eigen::Vector3d::Constant(half), centre + Eigen::Vector3d::Constant(half)};
}

Shape shape_of(Geometry geometry) { return Shape{{ShapePart{std::move(geometry), {}}}}; }

const Shape kBall = shape_of(Sphere{1});
const Shape kRock = shape_of(Sphere{10});
const Shape kPlane = shape_of(Plane{});
const Shape kPlate = shape_of(Box{{1000, 1000, 2}});

std::vector<std::uint64_t> overlapping(const StaticIndex& index, const SectorIndex& sector,
                                       const Eigen::AlignedBox3d& box) {
  std::vector<std::uint64_t> ids;
  for (const BodyId id : index.overlapping(sector, box)) ids.push_back(id.value);
  return ids;
}

TEST(StaticIndex, FindsWhatItWasToldOf) {
  StaticIndex index(kEdge);
  index.add(static_body(3, {1, 2, 3}, {4, 5, 6}), kBall);
  index.add(static_body(5, {}, {0, 0, 0}), kPlane);
  EXPECT_EQ(index.size(), 2u);
  ASSERT_NE(index.find(BodyId{3}), nullptr);
  EXPECT_EQ(index.find(BodyId{3})->home, (SectorIndex{1, 2, 3}));
  EXPECT_EQ(index.find(BodyId{4}), nullptr);
  std::vector<std::uint64_t> visited;
  index.for_each([&](const BodyRecord& record) { visited.push_back(record.id.value); });
  EXPECT_THAT(visited, ElementsAre(3, 5));
}

TEST(StaticIndex, TheFirstBodyOfAnIdStays) {
  StaticIndex index(kEdge);
  index.add(static_body(3, {}, {0, 0, 0}), kBall);
  index.add(static_body(3, {9, 0, 0}, {0, 0, 0}), kBall);
  EXPECT_EQ(index.size(), 1u);
  EXPECT_THAT(overlapping(index, {9, 0, 0}, cube(8)), IsEmpty());
  EXPECT_THAT(overlapping(index, {}, cube(8)), ElementsAre(3));
}

TEST(StaticIndex, ReturnsWhatReachesIntoTheBoxAndNothingFarAway) {
  StaticIndex index(kEdge);
  index.add(static_body(4, {}, {0, 0, 0}), kBall);
  index.add(static_body(2, {1, 0, 0}, {-7.5, 0, 0}), kBall);  // half a metre over the border
  index.add(static_body(3, {1, 0, 0}, {-6.5, 0, 0}), kBall);  // half a metre short of it
  index.add(static_body(1, {5, 5, 5}, {0, 0, 0}), kBall);
  EXPECT_THAT(overlapping(index, {}, cube(8)), ElementsAre(2, 4));
  EXPECT_THAT(overlapping(index, {1, 0, 0}, cube(8)), ElementsAre(2, 3));
  EXPECT_THAT(overlapping(index, {}, cube(1, {0, 5, 0})), IsEmpty());
  EXPECT_TRUE(index.reaches(BodyId{2}, {}, cube(8)));
  EXPECT_FALSE(index.reaches(BodyId{3}, {}, cube(8)));
}

TEST(StaticIndex, ReturnsABodyOfManySectorsOnce) {
  StaticIndex index(kEdge);
  index.add(static_body(7, {}, {8, 8, 8}), kRock);
  EXPECT_THAT(overlapping(index, {}, cube(24)), ElementsAre(7));
  EXPECT_THAT(overlapping(index, {1, 1, 1}, cube(0.1)), IsEmpty()) << "its centre is 13.8 m away";
  EXPECT_THAT(overlapping(index, {1, 1, 1}, cube(8)), ElementsAre(7));
}

TEST(StaticIndex, LargeOnesAndThoseWithoutEndAreFoundByDistanceAlone) {
  StaticIndex index(kEdge);
  index.add(static_body(9, {}, {0, 0, 0}), kPlane);
  index.add(static_body(8, {}, {0, 0, 0}), kPlate);  // 707 m around its centre
  EXPECT_THAT(overlapping(index, {40, 0, 0}, cube(8)), ElementsAre(8, 9));
  EXPECT_THAT(overlapping(index, {100, 0, 0}, cube(8)), ElementsAre(9));
  EXPECT_THAT(overlapping(index, {kMax, kMin, 0}, cube(8)), ElementsAre(9));
}

TEST(StaticIndex, RemovedOnesAreNotFoundAnywhere) {
  StaticIndex index(kEdge);
  index.add(static_body(1, {}, {8, 8, 8}), kRock);
  index.add(static_body(2, {}, {0, 0, 0}), kPlane);
  EXPECT_TRUE(index.remove(BodyId{1}));
  EXPECT_TRUE(index.remove(BodyId{2}));
  EXPECT_FALSE(index.remove(BodyId{1}));
  EXPECT_EQ(index.size(), 0u);
  for (const SectorIndex& sector : {SectorIndex{}, SectorIndex{1, 1, 1}, SectorIndex{0, 1, 0}}) {
    EXPECT_THAT(overlapping(index, sector, cube(8)), IsEmpty());
  }
}

TEST(StaticIndex, ABoxOfMoreSectorsThanThereAreBodiesFindsTheSame) {
  StaticIndex index(kEdge);
  index.add(static_body(1, {50, 0, 0}, {0, 0, 0}), kBall);
  index.add(static_body(2, {0, 50, 0}, {0, 0, 0}), kBall);
  const Eigen::AlignedBox3d way(Eigen::Vector3d(-1, -1, -1),
                                Eigen::Vector3d(1e5, 1, 1));  // what flies 100 km in a tick
  EXPECT_THAT(overlapping(index, {}, way), ElementsAre(1));
}

TEST(StaticIndex, AgreesWithLookingAtEveryBody) {
  std::mt19937_64 random(2);
  const auto draw = [&](std::int64_t range) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(2 * range + 1)) - range;
  };
  const auto place = [&]() -> Eigen::Vector3d {
    return Eigen::Vector3d(draw(799), draw(799), draw(799)) / 100;
  };
  const Shape* const shapes[] = {&kBall, &kRock, &kBall, &kPlate, &kBall, &kRock, &kBall, &kBall};
  StaticIndex index(kEdge);
  for (std::uint64_t id = 1; id <= 200; ++id) {
    index.add(static_body(id, {draw(4), draw(4), draw(4)}, place()), *shapes[id % 8]);
  }
  for (int n = 0; n < 300; ++n) {
    const SectorIndex sector{draw(5), draw(5), draw(5)};
    const Eigen::AlignedBox3d box = cube(0.1 + static_cast<double>(n % 20), place());
    std::vector<std::uint64_t> expected;
    for (std::uint64_t id = 1; id <= 200; ++id) {
      if (index.reaches(BodyId{id}, sector, box)) expected.push_back(id);
    }
    ASSERT_EQ(overlapping(index, sector, box), expected);
  }
}

TEST(StaticIndex, WorksAtTheEndOfTheWorld) {
  StaticIndex index(kEdge);
  index.add(static_body(1, {kMax, kMin, kMax}, {7.5, -7.5, 0}), kRock);
  EXPECT_THAT(overlapping(index, {kMax, kMin, kMax}, cube(8)), ElementsAre(1));
  EXPECT_THAT(overlapping(index, {kMax, kMin + 1, kMax}, cube(8)), IsEmpty()) << "13.5 m away";
  EXPECT_THAT(overlapping(index, {kMin, kMax, kMax}, cube(8)), IsEmpty()) << "indices do not wrap around";
  EXPECT_TRUE(index.remove(BodyId{1}));
}

TEST(StaticIndex, TheCutOfASmallBodyIsAllOfItSeenFromTheSector) {
  StaticIndex index(kEdge);
  index.add(static_body(1, {3, 0, 0}, {1, 2, 3}), kBall);
  const StaticIndex::Cut cut = index.cut(BodyId{1}, {2, 1, 0}, cube(40));
  EXPECT_TRUE(cut.whole);
  EXPECT_EQ(cut.pose.position, Eigen::Vector3d(1 + 16, 2 - 16, 3));
}

TEST(StaticIndex, ALargeBodyIsCutToTheRegion) {
  StaticIndex index(kEdge);
  Shape rink = kPlate;
  rink.parts.push_back({Box{{1, 1000, 20}}, {{499.5, 0, 10}, Eigen::Quaterniond::Identity()}});  // a wall
  index.add(static_body(1, {}, {0, 0, 0}), rink);
  const StaticIndex::Cut open = index.cut(BodyId{1}, {20, 0, 0}, cube(16));
  EXPECT_FALSE(open.whole);
  ASSERT_EQ(open.shape.parts.size(), 1u) << "the wall is far";
  EXPECT_LT(open.shape.parts[0].pose.position.norm(), 64);
  EXPECT_LT(std::get<Box>(open.shape.parts[0].geometry).size.maxCoeff(), 128);
  EXPECT_EQ(index.cut(BodyId{1}, {31, 0, 0}, cube(16)).shape.parts.size(), 2u);
  EXPECT_THAT(index.cut(BodyId{1}, {20, 0, 5}, cube(16)).shape.parts, IsEmpty());
}

}  // namespace
}  // namespace tessera
