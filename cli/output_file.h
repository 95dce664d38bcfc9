// Files that commands write for other programs.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace tessera::cli {

// The path of a file that is there and may be written, or may be made. INVALID_ARGUMENT, naming the file and
// the reason, for others: known before there is anything to write. Nothing is opened, made or changed.
absl::StatusOr<std::filesystem::path> parse_output_file(const std::string& text);

// UNAVAILABLE, naming the file and the reason, where it cannot be written.
absl::Status write_text(const std::filesystem::path& file, const std::string& text);
absl::Status write_json(const std::filesystem::path& file, const nlohmann::json& json);

}  // namespace tessera::cli
