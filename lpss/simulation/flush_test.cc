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

#include "lpss/engine/test_world.h"
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
  std::string vehicle = {};  // none: single bodies
};

class Movers {
 public:
  Movers(WorldBuilder& builder, const Course& course)
      : builder_(builder),
        turn_(Eigen::AngleAxisd(-course.slope, Eigen::Vector3d::UnitY())),
        speed_(course.speed) {}

  BodyDescription& add(const std::string& name, const Geometry& geometry, double mass,
                       const Eigen::Vector3d& place, bool rolls) {
    BodyDescription& body = builder_.add(name, builder_.shape(geometry), mass, turn_ * place);
    body.pose.orientation = turn_;
    body.linear_velocity = turn_ * Eigen::Vector3d(speed_, 0, 0);
    if (rolls) body.angular_velocity = Eigen::Vector3d(0, speed_ / kRadius, 0);
    return body;
  }
  BodyDescription& add_wheel(const std::string& name, const Geometry& geometry,
                             const Eigen::Vector3d& place) {
    BodyDescription& wheel = add(name, geometry, 2, place, true);
    wheel.pose.orientation =
        turn_ * Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
    return wheel;
  }
  void tie(JointType type, const std::string& parent, const std::string& child, const Eigen::Vector3d& place,
           const Eigen::Vector3d& axis) {
    builder_.tie(parent + "_" + child, type, parent, child, turn_ * place, turn_ * axis);
  }

 private:
  WorldBuilder& builder_;
  Eigen::Quaterniond turn_;
  double speed_;
};

// A ball, a wheel and a box beside each other, that roll and slide along x.
void add_single(Movers& movers) {
  movers.add("ball", Sphere{kRadius}, 2, {kStart, -0.7, kRadius}, true);
  movers.add("box", Box{{2 * kRadius, 2 * kRadius, 2 * kRadius}}, 2, {kStart, 0.03, kRadius}, false)
      .properties.friction = 0;
  movers.add_wheel("wheel", Cylinder{kRadius, 0.1}, {kStart, 0.6, kRadius});
}

Geometry wheel_of(const std::string& vehicle) {
  if (vehicle == "balls") return Sphere{kRadius};
  if (vehicle == "capsules") return Capsule{kRadius, 0.05};
  return Cylinder{kRadius, 0.1};
}

// What slides or rolls as one with others: a chassis on wheels, with or without a trailer; or two sleds, one
// behind the other. Or a capsule alone, with room to turn.
void add_vehicle(Movers& movers, const std::string& vehicle) {
  const Eigen::Vector3d across = Eigen::Vector3d::UnitY();
  if (vehicle == "capsule") {
    movers.add_wheel("capsule", Capsule{kRadius, 0.1}, {kStart, 0.05, kRadius});
    return;
  }
  if (vehicle == "sleds") {
    const Eigen::Vector3d half(0.3, 0, kRadius);
    for (const int n : {0, 1}) {
      movers
          .add(absl::StrCat("sled", n), Box{{0.5, 0.3, 2 * kRadius}}, 5, {kStart + 0.6 * n, 0.03, kRadius},
               false)
          .properties.friction = 0;
    }
    return movers.tie(JointType::kRevolute, "sled0", "sled1", Eigen::Vector3d(kStart, 0.03, 0) + half,
                      across);
  }
  for (int car = 0; car < (vehicle == "train" ? 2 : 1); ++car) {
    const std::string chassis = absl::StrCat("chassis", car);
    const Eigen::Vector3d middle(kStart + 0.9 * car, 0.05, 2 * kRadius);
    movers.add(chassis, Box{{0.7, 0.4, 0.1}}, 10, middle, false);
    for (int n = 0; n < 4; ++n) {
      const std::string wheel = absl::StrCat("wheel", car, n);
      const Eigen::Vector3d place =
          middle + Eigen::Vector3d(n & 1 ? 0.25 : -0.25, n & 2 ? 0.3 : -0.3, -kRadius);
      movers.add_wheel(wheel, wheel_of(vehicle), place);
      movers.tie(JointType::kRevolute, chassis, wheel, place, across);
    }
    if (car == 1)
      movers.tie(JointType::kBall, "chassis0", chassis, middle - Eigen::Vector3d(0.45, 0, 0), across);
  }
}

WorldDescription world_of(const Course& course, double sector_size) {
  WorldSettings settings = sectors_of(sector_size);
  settings.precision = engine_tests::test_precision;
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
  Movers movers(builder, course);
  course.vehicle.empty() ? add_single(movers) : add_vehicle(movers, course.vehicle);
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
      const std::string what = absl::StrCat(
          world.bodies[body.id.value - 1].name, " at ", course.speed, " m/s, tick ", tick, ", sectors of ",
          sector_size, ": ", course.tiles.front(), ", ", course.tiles.back(), ", ", course.vehicle);
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

TEST(Flush, WhatJointsHoldKeepsItsHeight) {
  for (const char* vehicle : {"cart", "balls", "capsules", "train", "sleds"}) {
    for (const double speed : {1., 3., 8.}) {
      expect_level({{"box", "field"}, speed, 0, false, vehicle}, 128);
      expect_level({{"sheet", "crate"}, speed, 0, false, vehicle}, 128);
      expect_level({{"box", "sheet"}, speed, 0, true, vehicle}, 128);
      expect_level({{"box", "sheet"}, speed, 0.3, false, vehicle}, 128);
    }
    for (const double sector_size : {2., 3.7})
      expect_level({{"box", "field"}, 8, 0, false, vehicle}, sector_size);
  }
}

// m, how deep the wheels of a cart get into a ramp that begins where tiles end: what is foreseen of it is not
// taken for a part of the floor.
double deepest_in_ramp(const std::string& kind, double slope, double speed) {
  WorldSettings settings = sectors_of(128);
  settings.precision = engine_tests::test_precision;
  settings.sleep_after = 0;
  settings.gravity = UniformGravity{Eigen::Vector3d(0, 0, -kGravity)};
  WorldBuilder builder(settings);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-slope, Eigen::Vector3d::UnitY()));
  const Tile a_tile = tile(kind);
  const auto add_tile = [&](const std::string& name, const Pose& pose) {
    builder.add(name, builder.shape(a_tile.geometry), 1, pose.position, Motion::kStatic).pose.orientation =
        pose.orientation;
  };
  for (int n = 0; n < 5; ++n)
    add_tile(absl::StrCat("tile", n), {{n - 4.5, 0, a_tile.z}, Eigen::Quaterniond::Identity()});
  for (int n = 0; n < 5; ++n)
    add_tile(absl::StrCat("ramp", n), {turn * Eigen::Vector3d(n + 0.5, 0, a_tile.z), turn});
  const Course course{{kind}, speed, 0, false, "cart"};
  Movers movers(builder, course);
  add_vehicle(movers, course.vehicle);
  const WorldDescription& world = builder.world();
  const auto simulation = Simulation::create(world).value();
  const Eigen::Vector3d up = turn * Eigen::Vector3d::UnitZ();
  double deepest = 0;
  for (int tick = 0; tick * settings.time_step * speed < 6; ++tick) {
    simulation->step();
    simulation->for_each_body([&](const BodyRecord& body) {
      if (!world.bodies[body.id.value - 1].name.starts_with("wheel")) return;
      const WorldPosition place = body_pose(body, 128).position;
      deepest = std::max(deepest, kRadius - up.dot(relative_to(place, world.anchor, 128)));
    });
  }
  return deepest;
}

// At either end of its line, however many triangles that is on.
TEST(Flush, ACapsuleRollsOnItsLine) {
  for (const char* first : {"box", "field", "sheet", "crate"}) {
    for (const char* second : {"field", "crate"}) {
      for (const double speed : {1., 3., 8.}) {
        for (const double slope : {0., 0.3})
          expect_level({{first, second}, speed, slope, false, "capsule"}, 128);
        expect_level({{first, second}, speed, 0, false, "capsule"}, 3.7);
      }
    }
  }
}

TEST(Flush, ARampBehindTilesIsMet) {
  for (const char* kind : {"box", "sheet", "field", "crate"}) {
    for (const double slope : {0.1, 0.3, 0.6}) {
      for (const double speed : {3., 8.}) {
        EXPECT_LT(deepest_in_ramp(kind, slope, speed), 0.0005) << kind << ", " << slope << " rad, " << speed;
      }
    }
  }
}

TEST(Flush, BitsDoNotDependOnThePartition) {
  const WorldDescription world = world_of({{"box", "field"}, 3}, 2);
  EXPECT_EQ(first_difference(run(world, 1, 1, 150), run(world, 3, 2, 150)), 150u);
  const WorldDescription train = world_of({{"box", "field"}, 8, 0, false, "train"}, 2);
  EXPECT_EQ(first_difference(run(train, 1, 1, 60), run(train, 3, 2, 60)), 60u);
}

}  // namespace
}  // namespace tessera::flush
