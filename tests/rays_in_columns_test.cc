// Rays in columns have the bits of single rays, on any number of servers.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "proto/convert.h"
#include "proto/ray_columns.h"
#include "simulator/dice.h"
#include "simulator/scenario.h"
#include "simulator/simulated_cluster.h"

namespace tessera {
namespace {

constexpr int kRays = 300;
constexpr std::uint64_t kTicksToContact = 40;  // until the pile is in contact

// A pile over borders of sectors, and two statics in the same place on one of them: what hits one hits both.
WorldDescription pile_with_twins() {
  WorldDescription world = corner_pile();
  world.shapes.push_back({{{Box{{0.5, 3, 3}}, {}}}});
  for (const char* name : {"twin", "other_twin"}) {
    BodyDescription& twin = world.bodies.emplace_back();
    twin.name = name;
    twin.properties.motion = Motion::kStatic;
    twin.properties.shape = static_cast<ShapeId>(world.shapes.size() - 1);
    twin.pose.position = {{1, 0, 0}, {-world.settings.sector_size / 2, 0, 3}};
  }
  return world;
}

// From places at random, many of them on borders of sectors, to all sides and along the axes.
std::vector<RayRow> rays_over(const WorldDescription& world) {
  Dice dice(3, 1);
  std::vector<RayRow> rays;
  const double half = world.settings.sector_size / 2;
  const auto coordinate = [&] { return dice.one_in(4) ? half : dice.between(-half, half); };
  const auto along = [&] { return dice.one_in(3) ? 0.0 : dice.between(-1.0, 1.0); };
  for (int n = 0; n < kRays; ++n) {
    RayRow& ray = rays.emplace_back();
    const auto sector = [&] { return static_cast<std::int64_t>(dice.below(4)) - 2; };
    ray.origin = {{sector(), sector(), dice.one_in(2) ? 0 : 1}, {coordinate(), coordinate(), coordinate()}};
    ray.direction = {along(), along(), -0.01 + along()};
    ray.length = dice.between(0.1, 40.0);
    if (dice.one_in(2)) ray.except = BodyId{1 + dice.below(world.bodies.size())};
  }
  // Straight at both twins.
  rays.push_back({{{0, 0, 0}, {0.25, 0.5, 3}}, {1, 0, 0}, 30, {}});
  return rays;
}

// In one request, at one tick: each ray alone, then all in columns.
v1::Request both_ways(const std::vector<RayRow>& rays, const std::string& except) {
  v1::Request request;
  for (const RayRow& ray : rays) {
    v1::RayQuery& single = *request.add_queries()->mutable_ray();
    *single.mutable_origin() = to_proto(ray.origin);
    *single.mutable_direction() = to_proto(ray.direction);
    single.set_length(ray.length);
    single.add_except()->set_name(except);
    if (ray.except.value != 0) single.add_except()->set_id(ray.except.value);
  }
  v1::RaysQuery& columns = *request.add_queries()->mutable_rays();
  RayWriter writer(columns);
  for (const RayRow& ray : rays) writer.add(ray);
  columns.add_except()->set_name(except);
  return request;
}

// Of a cluster of so many servers, all rays alike in both ways; as bytes.
std::string hits_on(std::uint32_t servers) {
  const WorldDescription world = pile_with_twins();
  SimulatedCluster cluster(servers, servers, world.settings.precision);
  EXPECT_TRUE(cluster.load(world).ok());
  EXPECT_TRUE(cluster.step(kTicksToContact).ok());
  const std::vector<RayRow> rays = rays_over(world);
  const auto reply = cluster.call<v1::Request, v1::Reply>(both_ways(rays, world.bodies.back().name));
  EXPECT_TRUE(reply.ok()) << reply.status();
  if (!reply.ok()) return "";
  std::vector<HitRow> hits;
  const v1::HitColumns& columns = reply->results(static_cast<int>(rays.size())).rays();
  EXPECT_TRUE(append_rows(columns, hits).ok());
  EXPECT_EQ(hits.size(), rays.size());
  int missed = 0;
  for (std::size_t n = 0; n < hits.size(); ++n) {
    const v1::RayHits& single = reply->results(static_cast<int>(n)).ray();
    EXPECT_EQ(single.hit(), hits[n].body.value != 0) << n;
    if (!single.hit()) ++missed;
    if (!single.hit()) continue;
    EXPECT_EQ(single.hits(0).body(), hits[n].body.value) << n;
    EXPECT_EQ(single.hits(0).distance(), hits[n].distance) << n;
    EXPECT_EQ(from_proto(single.hits(0).position()), hits[n].position) << n;
    EXPECT_EQ(from_proto(single.hits(0).normal()), hits[n].normal) << n;
  }
  EXPECT_GT(missed, kRays / 10);
  EXPECT_LT(missed, kRays * 9 / 10);
  return columns.SerializeAsString();
}

TEST(RaysInColumns, AreTheBitsOfSingleRaysOnAnyServers) {
  const std::string one = hits_on(1);
  EXPECT_EQ(one, hits_on(2));
  EXPECT_EQ(one, hits_on(4));
}

// The twin with the lower id is the one that is hit.
TEST(RaysInColumns, AmongEqualsTheLowestIdCounts) {
  const WorldDescription world = pile_with_twins();
  SimulatedCluster cluster(5, 4, world.settings.precision);
  ASSERT_TRUE(cluster.load(world).ok());
  v1::Request request;
  RayWriter(*request.add_queries()->mutable_rays()).add({{{0, 0, 0}, {0.25, 0.5, 3}}, {1, 0, 0}, 30, {}});
  const auto reply = cluster.call<v1::Request, v1::Reply>(request);
  ASSERT_TRUE(reply.ok()) << reply.status();
  EXPECT_EQ(reply->results(0).rays().bodies(0), world.bodies.size() - 1);
}

}  // namespace
}  // namespace tessera
