// Scene 4: vehicles of other projects, driven across the seam. Their files are not part of this repository.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>

#include "experiments/seams/scene.h"
#include "lpss/simulation/example_worlds.h"
#include "worlds/loader/world_file.h"

namespace tessera::seams {
namespace {

constexpr double kVehicleGapMore = 1e-3;  // m, of a joint, more than the reference
constexpr double kWayMin = 1;             // m

// The bodies and joints of a file, with its origin moved to `place`.
absl::StatusOr<WorldDescription> from_file(const std::string& file, const WorldSettings& settings,
                                           const Eigen::Vector3d& place) {
  absl::StatusOr<LoadedWorld> loaded = load_world_file(file);
  if (!loaded.ok()) return loaded.status();
  WorldDescription& world = loaded->world;
  for (BodyDescription& body : world.bodies) {
    const Eigen::Vector3d at =
        relative_to(body.pose.position, world.anchor, world.settings.sector_size) + place;
    const absl::StatusOr<WorldPosition> moved = canonical(world.anchor, at, settings.sector_size);
    if (!moved.ok()) return moved.status();
    body.pose.position = *moved;
  }
  world.settings = settings;
  return std::move(world);
}

void drive_wheels(WorldDescription& world, double speed) {
  for (JointDescription& joint : world.joints) {
    if (joint.name.find("wheel_joint") == std::string::npos) continue;
    joint.drives[0] = {DriveMode::kVelocity, speed};
  }
}

absl::StatusOr<WorldDescription> diff_drive(const std::string& file, const WorldSettings& settings) {
  absl::StatusOr<WorldDescription> world = from_file(file, settings, {-0.813, 0.011, 0});
  if (!world.ok()) return world;
  drive_wheels(*world, 3);
  return world;
}

// A URDF robot has no ground: add one under its wheels.
absl::StatusOr<WorldDescription> r2d2(const std::string& file, const WorldSettings& settings) {
  constexpr double kWheelRadius = 0.035;  // m
  absl::StatusOr<WorldDescription> world = from_file(file, settings, {0.013, 0, 0});
  if (!world.ok()) return world;
  double lowest = std::numeric_limits<double>::infinity();
  for (const BodyDescription& body : world->bodies) {
    if (body.name.find("wheel") == std::string::npos) continue;
    lowest = std::min(lowest, relative_to(body.pose.position, world->anchor, settings.sector_size).z());
  }
  WorldBuilder builder(settings);
  builder.world() = *std::move(world);
  builder.add_floor(50, lowest - kWheelRadius - 0.002);
  drive_wheels(builder.world(), 5);  // faster, it tips over
  return builder.world();
}

bool drives_on(const Course& run, const Course& reference) {
  return displacement(run) > kWayMin && run.joint_gap_max <= reference.joint_gap_max + kVehicleGapMore;
}

Scene vehicle(const std::string& name, const std::string& about, const std::string& file,
              absl::StatusOr<WorldDescription> (*build)(const std::string&, const WorldSettings&)) {
  Scene scene;
  scene.name = name;
  scene.about = about;
  scene.solver_iterations = 50;
  scene.build = [file, build](const WorldSettings& settings) { return build(file, settings); };
  scene.stands = drives_on;
  return scene;
}

}  // namespace

std::vector<Scene> vehicle_scenes(const std::string& worlds) {
  if (worlds.empty()) return {};
  Scene robot = vehicle("r2d2", "the robot r2d2.urdf drives across the seam",
                        absl::StrCat(worlds, "/bullet/r2d2.urdf"), r2d2);
  robot.seam = {0, 1, 0};
  return {
      vehicle("diff_drive", "two vehicles of diff_drive.sdf drive across the seam",
              absl::StrCat(worlds, "/gazebo/diff_drive.sdf"), diff_drive),
      robot,
  };
}

}  // namespace tessera::seams
