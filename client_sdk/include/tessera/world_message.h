// Worlds as message files: a tessera.v1.World, as `tessera convert` writes it, for programs that load worlds
// without reading SDF.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>

#include "lpss/model/world_description.h"

namespace tessera {

inline constexpr const char* kWorldMessageExtension = ".pb";

// UNAVAILABLE where the file cannot be written.
absl::Status write_world_message(const std::filesystem::path& file, const WorldDescription& world);

// NOT_FOUND where there is no such file, INVALID_ARGUMENT, naming the file, where it is no world. Bounds are
// validate()'s business.
absl::StatusOr<WorldDescription> read_world_message(const std::filesystem::path& file);

}  // namespace tessera
