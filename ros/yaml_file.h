// Files in YAML, whose faults are errors that name the file and the line.
#pragma once

#include <absl/status/statusor.h>
#include <absl/strings/str_cat.h>
#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>

namespace tessera::ros {

// NOT_FOUND, or INVALID_ARGUMENT, naming the file.
absl::StatusOr<YAML::Node> read_yaml(const std::string& file);

// INVALID_ARGUMENT: "FILE, line N: what".
template <typename... Parts>
absl::Status fault_at(const std::string& file, const YAML::Node& node, const Parts&... parts) {
  const YAML::Mark mark = node.Mark();
  return absl::InvalidArgumentError(
      absl::StrCat(file, mark.is_null() ? "" : absl::StrCat(", line ", mark.line + 1), ": ", parts...));
}

// The text of a scalar; nothing of what is none.
std::optional<std::string> text_of(const YAML::Node& node);

}  // namespace tessera::ros
