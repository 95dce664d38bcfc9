// Parts of one body with materials of their own: what touches counts, in either precision, over borders of
// sectors and at any speed.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr double kG = 10;             // m/s^2
constexpr double kPartTickRate = 60;  // 1/s
constexpr std::uint32_t kFloorBit = 1;
constexpr std::uint32_t kOtherBit = 2;

PartMaterial material(double friction, double restitution = 0, std::uint32_t bits = 0xffff) {
  PartMaterial result;
  result.friction = friction;
  result.restitution = restitution;
  result.category = result.mask = bits;
  return result;
}

class Scene {
 public:
  explicit Scene(double sector_size) : builder_(settings(sector_size)), sector_size_(sector_size) {
    builder_.add("floor", builder_.shape(Plane{}), 1, {0, 0, 0}, Motion::kStatic);
    floor().friction = 1;
    floor().restitution = 1;
    floor().category = floor().mask = kFloorBit;
  }

  BodyProperties& floor() { return builder_.world().bodies.front().properties; }
  void replace_floor(const Shape& shape) { builder_.world().shapes.front() = shape; }

  // A body of 1 kg whose centre is at its origin.
  void add(const Shape& shape, const Eigen::Vector3d& position, const Eigen::Vector3d& velocity) {
    const ShapeId id = builder_.world().shapes.size();
    builder_.world().shapes.push_back(shape);
    builder_.add(absl::StrCat("body", id), id, 1, position);
    BodyDescription& body = builder_.world().bodies.back();
    body.properties.category = body.properties.mask = 0xffff;
    body.linear_velocity = velocity;
  }

  const WorldDescription& world() { return builder_.world(); }
  void start() { cluster_ = cluster_of(world(), 1); }
  void run(double seconds) {
    if (!cluster_) start();
    for (int ticks = static_cast<int>(std::lround(seconds * kPartTickRate)); ticks > 0; --ticks)
      cluster_->step();
  }
  Eigen::Vector3d place(std::uint64_t id) const {
    const BodyRecord body = *cluster_->body(BodyId{id});
    return relative_to(body_pose(body, sector_size_).position, {}, sector_size_);
  }
  double speed(std::uint64_t id) const {
    return Eigen::Vector3d(cluster_->body(BodyId{id})->state.linear_velocity.data()).norm();
  }

 private:
  static WorldSettings settings(double sector_size) {
    WorldSettings settings = sectors_of(sector_size);
    settings.gravity = UniformGravity{{0, 0, -kG}};
    return settings;
  }

  WorldBuilder builder_;
  double sector_size_;
  std::unique_ptr<PartitionCluster> cluster_;
};

// A sled with a slick and a rough side.
Shape sled(const PartMaterial& below, const PartMaterial& above) {
  const Box half{{1, 1, 0.1}};
  Shape shape{{{half, {{0, 0, -0.05}, Eigen::Quaterniond::Identity()}},
               {half, {{0, 0, 0.05}, Eigen::Quaterniond::Identity()}}}};
  shape.parts[0].material = below;
  shape.parts[1].material = above;
  return shape;
}

TEST(PartMaterials, FrictionIsThatOfTheSideThatTouches) {
  for (const double sector_size : {64.0, 2.0}) {
    Scene scene(sector_size);
    const PartMaterial slick = material(0);
    const PartMaterial rough = material(0.4);
    scene.add(sled(slick, rough), {0, 0, 0.1}, {2, 0, 0});
    scene.add(sled(rough, slick), {0, 5, 0.1}, {2, 0, 0});
    scene.run(2);
    EXPECT_NEAR(scene.speed(2), 2, 0.002) << sector_size;
    EXPECT_NEAR(scene.place(2).x(), 4, 0.01) << sector_size;
    EXPECT_LT(scene.speed(3), 1e-3) << sector_size;
    EXPECT_NEAR(scene.place(3).x(), 2 * 2 / (2 * 0.4 * kG), 0.02) << sector_size;  // v^2 / (2 mu g)
  }
}

// The direction is that of the part, which is turned by a quarter in its body.
TEST(PartMaterials, FrictionByDirectionTurnsWithThePart) {
  for (const double angle : {0.0, std::numbers::pi / 2}) {
    Scene scene(64);
    PartMaterial skate = material(0);
    skate.surface.direction = {1, 0, 0};
    skate.surface.second_friction = 0.4;
    Shape shape = sled(skate, material(0.1));
    shape.parts[0].pose.orientation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ());
    scene.add(shape, {0, 0, 0.1}, {2, 0, 0});
    scene.run(2);
    EXPECT_NEAR(scene.place(2).x(), angle == 0 ? 4 : 0.5, 0.02) << angle;
  }
}

// Two balls, one above the other, fall by 1 m.
TEST(PartMaterials, ReboundsAreThoseOfTheEndThatHits) {
  for (const bool is_bouncy_end_down : {true, false}) {
    Scene scene(64);
    const PartMaterial bouncy = material(0, 0.8);
    const PartMaterial dull = material(0, 0);
    Shape shape{{{Sphere{0.2}, {{0, 0, -0.3}, Eigen::Quaterniond::Identity()}},
                 {Sphere{0.2}, {{0, 0, 0.3}, Eigen::Quaterniond::Identity()}}}};
    shape.parts[0].material = is_bouncy_end_down ? bouncy : dull;
    shape.parts[1].material = is_bouncy_end_down ? dull : bouncy;
    scene.add(shape, {0, 0, 1.5}, {0, 0, 0});
    scene.run(0.6);  // after 0.447 s it hits
    double highest = 0;
    for (int tick = 0; tick < 60; ++tick) {
      scene.run(1 / kPartTickRate);
      highest = std::max(highest, scene.place(2).z() - 0.5);
    }
    EXPECT_NEAR(highest, is_bouncy_end_down ? 0.64 : 0, 0.02) << is_bouncy_end_down;
  }
}

// A large ball that meets no floor, and a small one within it that does: at rest, and at 100 m/s.
TEST(PartMaterials, PartsMeetWhatTheirOwnBitsMeet) {
  for (const double speed : {0.0, 100.0}) {
    Scene scene(64);
    scene.floor().restitution = 0;
    Shape shape{{{Sphere{0.5}, {}}, {Sphere{0.2}, {}}}};
    shape.parts[0].material = material(1, 0, kOtherBit);
    shape.parts[1].material = material(1, 0, kFloorBit);
    scene.add(shape, {0, 0, 6}, {0, 0, -speed});
    double lowest = 6;
    for (int tick = 0; tick < 180; ++tick) {
      scene.run(1 / kPartTickRate);
      lowest = std::min(lowest, scene.place(2).z());
    }
    EXPECT_NEAR(scene.place(2).z(), 0.2, 0.002) << speed;
    EXPECT_GT(lowest, 0.1) << speed;
  }
}

// Lanes of one floor, of which a sector has no more than what is near: slick, rough, and slick along the way
// alone.
TEST(PartMaterials, LanesOfALargeFloorKeepTheirs) {
  for (const double sector_size : {64.0, 2.0}) {
    Scene scene(sector_size);
    const double quarter = std::numbers::pi / 2;
    const Eigen::Quaterniond turned(Eigen::AngleAxisd(quarter, Eigen::Vector3d::UnitZ()));
    Shape lanes{{{Box{{300, 4, 2}}, {{0, 0, -1}, Eigen::Quaterniond::Identity()}},
                 {Box{{300, 4, 2}}, {{0, 5, -1}, Eigen::Quaterniond::Identity()}},
                 {Box{{4, 300, 2}}, {{0, 10, -1}, turned}}}};
    lanes.parts[0].material = material(0);
    lanes.parts[1].material = material(0.4);
    lanes.parts[2].material = material(0);
    lanes.parts[2].material->surface.direction = {0, 1, 0};  // along x of the world
    lanes.parts[2].material->surface.second_friction = 0.4;
    scene.replace_floor(lanes);
    for (const double y : {0.0, 5.0, 10.0}) scene.add(sled(material(1), material(1)), {0, y, 0.1}, {2, 0, 0});
    scene.run(2);
    EXPECT_NEAR(scene.place(2).x(), 4, 0.01) << sector_size;
    EXPECT_NEAR(scene.place(3).x(), 0.5, 0.02) << sector_size;
    EXPECT_NEAR(scene.place(4).x(), 4, 0.01) << sector_size;
  }
}

TEST(PartMaterials, BitsAreThoseOfAnyNumberOfServers) {
  Scene scene(2);
  PartMaterial skate = material(0.1, 0.3);
  skate.surface.direction = {1, 0, 0};
  skate.surface.second_friction = 0.4;
  skate.surface.rolling_friction = 0.01;
  for (int n = 0; n < 8; ++n) {
    const double at = 0.9 * n - 3;
    scene.add(n % 2 ? sled(skate, material(0.3)) : sled(material(0.2, 0.5), skate),
              {at, 0.3 * n, 0.4 + 0.5 * n}, {2, -0.5, 0});
  }
  EXPECT_EQ(first_difference(run(scene.world(), 1, 1, 300), run(scene.world(), 3, 2, 300)), 300u);
}

}  // namespace
}  // namespace tessera
