#include "ros/yaml_file.h"

#include <yaml-cpp/exceptions.h>

namespace tessera::ros {

absl::StatusOr<YAML::Node> read_yaml(const std::string& file) {
  try {
    return YAML::LoadFile(file);
  } catch (const YAML::BadFile&) {
    return absl::NotFoundError(absl::StrCat("cannot read ", file));
  } catch (const YAML::Exception& fault) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, ", line ", fault.mark.line + 1, ": not YAML: ", fault.msg));
  }
}

std::optional<std::string> text_of(const YAML::Node& node) {
  if (!node.IsDefined() || !node.IsScalar()) return std::nullopt;
  return node.Scalar();
}

}  // namespace tessera::ros
