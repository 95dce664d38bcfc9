// Worlds as message files: a tessera.v1.World, as written by `tessera convert`, for programs that do not read
// SDF.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>

#include "lpss/model/world_description.h"

namespace tessera {

inline constexpr const char* kWorldMessageExtension = ".pb";

// UNAVAILABLE if the file cannot be written.
absl::Status write_world_message(const std::filesystem::path& file, const WorldDescription& world);

// NOT_FOUND if there is no such file, INVALID_ARGUMENT, naming the file, if it is not a world. Does not check
// bounds: see validate().
absl::StatusOr<WorldDescription> read_world_message(const std::filesystem::path& file);

}  // namespace tessera
