// Finds the files that a world file refers to.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <string>

namespace tessera {

// A file or folder of this machine for a URI in a file of `directory`. Relative paths and file:// start
// there; model://name/rest (and package://) is searched there, in `models` beside it and in every folder of
// the environment variable TESSERA_MODEL_PATH (separated by colons).
// NOT_FOUND with all places searched; INVALID_ARGUMENT for an empty URI or another scheme.
absl::StatusOr<std::filesystem::path> find_uri(const std::string& uri,
                                               const std::filesystem::path& directory);

// The same for a model: a folder means the SDF file that its model.config names, or its model.sdf;
// model://name also finds name.sdf.
absl::StatusOr<std::filesystem::path> find_model(const std::string& uri,
                                                 const std::filesystem::path& directory);

// Whether a URI is http:// or https://, which are not supported.
bool is_remote(const std::string& uri);

}  // namespace tessera
