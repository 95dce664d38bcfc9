#include "worlds/loader/model_file.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <set>
#include <utility>

#include "lpss/base/utf8.h"
#include "worlds/loader/world_file.h"

namespace tessera {
namespace {

absl::StatusOr<WorldDescription> one_model(absl::StatusOr<LoadedWorld> loaded) {
  if (!loaded.ok()) return loaded.status();
  std::set<std::string> names;
  for (const BodyDescription& body : loaded->world.bodies) names.insert(model_of(body.name));
  if (names.size() != 1)
    return absl::InvalidArgumentError(
        absl::StrCat("the file has ", names.size(), " models; only one can be spawned"));
  return std::move(loaded->world);
}

}  // namespace

absl::StatusOr<WorldDescription> load_model_file(const std::filesystem::path& file) {
  return one_model(load_world_file(file));
}

absl::StatusOr<WorldDescription> load_model_string(const std::string& xml) {
  return one_model(load_world_string(xml, "/"));
}

std::string model_of(const std::string& name) { return name.substr(0, name.find("::")); }

std::string model_name(const WorldDescription& model) { return model_of(model.bodies.front().name); }

absl::Status rename_model(const std::string& name, WorldDescription& model) {
  if (name.empty() || name.size() > kModelNameBytesMax || absl::StrContains(name, "::") || !is_utf8(name)) {
    return absl::InvalidArgumentError(absl::StrCat("the name of a model must be UTF-8 without '::', of 1 to ",
                                                   kModelNameBytesMax, " bytes"));
  }
  const std::string before = model_name(model) + "::";
  const auto rename = [&](std::string& part) {
    if (absl::StartsWith(part, before)) part.replace(0, before.size(), name + "::");
  };
  for (BodyDescription& body : model.bodies) rename(body.name);
  for (JointDescription& joint : model.joints) rename(joint.name);
  for (FrameDescription& frame : model.frames) rename(frame.name);
  return absl::OkStatus();
}

}  // namespace tessera
