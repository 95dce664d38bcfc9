#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "lpss/ground/tile.h"

namespace tessera {
namespace {

Ground planet() {
  return {.source = Ground::Source::kPlanet,
          .spacing = 20,
          .radius = 2000,
          .height = 60,
          .wavelength = 800,
          .octaves = 4,
          .seed = 7,
          .has_sea = true};
}

Ground plain() { return {.spacing = 8, .height = 60, .wavelength = 800, .octaves = 4, .seed = 7}; }

Eigen::AlignedBox3d box_at(const Eigen::Vector3d& centre, double half) {
  return {centre - Eigen::Vector3d::Constant(half), centre + Eigen::Vector3d::Constant(half)};
}

Eigen::AlignedBox3d box_of(const Tile& tile, const std::array<std::uint32_t, 3>& triangle) {
  Eigen::AlignedBox3d box;
  for (const std::uint32_t vertex : triangle) box.extend(tile.vertices[vertex]);
  return box;
}

// The whole planet.
std::map<TileKey, Tile> all_tiles(const TileSource& source) {
  std::map<TileKey, Tile> tiles;
  for (const TileKey& key : source.overlapping(box_at(Eigen::Vector3d::Zero(), 3000)))
    tiles.emplace(key, source.make(key).value());
  return tiles;
}

TEST(Hills, APlanetIsClosed) {
  const auto source = make_hills(planet());
  // Each edge once in each direction, by the bits of its ends.
  using Point = std::array<double, 3>;
  std::map<std::pair<Point, Point>, int> edges;
  std::set<std::uint32_t> names;
  std::size_t triangles = 0;
  for (const auto& [key, tile] : all_tiles(*source)) {
    for (std::size_t n = 0; n < tile.triangles.size(); ++n) {
      std::array<Point, 3> corner;
      for (std::size_t c = 0; c < 3; ++c) {
        const Eigen::Vector3d& v = tile.vertices[tile.triangles[n][c]];
        corner[c] = {v.x(), v.y(), v.z()};
      }
      for (std::size_t c = 0; c < 3; ++c) ++edges[{corner[c], corner[(c + 1) % 3]}];
      const Eigen::AlignedBox3d box = box_of(tile, tile.triangles[n]);
      const Eigen::Vector3d normal =
          (tile.vertices[tile.triangles[n][1]] - tile.vertices[tile.triangles[n][0]])
              .cross(tile.vertices[tile.triangles[n][2]] - tile.vertices[tile.triangles[n][0]]);
      ASSERT_GT(normal.dot(box.center()), 0) << "a triangle looks inwards";
      names.insert(tile.name + static_cast<std::uint32_t>(n));
      ++triangles;
    }
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(edges.contains({edge.second, edge.first})) << "there is a gap";
  }
  EXPECT_EQ(names.size(), triangles);
}

TEST(Hills, StayWithinTheirHeightsAndHaveASea) {
  double least = 1e9;
  double most = 0;
  const auto source = make_hills(planet());
  for (const auto& [key, tile] : all_tiles(*source)) {
    for (const Eigen::Vector3d& vertex : tile.vertices) {
      least = std::min(least, vertex.norm());
      most = std::max(most, vertex.norm());
    }
  }
  EXPECT_NEAR(least, 2000, 1e-9);
  EXPECT_GT(most, 2015);
  EXPECT_LT(most, 2060);
}

void expect_all_found(const Ground& ground, double scale, double half) {
  const auto source = make_hills(ground);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int n = 0; n < 30; ++n) {
    Eigen::Vector3d at(normal(random), normal(random), normal(random));
    if (ground.source == Ground::Source::kPlanet) {
      at = at.normalized() * ground.radius;
    } else {
      at = Eigen::Vector3d(at.x(), at.y(), 0) * scale;
    }
    const Eigen::AlignedBox3d box = box_at(at, half);
    const std::vector<TileKey> found = source->overlapping(box);
    ASSERT_TRUE(std::is_sorted(found.begin(), found.end()));
    for (const TileKey& key : source->overlapping(box_at(at, 4 * half))) {
      const Tile tile = source->make(key).value();
      const bool overlaps =
          std::any_of(tile.triangles.begin(), tile.triangles.end(),
                      [&](const auto& triangle) { return box_of(tile, triangle).intersects(box); });
      if (overlaps) {
        ASSERT_TRUE(std::binary_search(found.begin(), found.end(), key))
            << key.face << " " << key.i << " " << key.j;
      }
    }
  }
}

TEST(Hills, FindAllTilesInABox) {
  expect_all_found(planet(), 0, 150);
  expect_all_found(planet(), 0, 700);
  expect_all_found(plain(), 1e5, 200);
}

// Wherever a box is, inside of the planet, too, what it needs is all that it reaches, and little more.
TEST(Hills, ABoxAnywhereNeedsFewTilesMoreThanItReaches) {
  const auto source = make_hills(planet());
  const std::map<TileKey, Tile> all = all_tiles(*source);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0, 1);
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d way = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const double half = 10 * std::pow(30, part(random));
    const Eigen::AlignedBox3d box = box_at(way * 2500 * std::sqrt(part(random)), half);
    const std::vector<TileKey> found = source->overlapping(box);
    std::size_t reached = 0;
    for (const auto& [key, tile] : all) {
      const bool overlaps =
          std::any_of(tile.triangles.begin(), tile.triangles.end(),
                      [&](const auto& triangle) { return box_of(tile, triangle).intersects(box); });
      if (!overlaps) continue;
      ++reached;
      ASSERT_TRUE(std::binary_search(found.begin(), found.end(), key));
    }
    // Of which the planet has 600.
    EXPECT_LE(found.size(), 4 * reached + 150) << way.transpose() << ", " << half;
  }
}

TEST(Hills, AreNotAboveOrBelow) {
  const auto over_planet = make_hills(planet());
  EXPECT_TRUE(over_planet->overlapping(box_at({0, 0, 2400}, 100)).empty());
  EXPECT_FALSE(over_planet->overlapping(box_at({0, 0, 2100}, 100)).empty());
  EXPECT_TRUE(over_planet->overlapping(box_at({0, 0, 0}, 100)).empty());
  const auto over_plain = make_hills(plain());
  EXPECT_TRUE(over_plain->overlapping(box_at({0, 0, 200}, 100)).empty());
  EXPECT_TRUE(over_plain->overlapping(box_at({3e8, 0, 0}, 100)).empty());
}

// An Earth has 1e13 vertices: what is needed of it is made in no time, wherever it is.
TEST(Hills, ReachAroundAnEarth) {
  Ground earth = planet();
  earth.radius = 6371000;
  const auto source = make_hills(earth);
  for (const Eigen::Vector3d& way :
       {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0.3, -1, 0.1), Eigen::Vector3d(0, 0, -1)}) {
    const Eigen::AlignedBox3d box = box_at(way.normalized() * earth.radius, 200);
    const std::vector<TileKey> keys = source->overlapping(box);
    EXPECT_LE(keys.size(), 24u);
    std::size_t inside = 0;
    for (const TileKey& key : keys) {
      const Tile tile = source->make(key).value();
      for (const auto& triangle : tile.triangles) inside += box_of(tile, triangle).intersects(box);
      EXPECT_LT(tile.bytes(), 20'000u);
    }
    EXPECT_GT(inside, 400u);
  }
}

}  // namespace
}  // namespace tessera
