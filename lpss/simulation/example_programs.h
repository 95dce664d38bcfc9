// Programs in worlds that are made in code, for tests and experiments.
#pragma once

#include <absl/strings/string_view.h>

#include <string>
#include <utility>
#include <vector>

#include "lpss/programs/registry.h"
#include "lpss/simulation/example_worlds.h"

namespace tessera {

using ProgramNumbers = std::vector<std::pair<absl::string_view, double>>;

// With these parameters and inputs, which it must have.
ProgramRecord example_program(absl::string_view kind, const ProgramNumbers& numbers = {});

inline constexpr double kExampleStanding = 1;  // m, of the centre of mass of a character below

// A capsule of 1.2 m without friction, whose lower end is 0.4 m above the ground where its centre is at 1 m.
BodyDescription& add_character(WorldBuilder& builder, const std::string& name,
                               const Eigen::Vector3d& position, const ProgramNumbers& numbers = {});

// A car of 1,200 kg, whose hubs are 0.3 m above the ground where its centre is at about 0.55 m.
BodyDescription& add_car(WorldBuilder& builder, const std::string& name, const Eigen::Vector3d& position,
                         const ProgramNumbers& numbers = {});

// 24 characters that walk from a circle to its middle, where crates and a lift are.
WorldDescription crowd_world(const WorldSettings& settings);

}  // namespace tessera
