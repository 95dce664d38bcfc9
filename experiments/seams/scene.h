// The scenes of the seam experiment: small worlds around their own origin, and what each must do.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "experiments/seams/course.h"
#include "lpss/model/world_description.h"

namespace tessera::seams {

// What must hold for the mechanical energy.
enum class EnergyRule : std::uint8_t {
  kOpen,    // motors, or dampers: nothing
  kKept,    // stays constant
  kNoGain,  // falls, or stays
};

struct Scene {
  std::string name;
  std::string about;
  double sector_size = 128;       // L, m, in placements with seams
  double reference_size = 128;    // L, m, so large that the whole scene is in one sector
  double extent = 8;              // m from the origin: moving bodies stay within this for the first second
  Eigen::Vector3d seam{1, 0, 0};  // 1 along the axes whose borders pass through the origin at a single seam
  Tick ticks = 600;
  int solver_iterations = WorldSettings().solver_iterations;
  double lowest = 0;  // m: height of zero potential energy, from the origin
  bool free = false;  // no external forces, so momentum is conserved
  EnergyRule energy = EnergyRule::kOpen;
  bool heavy = false;  // expensive: repeated less often

  // The scene with its origin at the centre of the anchor's sector. Errors: those of world files.
  std::function<absl::StatusOr<WorldDescription>(const WorldSettings&)> build;

  // Whether a run did what the scene must do; `reference` is the run without a seam.
  std::function<bool(const Course& run, const Course& reference)> stands;
};

// All scenes. Vehicles are files of other projects in the folder `worlds` ($TESSERA_WORLDS); if it is empty,
// they are left out.
std::vector<Scene> all_scenes(const std::string& worlds);

// By group.
std::vector<Scene> collision_scenes();
std::vector<Scene> stack_scenes();
std::vector<Scene> toppling_scenes();
std::vector<Scene> joint_scenes();
std::vector<Scene> vehicle_scenes(const std::string& worlds);
std::vector<Scene> rolling_scenes();
std::vector<Scene> crossing_scenes();
std::vector<Scene> pile_scenes();

}  // namespace tessera::seams
