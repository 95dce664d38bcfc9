// Each shape rests on each other one: it comes to a stop, and stays where it was put.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "lpss/engine/test_world.h"

namespace tessera::native {
namespace {

using engine_tests::dynamic_body;
using engine_tests::static_body;
using engine_tests::test_engine;
using engine_tests::test_settings;
using engine_tests::TestWorld;

struct Named {
  std::string name;
  Shape shape;
  double height = 0;  // m, of the centre over what it lies on; of a support, of its top over the centre
  bool rolls = false;
};

Pose upright(double x, double y, double z) { return {{x, y, z}, Eigen::Quaterniond::Identity()}; }

Shape one(Geometry geometry) { return {{{std::move(geometry), {}}}}; }
Shape lying(Geometry geometry) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
  return {{{std::move(geometry), {{0, 0, 0}, turn}}}};
}

ConvexHull prism_of(int sides, double radius, double half) {
  ConvexHull hull;
  for (int n = 0; n < sides; ++n) {
    const double angle = 2 * std::numbers::pi * n / sides;
    for (const double z : {-half, half})
      hull.points.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
  }
  return hull;
}

ConvexHull cone(double radius, double half) {
  ConvexHull hull{{{0, 0, half}}};
  for (int n = 0; n < 32; ++n) {
    const double angle = std::numbers::pi * n / 16;
    hull.points.push_back({radius * std::cos(angle), radius * std::sin(angle), -half});
  }
  return hull;
}

// A ball of so many points, flattened below and above.
ConvexHull boulder(int rings, double radius) {
  ConvexHull hull;
  for (int i = 1; i < rings; ++i) {
    const double tilt = std::numbers::pi * i / rings;
    const double z = radius * std::cos(tilt);
    for (int n = 0; n < 2 * rings; ++n) {
      const double angle = std::numbers::pi * n / rings;
      hull.points.push_back({radius * std::sin(tilt) * std::cos(angle),
                             radius * std::sin(tilt) * std::sin(angle),
                             std::clamp(z, -0.8 * radius, 0.8 * radius)});
    }
  }
  return hull;
}

TriangleMesh quads(int cells, double size) {
  TriangleMesh mesh;
  const double step = size / cells;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) mesh.vertices.emplace_back(i * step - size / 2, j * step - size / 2, 0);
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const auto k = static_cast<std::uint32_t>(j * (cells + 1) + i);
      const auto row = static_cast<std::uint32_t>(cells + 1);
      mesh.indices.insert(mesh.indices.end(), {k, k + 1, k + row + 1, k, k + row + 1, k + row});
    }
  }
  return mesh;
}

std::vector<Named> tops() {
  Shape table{{{tessera::Box{{0.4, 0.4, 0.1}}, upright(0, 0, 0.15)}}};
  for (const double x : {-0.15, 0.15}) {
    for (const double y : {-0.15, 0.15})
      table.parts.push_back({tessera::Box{{0.1, 0.1, 0.3}}, upright(x, y, -0.05)});
  }
  return {
      {"box", one(tessera::Box{{0.3, 0.4, 0.2}}), 0.1},
      {"ball", one(Sphere{0.2}), 0.2, true},
      {"lying capsule", lying(Capsule{0.1, 0.3}), 0.1, true},
      {"standing cylinder", one(Cylinder{0.2, 0.3}), 0.15},
      {"lying cylinder", lying(Cylinder{0.1, 0.3}), 0.1, true},
      {"ellipsoid", one(Ellipsoid{{0.2, 0.15, 0.1}}), 0.1, true},
      {"cone", one(cone(0.2, 0.15)), 0.15},
      {"hull of 6 sides", one(prism_of(6, 0.2, 0.1)), 0.1},
      {"hull of 40 sides", one(prism_of(40, 0.2, 0.1)), 0.1},
      {"hull of 150 sides", one(prism_of(150, 0.2, 0.1)), 0.1},
      {"boulder of 4000 points", one(boulder(45, 0.2)), 0.16, /*rolls=*/true},
      {"table", table, 0.2},
      {"two balls", {{{Sphere{0.1}, upright(-0.12, 0, 0)}, {Sphere{0.1}, upright(0.12, 0, 0)}}}, 0.1, true}};
}

std::vector<Named> supports() {
  Shape tiles;
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) tiles.parts.push_back({tessera::Box{{1, 1, 0.4}}, upright(x, y, 0)});
  }
  return {{"plane", one(Plane{}), 0},
          {"box", one(tessera::Box{{2, 2, 0.4}}), 0.2},
          {"cylinder", one(Cylinder{1, 0.4}), 0.2},
          {"hull of 6 sides", one(prism_of(6, 1, 0.2)), 0.2},
          {"hull of 40 sides", one(prism_of(40, 1, 0.2)), 0.2},
          {"hull of 150 sides", one(prism_of(150, 1, 0.2)), 0.2},
          {"mesh", one(quads(7, 4)), 0},
          {"mesh of small triangles", one(quads(41, 4)), 0},
          {"height field", one(HeightField{9, 9, {0.5, 0.5}, std::vector<double>(81, 0.)}), 0},
          {"tiles", tiles, 0.2}};
}

// Contacts are springs: under the weight of a body they give by some tenths of a millimetre.
constexpr double kSpring = 4e-4;  // m

struct Rest {
  double sunk = 0;    // m, below where it would touch
  double moved = 0;   // m, to the side, in all
  double drift = 0;   // m, in the last second
  double speed = 0;   // m/s
  double turned = 0;  // of the upright axis, as the sine of its angle
};

double side_way(const std::array<double, 3>& p, const std::array<double, 3>& q) {
  return std::hypot(p[0] - q[0], p[1] - q[1]);
}

// After three seconds.
Rest rest_of(const Named& top, const Named& support, bool is_on_body) {
  const auto engine = test_engine(test_settings());
  engine->add_shape(100, top.shape);
  engine->add_shape(101, support.shape);
  TestWorld world(*engine);
  // A support that moves lies on a plane, with the load at its middle.
  const double floor = is_on_body ? 2 * support.height : 0;
  if (is_on_body) {
    world.add(static_body(1, engine_tests::kPlaneShape, {0, 0, 0}));
    BodyRecord record = dynamic_body(2, 101, {0, 0, support.height});
    record.properties.mass = 10;
    record.properties.inertia = {2, 2, 2};
    world.add(record);
  } else {
    world.add(static_body(2, 101, {0, 0, -support.height}));
  }
  const Eigen::Vector3d place = is_on_body ? Eigen::Vector3d::Zero() : Eigen::Vector3d(0.013, 0.021, 0);
  BodyRecord record = dynamic_body(3, 100, place + Eigen::Vector3d(0, 0, floor + top.height));
  record.properties.inertia = {0.02, 0.02, 0.02};
  world.add(record);
  world.run(120);
  const BodyState before = world.state(3);
  world.run(60);
  const BodyState state = world.state(3);
  const std::array<double, 3>& v = state.linear_velocity;
  return {floor + top.height - state.position[2], side_way(state.position, {place.x(), place.y(), 0}),
          (Eigen::Vector3d(state.position.data()) - Eigen::Vector3d(before.position.data())).norm(),
          std::hypot(v[0], v[1], v[2]), std::hypot(state.rotation[2], state.rotation[5])};
}

void expect_rest(const Named& top, const Named& support, bool is_on_body) {
  const Rest rest = rest_of(top, support, is_on_body);
  const std::string name = top.name + " on " + (is_on_body ? "a movable " : "") + support.name;
  EXPECT_NEAR(rest.sunk, 0, is_on_body ? 4 * kSpring : kSpring) << name;
  // Nothing resists rolling: what is left of the landing goes on.
  EXPECT_LT(rest.moved, top.rolls ? 2e-3 : 1e-3) << name;
  EXPECT_LT(rest.drift, top.rolls ? 2e-3 : 1e-4) << name;
  EXPECT_LT(rest.speed, top.rolls ? 2e-3 : 1e-4) << name;
  EXPECT_LT(rest.turned, top.rolls ? 0.05 : 1e-3) << name;
}

TEST(RestTest, EachShapeRestsOnEachStaticOne) {
  for (const Named& support : supports()) {
    for (const Named& top : tops()) {
      // How things roll over the flush borders of parts is not the matter here.
      if (!top.rolls || support.name != "tiles") expect_rest(top, support, false);
    }
  }
}

TEST(RestTest, EachShapeRestsOnEachOneThatMoves) {
  for (const Named& support : supports()) {
    if (support.height == 0) continue;
    for (const Named& top : tops()) {
      // How things roll over the flush borders of parts is not the matter here.
      if (!top.rolls || support.name != "tiles") expect_rest(top, support, true);
    }
  }
}

}  // namespace
}  // namespace tessera::native
