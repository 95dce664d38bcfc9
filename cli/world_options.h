// The options by which a command line changes a world file.
#pragma once

#include <absl/status/statusor.h>

#include <CLI/CLI.hpp>
#include <string>

#include "cli/world_overrides.h"

namespace tessera::cli {

// What load_world() takes, for the help.
inline constexpr const char* kWorldFile = "SDF, URDF or MJCF file, or NAME.pb of tessera convert";

absl::StatusOr<Precision> parse_precision(const std::string& text);

// NOT_FOUND, INVALID_ARGUMENT, naming the file.
absl::StatusOr<Knobs> read_knobs(const std::string& file);

// Adds --settings, an option for each setting of a world, --strict and --shift.
// `overrides` must outlive the parsing.
void add_override_options(CLI::App& command, WorldOverrides& overrides);

// The options that give these overrides, each with a blank before it; numbers as exactly as they are.
std::string options_of(const WorldOverrides& overrides);

}  // namespace tessera::cli
