// A scene of the experiment `truth`: a world whose motion mechanics gives in closed form, and what it gives.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "experiments/truth/course.h"

namespace tessera::truth {

// A quantity that has a right value: |got - right| <= bound.
struct Result {
  std::string quantity;
  std::string unit;
  double right = 0;
  double got = 0;
  double bound = 0;

  double error() const;  // infinite where `got` is no number
  bool ok() const { return error() <= bound; }
};

using Results = std::vector<Result>;

// in_sectors(), in_one_world(), in_mujoco()
using Make = std::function<absl::StatusOr<std::unique_ptr<LocalWorld>>(const WorldDescription&)>;

struct Scene {
  std::string group;
  std::string name;  // unique in its group

  // Where a world runs: it takes the settings as they are, but for gravity and sleep.
  std::function<WorldDescription(const WorldSettings&)> world;
  double seconds = 10;
  double quick_seconds = 0;  // of a quick run; 0: as long
  Tick every = 1;            // ticks between samples
  Script script;
  std::function<Results(const Course&)> results;

  // Where there are many worlds, or none that runs.
  std::function<absl::StatusOr<Results>(const WorldSettings&, const Make&, bool quick)> measure;

  bool in_bullet = true;        // Bullet has all of it
  bool has_border = true;       // a border of sectors is put through it, too
  bool has_order = false;       // it is run with half the time step, too
  bool in_quick = true;         // part of a quick run
  bool keeps_contacts = false;  // events of contacts and triggers: Course::contacts()
};

// Scenes are at x = kPlace, where sectors of kBorderSectors (m) have a border.
inline constexpr double kPlace = 4;
inline constexpr double kBorderSectors = 8;
inline constexpr double kGravity = 9.81;  // m/s^2

std::vector<Scene> all_scenes();  // by group

std::vector<Scene> rest_scenes();     // what friction holds stays
std::vector<Scene> slide_scenes();    // what it does not hold goes straight, and as far as it should
std::vector<Scene> carrier_scenes();  // what rides on something that is moved
std::vector<Scene> impact_scenes();   // rebounds
std::vector<Scene> through_scenes();  // nothing passes through anything
std::vector<Scene> flush_scenes();    // over borders of what lies flush
std::vector<Scene> flight_scenes();   // falls, orbits, spins: what is conserved
std::vector<Scene> ray_scenes();
std::vector<Scene> trigger_scenes();  // who is in them, and when
std::vector<Scene> program_scenes();  // how lifts, characters and vehicles move
std::vector<Scene> force_scenes();    // of the same group: what pushes, draws and takes away
std::vector<Scene> robot_scenes();    // also: controllers of joints, and robots on wheels
std::vector<Scene> sensor_scenes();   // of the same group: what sensors show
std::vector<Scene> frame_scenes();    // in frames that move
std::vector<Scene> fluid_scenes();    // of the same group: what swims and flies

}  // namespace tessera::truth
