#include "worlds/loader/file_search.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <array>
#include <cstdlib>
#include <optional>
#include <system_error>
#include <vector>

#include "worlds/loader/xml.h"

namespace tessera {
namespace {

using std::filesystem::path;

bool is_there(const path& file) {
  std::error_code error;
  return std::filesystem::exists(file, error);
}

bool is_folder(const path& file) {
  std::error_code error;
  return std::filesystem::is_directory(file, error);
}

struct Variable {
  const char* name;
  const char* below;  // the folder of models in each of its folders
};
constexpr std::array<Variable, 7> kVariables = {Variable{"TESSERA_MODEL_PATH", ""},
                                                {"GZ_SIM_RESOURCE_PATH", ""},
                                                {"IGN_GAZEBO_RESOURCE_PATH", ""},
                                                {"GAZEBO_MODEL_PATH", ""},
                                                {"SDF_PATH", ""},
                                                {"AMENT_PREFIX_PATH", "share"},
                                                {"ROS_PACKAGE_PATH", ""}};

std::vector<path> folders_of_variables() {
  std::vector<path> folders;
  for (const Variable& variable : kVariables) {
    const char* list = std::getenv(variable.name);
    if (list == nullptr) continue;
    for (absl::string_view folder : absl::StrSplit(list, ':', absl::SkipEmpty())) {
      folders.push_back(path(std::string(folder)) / variable.below);
    }
  }
  return folders;
}

// Whether a folder is that of one model or package.
bool is_package(const path& folder) {
  return is_there(folder / "model.config") || is_there(folder / "package.xml");
}

// The places of NAME/REST, from the nearest to the farthest. A file of a model or package finds NAME beside
// that model, and itself by its own name, whatever its folder is called.
std::vector<path> places_of_model(const path& rest, const path& directory) {
  std::vector<path> places{directory / rest, directory / "models" / rest};
  const path name = *rest.begin();
  const path inside = rest.lexically_relative(name);
  const path begin = std::filesystem::absolute(directory).lexically_normal();
  for (path folder = begin; folder.has_relative_path(); folder = folder.parent_path()) {
    const bool package = is_package(folder);
    if (package) places.push_back(folder.parent_path() / rest);
    // Robots lie in the folder `urdf` of theirs, which may lack the file that says so.
    if (package || folder.filename() == name || begin == folder / "urdf") places.push_back(folder / inside);
  }
  for (const path& one : folders_of_variables()) places.push_back(one / rest);
  return places;
}

absl::StatusOr<path> first_of(const std::string& uri, const std::vector<path>& candidates) {
  for (const path& candidate : candidates) {
    if (is_there(candidate)) return candidate.lexically_normal();
  }
  const std::string places = absl::StrJoin(candidates, ", ", [](std::string* out, const path& candidate) {
    absl::StrAppend(out, candidate.lexically_normal().string());
  });
  return absl::NotFoundError(absl::StrCat("'", uri, "' was not found; searched: ", places));
}

// A path below a folder that is given; none if it leaves it.
std::optional<path> path_below(absl::string_view text) {
  const path result = path(std::string(text)).lexically_normal();
  if (result.empty() || result.is_absolute() || *result.begin() == ".." || *result.begin() == ".")
    return std::nullopt;
  return result;
}

// The candidate places of a URI, in order. `suffix` may be omitted in the URI.
absl::StatusOr<std::vector<path>> candidates_of(const std::string& uri, const path& directory,
                                                const char* suffix) {
  absl::string_view rest = uri;
  if (rest.empty()) return absl::InvalidArgumentError("the URI is empty");
  std::vector<path> candidates;
  if (absl::ConsumePrefix(&rest, "model://") || absl::ConsumePrefix(&rest, "package://")) {
    const std::optional<path> below = path_below(rest);
    if (!below) {
      return absl::InvalidArgumentError(
          absl::StrCat("'", uri, "' must name a model, and must not leave the folders of models"));
    }
    for (const path& place : places_of_model(*below, directory)) {
      candidates.push_back(place);
      if (*suffix != '\0') candidates.push_back(path(place) += suffix);
    }
    return candidates;
  }
  absl::ConsumePrefix(&rest, "file://");
  if (absl::StrContains(rest, "://")) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", uri, "': only file://, model:// and package:// are supported"));
  }
  candidates.push_back(directory / std::string(rest));
  if (const std::optional<path> below = path_below(rest)) {
    for (const path& folder : folders_of_variables()) candidates.push_back(folder / *below);
  }
  return candidates;
}

// first_of(), saying how more places can be named.
absl::StatusOr<path> search(const std::string& uri, const std::vector<path>& candidates) {
  absl::StatusOr<path> found = first_of(uri, candidates);
  if (found.ok()) return found;
  return absl::NotFoundError(absl::StrCat(found.status().message(),
                                          "; set TESSERA_MODEL_PATH, GZ_SIM_RESOURCE_PATH, SDF_PATH or "
                                          "AMENT_PREFIX_PATH to search in more folders"));
}

// The file that represents a model's folder.
absl::StatusOr<path> file_of_folder(const path& folder) {
  if (is_there(folder / "model.config")) {
    auto config = xml::File::read(folder / "model.config");
    if (!config.ok()) return config.status();
    // Folders hold one file for each version of SDF; the last one is the newest by convention.
    const xml::Element* newest = (*config)->root().LastChildElement("sdf");
    if (newest == nullptr) return xml::invalid((*config)->root(), "names no <sdf> file");
    const std::optional<path> below = path_below(xml::text_of(*newest));
    if (!below)
      return xml::invalid(*newest, "'", xml::text_of(*newest), "' must be a file in the model's folder");
    return first_of(xml::text_of(*newest), {folder / *below});
  }
  return first_of(folder.string(), {folder / "model.sdf"});
}

}  // namespace

absl::StatusOr<path> find_uri(const std::string& uri, const path& directory) {
  const absl::StatusOr<std::vector<path>> candidates = candidates_of(uri, directory, "");
  if (!candidates.ok()) return candidates.status();
  return search(uri, *candidates);
}

absl::StatusOr<path> find_model(const std::string& uri, const path& directory) {
  const absl::StatusOr<std::vector<path>> candidates = candidates_of(uri, directory, ".sdf");
  if (!candidates.ok()) return candidates.status();
  absl::StatusOr<path> found = search(uri, *candidates);
  if (!found.ok() || !is_folder(*found)) return found;
  return file_of_folder(*found);
}

bool is_remote(const std::string& uri) {
  return absl::StartsWith(uri, "http://") || absl::StartsWith(uri, "https://");
}

}  // namespace tessera
