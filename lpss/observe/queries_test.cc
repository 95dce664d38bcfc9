// Rays and probes find bodies over any number of sectors, each asked near its own centre.
#include "lpss/observe/queries.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

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

// Neighbours that know it, too, see it from elsewhere, and may have worlds or not.
TEST(Raycast, HitsAStaticBodyWithTheSameBitsWhoeverLivesBesideTheRay) {
  std::vector<double> distances;
  std::vector<double> swept;
  for (const bool has_neighbours : {false, true}) {
    TestWorld world;
    BodyRecord slope = box(1, kLow, {7.5, 7.5, -1}, Motion::kStatic);
    slope.state.rotation = {0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8};
    world.add(slope);
    if (has_neighbours) {
      for (std::uint64_t id = 2; id < 6; ++id) {
        const bool odd = id % 2 == 1;
        world.add(
            box(id, translated(kLow, {odd ? 1 : 0, odd ? 0 : 1, id < 4 ? 0 : -1}).value(), {-7, -7, 7}));
      }
    }
    for (int n = 0; n < 200; ++n) {
      const WorldPosition from{kLow, {7.2 + 0.003 * n, 7.2 + 0.0021 * n, 7.1 - 0.01 * n}};
      const Eigen::Vector3d way = Eigen::Vector3d(-0.01, 0.002 * (n % 7), -1).normalized();
      const auto hit = raycast(world[0], from, way, 12, kAll);
      distances.push_back(hit ? hit->distance : 0);
      const auto touch = sweep(world[0], Sphere{0.2}, {from, Eigen::Quaterniond::Identity()}, way, 12, kAll);
      swept.push_back(touch ? touch->distance : 0);
    }
  }
  for (std::vector<double>* all : {&distances, &swept}) {
    EXPECT_GT(std::ranges::count_if(*all, [](double distance) { return distance > 0; }), 200);
    EXPECT_TRUE(std::equal(all->begin(), all->begin() + 200, all->begin() + 200));
  }
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

// Whether a line goes from sector to sector or through a list of those that matter, which follows from how
// many there are: the same bits.
TEST(Queries, DoNotDependOnHowManySectorsThereAreElsewhere) {
  constexpr std::uint64_t kBodies = 60;
  constexpr std::uint64_t kElsewhere = 4000;
  constexpr int kLines = 400;
  std::vector<std::vector<RayAnswer>> answers(2);
  for (const bool has_others : {false, true}) {
    std::mt19937_64 random(20261129);
    const auto any = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    TestWorld world;
    for (std::uint64_t id = 1; id <= kBodies; ++id) {
      const Eigen::Vector3d place(any(-160, 160), any(-160, 160), any(-20, 20));
      const WorldPosition position = *canonical(kLow, place, 16);
      world.add(box(id, position.sector, position.local, id % 2 == 0 ? Motion::kStatic : Motion::kDynamic));
    }
    // The plane is a large one, and far from most lines.
    BodyRecord ground = box(kBodies + 1, kLow, {0, 0, -7}, Motion::kStatic);
    ground.properties.shape = kGround;
    ground.state.rotation = {0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8};
    world.add(ground);
    for (std::uint64_t n = 0; has_others && n < kElsewhere; ++n) {
      const SectorIndex sector = *translated(kLow, {1000 + 3 * static_cast<std::int64_t>(n), 5000, 0});
      world.add(box(1000 + n, sector, {0, 0, 0}, n % 2 == 0 ? Motion::kStatic : Motion::kDynamic));
    }
    for (int n = 0; n < kLines; ++n) {
      const WorldPosition from = *canonical(kLow, {any(-160, 160), any(-160, 160), any(-20, 20)}, 16);
      Eigen::Vector3d way = Eigen::Vector3d(any(-1, 1), any(-1, 1), any(-0.2, 0.2)).normalized();
      if (n % 8 == 0) way = Eigen::Vector3d::Unit(n / 8 % 3);
      if (n % 16 == 0) way[(n / 8 + 1) % 3] = 1e-310;  // crosses no border
      const double length = std::pow(10, any(0, 2.8));
      const auto ray = raycast(world[0], from, way, length, kAll);
      answers[has_others].push_back(ray.value_or(RayAnswer()));
      const auto touch =
          sweep(world[0], Sphere{any(0.1, 8)}, {from, Eigen::Quaterniond::Identity()}, way, length, kAll);
      answers[has_others].push_back(touch.value_or(RayAnswer()));
      for (const RayAnswer& hit : raycast_all(world[0], from, way, length, kAll))
        answers[has_others].push_back(hit);
      for (const NearBody& near :
           bodies_near(world[0], Sphere{1}, {from, Eigen::Quaterniond::Identity()}, any(0, 40), kAll))
        answers[has_others].push_back({near.body, near.distance, Eigen::Vector3d::Zero()});
    }
  }
  ASSERT_EQ(answers[0].size(), answers[1].size());
  std::set<BodyId> met;
  for (std::size_t n = 0; n < answers[0].size(); ++n) {
    EXPECT_EQ(order_of(answers[0][n]), order_of(answers[1][n])) << n;
    met.insert(answers[0][n].body);
  }
  EXPECT_GT(met.size(), kBodies / 2) << "few of the bodies, and the plane, are met";
  EXPECT_TRUE(met.contains(BodyId{kBodies + 1}));
}

TEST(Raycast, PassesThroughWhatItIsNotToMeet) {
  TestWorld world;
  for (const std::uint64_t id : {1, 2, 3})
    world.add(
        box(id, kHigh, {2. * static_cast<double>(id), 0, 0}, id == 2 ? Motion::kStatic : Motion::kDynamic));
  const std::vector<BodyId> first{BodyId{1}, BodyId{7}};
  const std::vector<BodyId> two{BodyId{1}, BodyId{2}};
  EXPECT_EQ(raycast(world[0], kOrigin, kEast, 200, kAll)->body, BodyId{1});
  EXPECT_EQ(raycast(world[0], kOrigin, kEast, 200, kAll, first)->body, BodyId{2});
  const auto third = raycast(world[0], kOrigin, kEast, 200, kAll, two);
  ASSERT_TRUE(third);
  EXPECT_EQ(third->body, BodyId{3});
  EXPECT_NEAR(third->distance, 16 + 6 - 0.5, 1e-4);
  const auto near = bodies_near(world[0], Sphere{0.5}, {{kHigh, {4, 0, 0}}}, 3, kAll, two);
  ASSERT_EQ(near.size(), 1u);
  EXPECT_EQ(near[0].body, BodyId{3});
  EXPECT_TRUE(bodies_near(world[0], Sphere{0.5}, {{kHigh, {4, 0, 0}}}, 0.9, kAll, two).empty());
}

// Of a body in several sectors, the hit that comes first counts.
TEST(RaycastAll, MeetsEachBodyOnceInTheOrderOfDistances) {
  TestWorld world(2);
  world.add(box(4, kLow, {2, 0, 0}));
  world.add(box(1, kHigh, {4, 0, 0}));
  BodyRecord wall = box(2, kHigh, {-8, 0, 0}, Motion::kStatic);
  world.add(wall);
  world.add(box(3, {1, 0, 0}, {0, 0.6, 0}));
  world.add(box(5, {1, 0, 0}, {0, 0.4, 0}));
  std::vector<RayAnswer> hits;
  for (const Rank rank : {0u, 1u}) {
    const auto its = raycast_all(world[rank], kOrigin, kEast, 60, kAll);
    hits.insert(hits.end(), its.begin(), its.end());
  }
  const std::vector<std::pair<std::uint64_t, double>> wanted{{4, 1.5}, {2, 7.5}, {1, 19.5}, {5, 31.5}};
  std::ranges::sort(hits, {}, [](const RayAnswer& a) { return std::pair(a.distance, a.body); });
  ASSERT_EQ(hits.size(), wanted.size());
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    EXPECT_EQ(hits[n].body.value, wanted[n].first);
    EXPECT_NEAR(hits[n].distance, wanted[n].second, 1e-4);
    EXPECT_NEAR((hits[n].normal + kEast).norm(), 0, 1e-6);
  }
  EXPECT_EQ(raycast_all(world[0], kOrigin, kEast, 7, kAll).size(), 1u);
}

TEST(RaycastAll, HasNoMoreHitsThanTheLimit) {
  WorldSettings settings = test_settings();
  TestWorld world(1, settings);
  const auto count = static_cast<std::int64_t>(kRayHitsMax) + 5;
  for (std::int64_t n = 0; n < count; ++n)
    world.add(box(static_cast<std::uint64_t>(n + 1), {n, 0, 0}, {0, 0, 0}));
  const auto hits = raycast_all(world[0], kOrigin, kEast, 1e5, kAll);
  ASSERT_EQ(hits.size(), kRayHitsMax);
  EXPECT_EQ(hits.back().body.value, kRayHitsMax);
  EXPECT_NEAR(hits.back().distance, 16. * static_cast<double>(kRayHitsMax) - 0.5, 1e-3);
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
