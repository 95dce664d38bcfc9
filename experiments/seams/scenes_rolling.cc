// Scene 5: a sphere rolls over many borders without a bump.
#include <absl/strings/str_cat.h>

#include <cmath>

#include "experiments/seams/scene.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::seams {
namespace {

constexpr double kSpeed = 22;      // m/s
constexpr double kRadius = 0.5;    // m
constexpr double kHalfWay = 110;   // m
constexpr double kHalfWidth = 12;  // m, of the terrain, which extends along x
// A bump is a larger change of the vertical velocity in one tick. On hills of triangles the sphere jumps
// slightly from face to face, also in the reference; how far depends on rounding.
constexpr double kBumpMax = 0.01;      // m/s
constexpr double kBumpRatioMax = 1.5;  // relative to the largest in the reference

enum class Ground { kBox, kMesh, kHeights };

// Gentle hills, in steps of 1 m: steep enough to matter, not so steep that the sphere leaves the ground.
double hill(double x, double y) { return 0.1 * std::sin(0.1 * x + 0.3) + 0.1 * std::sin(0.09 * y); }

HeightField heights(int half_x, int half_y) {
  HeightField field;
  field.columns = 2 * half_x + 1;
  field.rows = 2 * half_y + 1;
  for (int row = -half_y; row <= half_y; ++row) {
    for (int column = -half_x; column <= half_x; ++column) field.heights.push_back(hill(column, row));
  }
  return field;
}

TriangleMesh mesh_of(const HeightField& field) {
  TriangleMesh mesh;
  for (std::uint32_t row = 0; row < field.rows; ++row) {
    for (std::uint32_t column = 0; column < field.columns; ++column) {
      mesh.vertices.emplace_back(column - 0.5 * (field.columns - 1), row - 0.5 * (field.rows - 1),
                                 field.heights[row * field.columns + column]);
    }
  }
  for (std::uint32_t row = 0; row + 1 < field.rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < field.columns; ++column) {
      const std::uint32_t corner = row * field.columns + column;
      const std::uint32_t above = corner + field.columns;
      mesh.indices.insert(mesh.indices.end(), {corner, corner + 1, above, corner + 1, above + 1, above});
    }
  }
  return mesh;
}

WorldDescription rolling(const WorldSettings& settings, Ground ground, bool diagonal) {
  WorldBuilder builder(settings);
  const int half = static_cast<int>(kHalfWay) + 10;
  const int half_y = diagonal ? half : static_cast<int>(kHalfWidth);
  const Eigen::Vector3d direction =
      diagonal ? Eigen::Vector3d(M_SQRT1_2, M_SQRT1_2, 0) : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d start = -kHalfWay * direction;
  double height = 0;
  if (ground == Ground::kBox) {
    builder.add("ground", builder.shape(Box{{2.0 * half, 2.0 * half_y, 2}}), 1, {0, 0, -1}, Motion::kStatic);
  } else {
    const HeightField field = heights(half, half_y);
    const ShapeId shape = ground == Ground::kMesh ? builder.shape(mesh_of(field)) : builder.shape(field);
    builder.add("ground", shape, 1, {0, 0, 0}, Motion::kStatic);
    height = hill(start.x(), start.y());
  }
  BodyDescription& ball = builder.add("ball", builder.shape(Sphere{kRadius}), 10,
                                      start + Eigen::Vector3d(0, 0, height + kRadius + 0.005));
  ball.linear_velocity = kSpeed * direction;
  ball.angular_velocity = Eigen::Vector3d::UnitZ().cross(direction) * (kSpeed / kRadius);
  return builder.world();
}

bool rolls_without_bump(const Course& run, const Course& reference) {
  return displacement(run) >= 200 && run.jolt_max <= kBumpRatioMax * reference.jolt_max + kBumpMax;
}

Scene roll(Ground ground, bool diagonal, const std::string& name, const std::string& on) {
  Scene scene;
  scene.name = absl::StrCat("roll_", name, diagonal ? "_diagonal" : "_along");
  scene.about =
      absl::StrCat("a sphere rolls 200 m on ", on, diagonal ? ", diagonally over corners" : ", along a seam");
  scene.sector_size = 32;
  scene.reference_size = 512;
  scene.extent = 120;
  scene.seam = diagonal ? Eigen::Vector3d(1, 1, 0) : Eigen::Vector3d(0, 1, 0);
  scene.lowest = -0.2;
  scene.build = [=](const WorldSettings& settings) { return rolling(settings, ground, diagonal); };
  scene.stands = rolls_without_bump;
  return scene;
}

}  // namespace

std::vector<Scene> rolling_scenes() {
  std::vector<Scene> scenes;
  for (const bool diagonal : {false, true}) {
    scenes.push_back(roll(Ground::kBox, diagonal, "box", "a box"));
    scenes.push_back(roll(Ground::kMesh, diagonal, "mesh", "a mesh with hills"));
    scenes.push_back(roll(Ground::kHeights, diagonal, "heights", "a height field with hills"));
  }
  return scenes;
}

}  // namespace tessera::seams
