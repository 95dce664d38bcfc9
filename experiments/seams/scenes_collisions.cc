// Scene 1: two spheres meet head-on on the seam, in free space.
#include <absl/strings/str_cat.h>

#include <cmath>

#include "experiments/seams/scene.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera::seams {
namespace {

struct Collision {
  const char* name;
  double mass_left;    // kg
  double mass_right;   // kg
  double speed_left;   // m/s, to the right
  double speed_right;  // m/s, to the left
  double restitution;

  // Velocities of the left and the right sphere after the collision, m/s along x.
  std::pair<double, double> speeds_after() const {
    const double common = (mass_left * speed_left - mass_right * speed_right) / (mass_left + mass_right);
    const double apart = restitution * (speed_left + speed_right) / (mass_left + mass_right);
    return {common - mass_right * apart, common + mass_left * apart};
  }
};

// They meet between two ticks, and are not near Bullet's contact distance at either: there, one ulp could
// shift the contact by a whole tick.
constexpr Collision kCollisions[] = {
    {"collision_equal_soft", 1, 1, 5.03, 5.03, 0},
    {"collision_equal_hard", 1, 1, 5.03, 5.03, 1},
    {"collision_1_to_100_soft", 1, 100, 8.06, 2.0, 0},
    {"collision_1_to_100_hard", 1, 100, 8.06, 2.0, 1},
};

WorldDescription world_of(const Collision& collision, WorldSettings settings) {
  settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  const ShapeId ball = builder.shape(Sphere{0.5});
  BodyDescription& left = builder.add("left", ball, collision.mass_left, {-2.13, 0, 0});
  left.linear_velocity.x() = collision.speed_left;
  left.properties.restitution = collision.restitution;
  BodyDescription& right = builder.add("right", ball, collision.mass_right, {2.13, 0, 0});
  right.linear_velocity.x() = -collision.speed_right;
  right.properties.restitution = collision.restitution;
  return builder.world();
}

}  // namespace

std::vector<Scene> collision_scenes() {
  std::vector<Scene> scenes;
  for (const Collision& collision : kCollisions) {
    Scene scene;
    scene.name = collision.name;
    scene.about = absl::StrCat("two spheres of ", collision.mass_left, " and ", collision.mass_right,
                               " kg, restitution ", collision.restitution);
    scene.extent = 8;
    scene.free = true;
    if (collision.restitution == 1) scene.energy = EnergyRule::kKept;
    scene.build = [collision](const WorldSettings& settings) { return world_of(collision, settings); };
    scene.stands = [collision](const Course& run, const Course&) {
      const auto [left, right] = collision.speeds_after();
      // Bullet pushes overlapping spheres apart at up to 0.5 m/s, even with restitution 0.
      const double tolerance = 0.1 * (collision.speed_left + collision.speed_right);
      return std::abs(run.end[0].linear_velocity.x() - left) < tolerance &&
             std::abs(run.end[1].linear_velocity.x() - right) < tolerance;
    };
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

}  // namespace tessera::seams
