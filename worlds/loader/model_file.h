// The one model of a world file, to be spawned into a running world under a name of its own.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <string>

#include "lpss/model/world_description.h"

namespace tessera {

// As load_world_file(), and load_world_string() with "/" as its folder. INVALID_ARGUMENT for a file with no
// model, or with several.
absl::StatusOr<WorldDescription> load_model_file(const std::filesystem::path& file);
absl::StatusOr<WorldDescription> load_model_string(const std::string& xml);

// "robot" of "robot::arm::hand": the model of a body, a joint or a frame, by its name.
std::string model_of(const std::string& name);
std::string model_name(const WorldDescription& model);

// Gives the model another name, and so its bodies, joints and frames. INVALID_ARGUMENT for one that is empty,
// has '::', is no UTF-8, or is longer than kModelNameBytesMax.
absl::Status rename_model(const std::string& name, WorldDescription& model);
inline constexpr std::size_t kModelNameBytesMax = 200;

}  // namespace tessera
