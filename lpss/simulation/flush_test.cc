// Bodies that slide and roll over fixed surfaces that are flush with each other keep their height and speed,
// in one sector and over borders through it.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "lpss/bullet/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"
#include "lpss/simulation/test_runs.h"

namespace tessera::flush {
namespace {

constexpr double kGravity = 9.81;     // m/s^2
constexpr double kRadius = 0.15;      // m, of what rolls; half the edge of what slides
constexpr double kStart = -4.2;       // m
constexpr double kTileLength = 1;     // m, along x
constexpr double kWidth = 2;          // m, along y
constexpr double kSettled = 0.5;      // s, by when a body has sunk into what bears it
constexpr double kHeightMost = 1e-4;  // m
constexpr double kSpeedMost = 1e-3;   // of the speed

// A surface of the size of a tile around its origin, and the height of that over its top.
struct Tile {
  Geometry geometry;
  double z = 0;
};

Tile tile(const std::string& kind) {
  const double x = kTileLength / 2;
  const double y = kWidth / 2;
  if (kind == "box") return {Box{{kTileLength, kWidth, 0.2}}, -0.1};
  if (kind == "field")
    return {HeightField{5, 9, {kTileLength / 4, kWidth / 8}, std::vector<double>(45, 0)}, 0};
  if (kind == "sheet")
    return {TriangleMesh{{{-x, -y, 0}, {x, -y, 0}, {x, y, 0}, {-x, y, 0}}, {0, 1, 2, 0, 2, 3}}, 0};
  TriangleMesh crate;
  for (int n = 0; n < 8; ++n) crate.vertices.emplace_back(n & 4 ? x : -x, n & 2 ? y : -y, n & 1 ? 0.1 : -0.1);
  crate.indices = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                   2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
  return {crate, -0.1};
}

struct Course {
  std::vector<std::string> tiles;  // in turns
  double speed = 1;                // m/s
  double slope = 0;                // rad, up along x
  bool is_one_body = false;
};

// A ball, a wheel and a box beside each other, that roll and slide along x.
WorldDescription world_of(const Course& course, double sector_size) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = bullet::test_precision;
  settings.sleep_after = 0;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-course.slope, Eigen::Vector3d::UnitY()));
  settings.gravity = UniformGravity{turn * Eigen::Vector3d(0, 0, -kGravity)};
  WorldBuilder builder(settings);
  Shape floor;
  for (int n = 0; n < 10; ++n) {
    const Tile kind = tile(course.tiles[static_cast<std::size_t>(n) % course.tiles.size()]);
    const Pose pose{turn * Eigen::Vector3d(n - 4.5 + 0.0131, 0, kind.z), turn};
    floor.parts.push_back({kind.geometry, pose});
    if (course.is_one_body) continue;
    builder.add(absl::StrCat("tile", n), builder.shape(kind.geometry), 1, pose.position, Motion::kStatic)
        .pose.orientation = turn;
  }
  if (course.is_one_body) {
    builder.world().shapes.push_back(floor);
    builder.add("floor", builder.world().shapes.size() - 1, 1, Eigen::Vector3d::Zero(), Motion::kStatic);
  }
  const auto add = [&](const char* name, const Geometry& geometry, double y, bool rolls) {
    BodyDescription& body =
        builder.add(name, builder.shape(geometry), 2, turn * Eigen::Vector3d(kStart, y, kRadius));
    body.pose.orientation = turn;
    body.linear_velocity = turn * Eigen::Vector3d(course.speed, 0, 0);
    body.angular_velocity = Eigen::Vector3d(0, rolls ? course.speed / kRadius : 0, 0);
    if (!rolls) body.properties.friction = 0;
    return &body;
  };
  add("ball", Sphere{kRadius}, -0.7, true);
  add("box", Box{{2 * kRadius, 2 * kRadius, 2 * kRadius}}, 0.03, false);
  BodyDescription* const wheel = add("wheel", Cylinder{kRadius, 0.1}, 0.6, true);
  wheel->pose.orientation =
      turn * Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
  return builder.world();
}

void expect_level(const Course& course, double sector_size) {
  const WorldDescription world = world_of(course, sector_size);
  const auto simulation = Simulation::create(world).value();
  const Eigen::Vector3d up(-std::sin(course.slope), 0, std::cos(course.slope));
  const int ticks = static_cast<int>(std::min(2.5, 8 / course.speed) / world.settings.time_step);
  std::map<BodyId, std::array<double, 2>> heights;
  for (int tick = 0; tick < ticks; ++tick) {
    simulation->step();
    if (tick * world.settings.time_step < kSettled) continue;
    simulation->for_each_body([&](const BodyRecord& body) {
      const std::string what =
          absl::StrCat(world.bodies[body.id.value - 1].name, " at ", course.speed, " m/s, tick ", tick,
                       ", sectors of ", sector_size, ": ", course.tiles.front(), ", ", course.tiles.back());
      const WorldPosition place = body_pose(body, sector_size).position;
      const double height = up.dot(relative_to(place, world.anchor, sector_size));
      auto& [low, high] = heights.try_emplace(body.id, std::array{height, height}).first->second;
      low = std::min(low, height);
      high = std::max(high, height);
      EXPECT_LT(high - low, kHeightMost) << what;
      EXPECT_NEAR(Eigen::Vector3d(body.state.linear_velocity.data()).norm(), course.speed,
                  kSpeedMost * course.speed)
          << what;
    });
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Flush, SurfacesOfAnyTwoKindsAreOne) {
  const std::vector<std::string> kinds = {"box", "field", "sheet", "crate"};
  for (const std::string& first : kinds) {
    for (const std::string& second : kinds) {
      if (second < first) continue;
      for (const double speed : {1., 3., 8.}) expect_level({{first, second}, speed}, 128);
    }
  }
}

TEST(Flush, BordersOfSectorsChangeNothing) {
  for (const double sector_size : {2., 3.7}) {
    for (const double speed : {1., 8.}) {
      expect_level({{"box"}, speed}, sector_size);
      expect_level({{"box", "field"}, speed}, sector_size);
      expect_level({{"sheet", "crate"}, speed}, sector_size);
    }
  }
}

TEST(Flush, PartsOfOneBodyAndTilesOfASlopeAreAsFlush) {
  for (const double speed : {1., 3., 8.}) {
    expect_level({{"box"}, speed, 0, true}, 128);
    expect_level({{"box", "crate"}, speed, 0, true}, 128);
    expect_level({{"box", "field"}, speed, 0.3}, 128);
  }
}

TEST(Flush, BitsDoNotDependOnThePartition) {
  const WorldDescription world = world_of({{"box", "field"}, 3}, 2);
  EXPECT_EQ(first_difference(run(world, 1, 1, 150), run(world, 3, 2, 150)), 150u);
}

}  // namespace
}  // namespace tessera::flush
