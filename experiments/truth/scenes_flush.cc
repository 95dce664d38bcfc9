// Over borders of static surfaces that lie flush: no step, and no speed is lost.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "experiments/truth/scene_parts.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

constexpr int kTiles = 8;
constexpr double kFirstTile = 1.7;  // m, the centre of one; each is 1 m long
constexpr double kStart = 1.5;      // m
constexpr double kRun = 5;          // m
constexpr double kSettled = 0.2;    // s: contacts have the overlap that they keep

enum class Tile { kBox, kMesh, kField };

struct Flooring {
  std::string name;
  Tile even;
  Tile odd;
  bool is_one_link = false;
};

ShapePart part_of(Tile tile, double x) {
  const Pose at{{x, 0, 0}, Eigen::Quaterniond::Identity()};
  switch (tile) {
    case Tile::kBox:
      return {Box{{1, 2, 0.2}}, Pose{{x, 0, -0.1}, Eigen::Quaterniond::Identity()}};
    case Tile::kMesh:
      return {TriangleMesh{{{-0.5, -1, 0}, {0.5, -1, 0}, {0.5, 1, 0}, {-0.5, 1, 0}}, {0, 1, 2, 0, 2, 3}}, at};
    case Tile::kField:
      break;
  }
  return {HeightField{3, 3, {0.5, 1}, std::vector<double>(9, 0.0)}, at};
}

void add_flooring(WorldBuilder& builder, const Flooring& flooring) {
  WorldDescription& world = builder.world();
  Shape all;
  for (int n = 0; n < kTiles; ++n) {
    const double x = kFirstTile + n;
    const Tile tile = n % 2 == 0 ? flooring.even : flooring.odd;
    if (flooring.is_one_link) {
      all.parts.push_back(part_of(tile, x));
      continue;
    }
    const ShapePart part = part_of(tile, 0);
    world.shapes.push_back(Shape{{part}});
    builder.add(absl::StrCat("tile", n), world.shapes.size() - 1, 1, {x, 0, 0}, Motion::kStatic);
  }
  if (!flooring.is_one_link) return;
  world.shapes.push_back(all);
  builder.add("tiles", world.shapes.size() - 1, 1, {0, 0, 0}, Motion::kStatic);
}

constexpr double kRadius = 0.15;  // m, of all that rolls

using AddMover = void (*)(WorldBuilder& builder, double speed);

void add_ball(WorldBuilder& builder, double speed) {
  BodyDescription& ball = add_body(builder, "mover", Sphere{kRadius}, 5, {kStart, 0.05, kRadius}, 0.5);
  ball.linear_velocity = {speed, 0, 0};
  ball.angular_velocity = {0, speed / kRadius, 0};
}

void add_box(WorldBuilder& builder, double speed) {
  add_body(builder, "mover", Box{{0.3, 0.3, 0.3}}, 5, {kStart, 0.05, 0.15}, 0).linear_velocity = {speed, 0,
                                                                                                  0};
}

void add_wheel_named(WorldBuilder& builder, const std::string& name, const Vector3d& place, double speed) {
  BodyDescription& wheel = add_body(builder, name, Cylinder{kRadius, 0.1}, 2, place, 0.5);
  wheel.pose.orientation = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitY());
  wheel.linear_velocity = {speed, 0, 0};
  wheel.angular_velocity = {0, speed / kRadius, 0};
}

void add_wheel(WorldBuilder& builder, double speed) {
  add_wheel_named(builder, "mover", {kStart, 0.05, kRadius}, speed);
}

// The axles turn freely.
void add_cart(WorldBuilder& builder, double speed) {
  add_body(builder, "mover", Box{{0.7, 0.4, 0.1}}, 10, {kStart + 0.1, 0.05, 0.3}, 0.5).linear_velocity = {
      speed, 0, 0};
  int number = 0;
  for (const double along : {0.25, -0.25}) {
    for (const double across : {0.3, -0.3}) {
      const std::string name = absl::StrCat("wheel", number++);
      const Vector3d place(kStart + 0.1 + along, 0.05 + across, kRadius);
      add_wheel_named(builder, name, place, speed);
      builder.tie("axle_" + name, JointType::kRevolute, "mover", name, place, Vector3d::UnitY());
    }
  }
}

Results glide(const Course& course, double speed) {
  double lowest = 1e9, highest = -1e9, slowest = speed, fastest = speed;
  for (const Glance& glance : course.between("mover", kSettled)) {
    lowest = std::min(lowest, glance.place.z());
    highest = std::max(highest, glance.place.z());
    slowest = std::min(slowest, glance.velocity.x());
    fastest = std::max(fastest, glance.velocity.x());
  }
  const double worst = fastest - speed > speed - slowest ? fastest : slowest;
  return {{"way up and down", "mm", 0, (highest - lowest) * 1e3, 0.1},
          {"speed farthest from the right one", "m/s", speed, worst, 1e-3 * speed}};
}

Scene flush(const Flooring& flooring, const std::string& mover, AddMover add, double speed) {
  Scene scene;
  scene.group = "flush";
  scene.name = absl::StrCat(mover, "_over_", flooring.name, "_at_", speed);
  scene.seconds = std::max(kRun / speed, 2 * kSettled);
  scene.world = [=](const WorldSettings& settings) {
    WorldBuilder builder(with_gravity(settings, {0, 0, -kGravity}));
    add_flooring(builder, flooring);
    add(builder, speed);
    return builder.world();
  };
  scene.results = [speed](const Course& course) { return glide(course, speed); };
  return scene;
}

}  // namespace

std::vector<Scene> flush_scenes() {
  const std::vector<Flooring> floorings = {
      {"boxes", Tile::kBox, Tile::kBox},
      {"boxes_of_one_link", Tile::kBox, Tile::kBox, true},
      {"meshes", Tile::kMesh, Tile::kMesh},
      {"meshes_of_one_link", Tile::kMesh, Tile::kMesh, true},
      {"fields", Tile::kField, Tile::kField},
      {"boxes_and_meshes", Tile::kBox, Tile::kMesh},
      {"boxes_and_fields", Tile::kBox, Tile::kField},
      {"meshes_and_fields", Tile::kMesh, Tile::kField},
  };
  std::vector<Scene> scenes;
  for (const Flooring& flooring : floorings) {
    for (const double speed : {1.0, 3.0, 8.0}) {
      for (const auto& [name, add] : {std::pair<const char*, AddMover>{"ball", add_ball},
                                      {"box", add_box},
                                      {"wheel", add_wheel},
                                      {"cart", add_cart}})
        scenes.push_back(flush(flooring, name, add, speed));
    }
  }
  for (Scene& scene : scenes) scene.in_quick = scene.name.ends_with("_8");
  return scenes;
}

}  // namespace tessera::truth
