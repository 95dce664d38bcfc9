#include "viewer/places.h"

#include <gmock/gmock.h>

namespace tessera::viewer {
namespace {

constexpr double kSectorSize = 10;
constexpr std::int64_t kFarIndex = std::int64_t{1} << 62;

BodySample body(std::uint64_t id, const SectorIndex& sector, double x) {
  BodySample sample;
  sample.id = BodyId{id};
  sample.pose.position = {sector, {x, 0, 0}};
  return sample;
}

TEST(PlacesTest, NeighbouringSectorsAreOnePlaceAndDistantOnesAreNot) {
  const std::vector<Place> places = places_of({body(3, {0, 0, 0}, 4), body(4, {1, 0, 0}, -4),
                                               body(5, {1, 1, 1}, 0), body(2, {kFarIndex, 0, -kFarIndex}, 1)},
                                              kSectorSize);
  ASSERT_EQ(places.size(), 2u);
  EXPECT_EQ(places[0].bodies, 3u);
  EXPECT_EQ(places[0].sectors, 3u);
  EXPECT_EQ(places[0].first, BodyId{3});
  EXPECT_NEAR(places[0].half, 5, 1e-9);
  EXPECT_EQ(places[1].centre, (WorldPosition{{kFarIndex, 0, -kFarIndex}, {1, 0, 0}}));
  EXPECT_EQ(places[1].half, 0);
}

TEST(PlacesTest, EdgeOfTheRangeHasNoNeighboursBeyond) {
  constexpr std::int64_t kEdge = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(
      places_of({body(1, {kEdge, kEdge, kEdge}, 0), body(2, {-kEdge - 1, 0, 0}, 0)}, kSectorSize).size(), 2u);
}

}  // namespace
}  // namespace tessera::viewer
