// Rays and probes find bodies over any number of sectors, each asked near its own centre.
#include "lpss/observe/queries.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

constexpr std::uint32_t kAll = 0xffffffff;
const WorldPosition kOrigin{kLow, {0, 0, 0}};
const Eigen::Vector3d kEast = Eigen::Vector3d::UnitX();

TEST(Raycast, HitsTheNearestBodyOfAnySector) {
  TestWorld world;
  world.add(box(1, {3, 0, 0}, {2, 0, 0}));
  world.add(box(2, {4, 0, 0}, {0, 0, 0}));
  const auto hit = raycast(world[0], kOrigin, kEast, 200, kAll);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->body, BodyId{1});
  EXPECT_NEAR(hit->distance, 4 * 16 + 2 - 0.5, 1e-4);
  EXPECT_NEAR((hit->normal - Eigen::Vector3d(-1, 0, 0)).norm(), 0, 1e-6);
  EXPECT_FALSE(raycast(world[0], kOrigin, kEast, 64, kAll)) << "too short";
  EXPECT_FALSE(raycast(world[0], kOrigin, kEast, 200, 2)) << "of no such category";
  EXPECT_FALSE(raycast(world[0], kOrigin, -kEast, 200, kAll));
}

TEST(Raycast, HitsABodyThatReachesOutOfItsSectorFromBesideTheRay) {
  TestWorld world;
  world.add(box(1, {2, 1, 0}, {0, -7.75, 0}));
  const auto hit = raycast(world[0], {kLow, {0, 7.9, 0}}, kEast, 100, kAll);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 3 * 16 - 0.5, 1e-4);
}

TEST(Raycast, HitsStaticsWhereNothingLivesAndEachServerAnswersForItsSectors) {
  TestWorld world(2);
  world.add(box(1, {3, 0, 0}, {0, 0, 0}, Motion::kStatic));
  EXPECT_FALSE(raycast(world[0], kOrigin, kEast, 200, kAll));
  const auto hit = raycast(world[1], kOrigin, kEast, 200, kAll);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->body, BodyId{1});
  EXPECT_NEAR(hit->distance, 63.5, 1e-4);
  EXPECT_TRUE(world[1].sectors.empty()) << "asking makes no sectors";
}

// The plane is through the origin of kHigh; the ray begins 3 m over it and meets it 30 km away.
TEST(Raycast, MeetsGroundThatItHasLongBeenOver) {
  TestWorld world;
  BodyRecord ground = box(1, kHigh, {0, 0, 0}, Motion::kStatic);
  ground.properties.shape = kGround;
  world.add(ground);
  world.add(box(2, {5000, 0, 0}, {0, 0, 0}));
  const WorldPosition above{kHigh, {0, 0, 3}};
  const Eigen::Vector3d down = Eigen::Vector3d(1, 0, -1e-4).normalized();
  const auto hit = raycast(world[0], above, down, 1e5, kAll);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->body, BodyId{1});
  EXPECT_NEAR(hit->distance, 3e4, 0.1);
  EXPECT_FALSE(raycast(world[0], above, down, 2.9e4, kAll));
  EXPECT_EQ(world[0].sectors.size(), 1u) << "asking makes no sectors";
}

TEST(BodiesNear, AreInTheOrderOfTheirDistancesEachOnce) {
  TestWorld world;
  world.add(box(1, kHigh, {-5, 0, 0}));
  world.add(box(2, kLow, {5.75, 0, 0}));
  world.add(box(3, kHigh, {-7.5, 2, 0}, Motion::kStatic));
  world.add(box(4, kHigh, {0, 0, 0}));
  const WorldPose pose{{kHigh, {-7.5, 0, 0}}};
  const std::vector<NearBody> found = bodies_near(world[0], Sphere{0.5}, pose, 2, kAll);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].body, BodyId{3});
  EXPECT_NEAR(found[0].distance, 1, 1e-3);
  EXPECT_EQ(found[1].body, BodyId{1});
  EXPECT_NEAR(found[1].distance, 1.5, 1e-3);
  EXPECT_EQ(found[2].body, BodyId{2});
  EXPECT_NEAR(found[2].distance, 1.75, 1e-3);
}

// Each sector has only those parts of a large body that are near it.
TEST(BodiesNear, OfAStaticBodyTheNearestPartCountsThatAnySectorHas) {
  for (const double side : {-1.0, 1.0}) {
    const auto part_at = [&](double x) {
      return ShapePart{Box{}, {{side * x, 0, 0}, Eigen::Quaterniond::Identity()}};
    };
    TestWorld world;
    add_shape(world[0], 3, std::make_shared<const Shape>(Shape{{part_at(5), part_at(26), part_at(40)}}));
    BodyRecord rocks = box(1, kHigh, {0, 0, 0}, Motion::kStatic);
    rocks.properties.shape = 3;
    world.add(rocks);
    const std::vector<NearBody> found =
        bodies_near(world[0], Sphere{0.5}, {{kHigh, {side * 18, 0, 0}}}, 14, kAll);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NEAR(found[0].distance, 7, 1e-3) << side << ": of the sector around it, 12 of kHigh";
  }
}

}  // namespace
}  // namespace tessera
