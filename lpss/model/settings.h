// The settings of a world, and the one list of them. What reads, writes, checks or explains settings (world
// files, JSON, command lines, the wire, validation) goes through the list, so that a new setting is a member
// and a row here, and a field of v1::WorldSettings.
#pragma once

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/limits.h"
#include "lpss/model/moving_frame.h"
#include "lpss/model/precision.h"
#include "lpss/model/program.h"
#include "lpss/model/seam_policy.h"

namespace tessera {

// The same acceleration everywhere, in m/s^2.
struct UniformGravity {
  Eigen::Vector3d acceleration{0, 0, -9.81};
};

// A planet: `surface` m/s^2 towards `centre` at `radius` metres from it, falling off with the square of the
// distance outside and linearly to zero inside.
struct CentralGravity {
  WorldPosition centre;
  double surface = 9.81;
  double radius = 6.371e6;
};

using Gravity = std::variant<UniformGravity, CentralGravity>;

// Meanings, units and bounds: kSettings. The defaults suit bodies of 0.1 to 10 m.
struct WorldSettings {
  Precision precision = Precision::kFloat32;
  double sector_size = 128;
  double time_step = 1.0 / 60;
  SeamPolicy seams = SeamPolicy::kIsland;
  std::uint64_t shuffle = 0;
  int solver_iterations = 12;
  int substeps = 4;
  bool adapt = true;
  bool continuous_collision = true;
  double bounce_from = 1.25;
  double sleep_linear_speed = 0.05;
  double sleep_angular_speed = 0.1;
  double sleep_after = 0.5;
  // Policy clone.
  int clone_depth = 1;
  double warm_starting = 0.85;
  double split_from = 0.04;
  bool friction_in_two_directions = true;
  // None is a scalar, nor in the list: files and messages handle them separately.
  Gravity gravity;
  std::vector<MovingFrame> frames;  // FrameNumbers from 1 on, at most kMovingFramesMax
  ProgramModules modules;           // programs that its bodies may have
};

// One setting: the name that it has in files, flags, JSON and messages, and what it may be.
struct WorldSetting {
  using Member =
      std::variant<bool WorldSettings::*, int WorldSettings::*, std::uint64_t WorldSettings::*,
                   double WorldSettings::*, Precision WorldSettings::*, SeamPolicy WorldSettings::*>;

  const char* name;
  Member member;
  const char* unit;  // empty: none
  double least = 0;  // of numbers: the bounds, both included
  double most = kNoBound;
  const char* help;
  bool of_policy_clone = false;  // worlds of other policies do not read it: shown apart, after all others
};

inline constexpr bool kOfPolicyClone = true;

// clang-format off
inline constexpr auto kSettings = std::to_array<WorldSetting>({
    {"sector_size", &WorldSettings::sector_size, "m", kSectorSizeMin, kNoBound,
     "edge L of a sector; at most 788 m in f32 and 4.2e11 m in f64"},
    {"precision", &WorldSettings::precision, "", 0, 0, "floating-point precision of the physics engine"},
    {"time_step", &WorldSettings::time_step, "s", kTimeStepMin, kTimeStepMax, "simulated time of a tick"},
    {"seams", &WorldSettings::seams, "", 0, 0,
     "solve contacts in one order across borders (`island`), or let every sector solve its own bodies and clones of "
     "others, as in the paper (`clone`)"},
    {"shuffle", &WorldSettings::shuffle, "", 0, kNoBound,
     "a seed, for tests: sectors change servers at random, and islands their solvers; 0: off"},
    {"solver_iterations", &WorldSettings::solver_iterations, "", 1, kSolverIterationsMax,
     "passes over the contacts of an island; more is stiffer and slower"},
    {"substeps", &WorldSettings::substeps, "", 1, kSubstepsMax,
     "small steps of a tick, which share these passes, at least two each; without effect with `clone`, which uses "
     "Bullet's own solver"},
    {"adapt", &WorldSettings::adapt, "", 0, 0,
     "adapt the number of substeps to each island: half as many if no body carries more than one and a half times its "
     "own weight, twice as many or more if one carries more than twenty times its own, or falls far in a tick"},
    {"continuous_collision", &WorldSettings::continuous_collision, "", 0, 0,
     "sweep bodies that move farther in a tick than they are thick"},
    {"bounce_from", &WorldSettings::bounce_from, "ticks", 0, kNoBound,
     "what may bounce does so if it meets faster than gravity and other forces make it in so many ticks, from rest; at "
     "9.81 m/s^2 and 1/60 s, 1.25 is 0.2 m/s"},
    {"sleep_linear_speed", &WorldSettings::sleep_linear_speed, "m/s", 0, kSpeedMax,
     "a body slower than this and `sleep_angular_speed` for `sleep_after` may sleep; a small one must be slower than "
     "half its smallest extent a second"},
    {"sleep_angular_speed", &WorldSettings::sleep_angular_speed, "rad/s", 0, kAngularSpeedMax,
     "see `sleep_linear_speed`; the ends of a large body must turn slower than twice that"},
    {"sleep_after", &WorldSettings::sleep_after, "s", 0, kNoBound,
     "see `sleep_linear_speed`; 0: bodies never sleep"},

    {"clone_depth", &WorldSettings::clone_depth, "contacts", 0, kCloneDepthMax,
     "how many contacts deep bodies are cloned; 1: as in the paper; 0: no clones", kOfPolicyClone},
    {"warm_starting", &WorldSettings::warm_starting, "", 0, 1,
     "fraction of the last tick's impulses that the solver starts from", kOfPolicyClone},
    {"split_from", &WorldSettings::split_from, "m", 0, kSplitFromMax,
     "deeper overlaps are pushed apart without adding velocity", kOfPolicyClone},
    {"friction_in_two_directions", &WorldSettings::friction_in_two_directions, "", 0, 0,
     "stacks drift far less, for about 1.3 times the solver's time; plain Bullet worlds have it, too", kOfPolicyClone},
});
// clang-format on

// Null if there is none of that name.
const WorldSetting* find_setting(absl::string_view name);

// Reads a value as files and command lines write it: true or false, a number, a word. INVALID_ARGUMENT for
// other text, with the expected kind; validate() checks bounds.
absl::Status set_from_text(const WorldSetting& setting, absl::string_view text, WorldSettings& settings);

// The value as set_from_text() takes it, numbers with six digits.
std::string text_of(const WorldSetting& setting, const WorldSettings& settings);

// What the setting may be: "1 to 64", "true or false".
std::string bounds_of(const WorldSetting& setting);

// m, how far a body may be from the centre of its home between two ticks, and its next home from that. A
// change of home is announced in one tick and carried out in the next, by where the body then seems to go:
// commands that turn it around in both leave it up to three ticks' ways from there, and it may be announced
// to go as far again.
double way_from_home_max(const WorldSettings& settings);

}  // namespace tessera
