// Bodies of several parts that start in each other come apart slowly, or stay: no faster than what they would
// fall by being lifted out of each other.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "lpss/engine/test_world.h"

namespace tessera::native {
namespace {

using engine_tests::dynamic_body;
using engine_tests::static_body;
using engine_tests::test_engine;
using engine_tests::test_settings;
using engine_tests::TestWorld;

constexpr ShapeId kPallet = 100;
constexpr ShapeId kStool = 101;
constexpr ShapeId kRods = 102;
constexpr double kSpeedMax = 2;  // m/s

Pose at(double x, double y, double z) { return {{x, y, z}, Eigen::Quaterniond::Identity()}; }

// A deck on nine blocks on three runners, its lowest point at z = -0.0635.
Shape pallet() {
  Shape shape{{{tessera::Box{{1.2, 0.8, 0.042}}, at(0, 0, 0.0625)}}};
  for (const double y : {-0.35, 0., 0.35}) {
    const double width = y == 0 ? 0.145 : 0.1;
    for (const double x : {-0.5275, 0., 0.5275})
      shape.parts.push_back({tessera::Box{{0.145, width, 0.085}}, at(x, y, 0)});
    shape.parts.push_back({tessera::Box{{1.2, width, 0.021}}, at(0, y, -0.053)});
  }
  return shape;
}

Shape stool() {
  Shape shape{{{tessera::Box{{1, 1, 0.03}}, at(0, 0, 0.35)}}};
  for (const double x : {-0.4, 0.4}) {
    for (const double y : {-0.4, 0.4}) shape.parts.push_back({tessera::Box{{0.06, 0.06, 0.7}}, at(x, y, 0)});
  }
  return shape;
}

Shape rods() {
  const Eigen::Quaterniond along_x(Eigen::AngleAxisd(std::acos(0.), Eigen::Vector3d::UnitY()));
  return {{{Sphere{0.2}, at(-0.3, 0, 0)},
           {Sphere{0.2}, at(0.3, 0, 0)},
           {Cylinder{0.05, 0.6}, {{0, 0, 0}, along_x}}}};
}

// m/s, the highest in two seconds, of two bodies on a floor, one in the other.
double highest_speed(ShapeId shape, double height, const Eigen::Vector3d& offset, double yaw) {
  const auto engine = test_engine(test_settings());
  engine->add_shape(kPallet, pallet());
  engine->add_shape(kStool, stool());
  engine->add_shape(kRods, rods());
  TestWorld world(*engine);
  world.add(static_body(1, engine_tests::kPlaneShape, {0, 0, 0}));
  for (const std::uint64_t id : {2, 3}) {
    BodyRecord record = dynamic_body(id, shape, Eigen::Vector3d(0, 0, height) + (id == 3 ? 1. : 0.) * offset);
    record.properties.mass = 25;
    record.properties.inertia = {1, 1, 1};
    if (id == 3) {
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(record.state.rotation.data()) =
          Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    }
    world.add(record);
  }
  double highest = 0;
  for (int tick = 0; tick < 120; ++tick) {
    world.step();
    for (const std::uint64_t id : {2, 3}) {
      const std::array<double, 3> v = world.state(id).linear_velocity;
      highest = std::max(highest, std::hypot(v[0], v[1], v[2]));
    }
  }
  return highest;
}

TEST(DeepOverlapTest, PalletsThatStartInEachOtherComeApartSlowly) {
  for (const Eigen::Vector3d& offset : {Eigen::Vector3d(-0.183, 0.702, 0), Eigen::Vector3d(0.02, 0.03, 0.05),
                                        Eigen::Vector3d(0.6, 0.1, 0.02), Eigen::Vector3d(1.1, 0, 0)}) {
    for (const double yaw : {0., 0.3}) {
      EXPECT_LT(highest_speed(kPallet, 0.0635, offset, yaw), kSpeedMax)
          << offset.transpose() << ", turned by " << yaw;
    }
  }
}

TEST(DeepOverlapTest, SoDoOtherCompounds) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> between(-0.5, 0.5);
  for (int n = 0; n < 6; ++n) {
    const Eigen::Vector3d offset(between(random), between(random), 0.1 * (n % 3));
    EXPECT_LT(highest_speed(kStool, 0.35, offset, n % 2 ? between(random) : 0), kSpeedMax) << "stool " << n;
    EXPECT_LT(highest_speed(kRods, 0.2, offset, n % 2 ? between(random) : 0), kSpeedMax) << "rods " << n;
  }
}

// What fits into something else, if tightly, is no overlap: it is held from both sides.
TEST(DeepOverlapTest, WhatIsHeldFromBothSidesStaysThere) {
  const auto engine = test_engine(test_settings());
  Shape slot{{{tessera::Box{{0.02, 1, 0.5}}, at(-0.209, 0, 0.25)},
              {tessera::Box{{0.02, 1, 0.5}}, at(0.209, 0, 0.25)},
              {tessera::Box{{0.4, 1, 0.02}}, at(0, 0, -0.01)}}};
  engine->add_shape(kPallet, slot);
  engine->add_shape(kStool, Shape{{{tessera::Box{{0.4, 0.4, 0.4}}, {}}}});
  TestWorld world(*engine);
  world.add(static_body(1, kPallet, {0, 0, 0}));
  world.add(dynamic_body(2, kStool, {0, 0, 0.2}));
  world.run(120);
  const BodyState state = world.state(2);
  EXPECT_NEAR(state.position[0], 0, 2e-3);
  EXPECT_NEAR(state.position[1], 0, 1e-3);
  EXPECT_NEAR(state.position[2], 0.2, 1e-3);
}

}  // namespace
}  // namespace tessera::native
