// Gazebo's systems - plugins of gz-sim and of Gazebo classic - as programs: docs/gazebo.md says which, and
// what is different.
#pragma once

#include <string>

#include "worlds/gazebo/model_parts.h"
#include "worlds/loader/notices.h"

namespace tessera::gazebo {

// Gives links of a model programs, and joints drives, for the plugins of the model, which are removed, and
// for the water that they take along. `notices` gets what runs, and what is left out, and why.
void take_systems(const ModelParts& parts, Notices& notices);

// What is said of a plugin that nothing here stands for: "<plugin> libcamera.so skipped", with what it would
// have done where that is known. Empty where Tessera does of itself what it does.
std::string skipped(const xml::Element& plugin);

inline constexpr char kTriggeredPublisher[] = "triggered-publisher";

// A system by what its spellings have in common: "diff-drive" for gz-sim-diff-drive-system,
// libignition-gazebo6-diff-drive-system.so, and gz::sim::systems::DiffDrive.
std::string canonical_name(const xml::Element& plugin);

}  // namespace tessera::gazebo
