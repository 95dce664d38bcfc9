// A mechanism of the experiment: a world of joints, and what mechanics says of it.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"

namespace tessera::mechanisms {

// The joints of a mechanism after a tick.
struct Sighting {
  double time = 0;  // s
  std::vector<JointState> joints;
};

struct Mechanism {
  std::string group;  // joint, chain, loop, drive
  std::string name;   // unique
  std::function<WorldDescription(const WorldSettings&)> world;
  double seconds = 10;
  bool keeps_energy = true;   // nothing drives or damps it
  bool is_free = false;       // nothing holds or pulls it: momentum must stay
  bool in_bullet = true;      // Bullet has all of its joints
  bool has_reference = true;  // its motion is compared with that in small steps of f64
  bool is_large = false;      // only in one variant, and not in a quick run

  // The drive of the first joint in the tick whose middle is at `time`, where it changes.
  std::function<JointDrive(double time)> drive;

  // What closed forms say it should do: the error of a whole run.
  std::string error_is;  // with its unit; empty: nothing more than to hold
  std::function<double(std::span<const Sighting> course)> error;
};

std::vector<Mechanism> all_mechanisms();

}  // namespace tessera::mechanisms
