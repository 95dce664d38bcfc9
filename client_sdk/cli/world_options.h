// The options by which a command line changes a world file.
#pragma once

#include <absl/status/statusor.h>

#include <CLI/CLI.hpp>
#include <string>

#include "client_sdk/cli/world_overrides.h"

namespace tessera::cli {

absl::StatusOr<Precision> parse_precision(const std::string& text);
absl::StatusOr<SeamPolicy> parse_seams(const std::string& text);

// Adds --engine, --sector-size, --seams, --clone-depth, --island-cap, --shuffle, --dt and --shift.
// `overrides` must outlive the parsing.
void add_override_options(CLI::App& command, WorldOverrides& overrides);

}  // namespace tessera::cli
