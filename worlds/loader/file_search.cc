#include "worlds/loader/file_search.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "worlds/loader/fuel_cache.h"
#include "worlds/loader/package_index.h"
#include "worlds/loader/xml.h"

namespace tessera {
namespace {

using std::filesystem::path;

// Files and folders only: reading a pipe or a device may never end.
bool is_there(const path& file) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  return std::filesystem::is_regular_file(status) || std::filesystem::is_directory(status);
}

bool is_folder(const path& file) {
  std::error_code error;
  return std::filesystem::is_directory(file, error);
}

// An empty path is the current folder.
path absolute_folder(const path& folder) {
  const path whole = std::filesystem::absolute(folder.empty() ? "." : folder).lexically_normal();
  return whole.has_filename() ? whole : whole.parent_path();
}

struct Variable {
  const char* name;
  const char* below;   // the folder of models in each of its folders
  int package_levels;  // how far below that packages are found by the names in their package.xml
};
constexpr std::array<Variable, 7> kVariables = {Variable{"TESSERA_MODEL_PATH", "", 4},
                                                {"GZ_SIM_RESOURCE_PATH", "", 1},
                                                {"IGN_GAZEBO_RESOURCE_PATH", "", 1},
                                                {"GAZEBO_MODEL_PATH", "", 1},
                                                {"SDF_PATH", "", 1},
                                                {"AMENT_PREFIX_PATH", "share", 1},
                                                {"ROS_PACKAGE_PATH", "", 4}};

struct ListedFolder {
  path folder;
  int package_levels = 1;
};

std::vector<ListedFolder> listed_folders() {
  std::vector<ListedFolder> folders;
  for (const Variable& variable : kVariables) {
    const char* list = std::getenv(variable.name);
    if (list == nullptr) continue;
    for (absl::string_view folder : absl::StrSplit(list, ':', absl::SkipEmpty())) {
      folders.push_back({path(std::string(folder)) / variable.below, variable.package_levels});
    }
  }
  return folders;
}

// Whether a folder is that of one model or package.
bool is_package(const path& folder) {
  return is_there(folder / "model.config") || is_there(folder / "package.xml");
}

// Whether a URI is model://NAME/REST or package://NAME/REST, of which NAME/REST is left. Files in circulation
// have three slashes, too.
bool consume_package(absl::string_view& uri) {
  if (!absl::ConsumePrefix(&uri, "model://") && !absl::ConsumePrefix(&uri, "package://")) return false;
  absl::ConsumePrefix(&uri, "/");
  return true;
}

// NAME of such a URI; empty for others.
std::string package_of(absl::string_view uri) {
  return consume_package(uri) ? std::string(uri.substr(0, uri.find('/'))) : "";
}

// In these, files lie that name others beside their folder: "../meshes/arm.stl".
constexpr std::array<const char*, 8> kPartsOfPackages = {"urdf",  "sdf",    "xacro",  "robots",
                                                         "robot", "worlds", "models", "launch"};

// A folder counts as the package of its name where a file is at most so far below it.
constexpr int kLevelsBelowPackage = 2;

// `models` beside the folder `worlds` that `folder` is: the usual order in repositories, with or without a
// package around it. Empty for other folders.
path models_beside(const path& folder) {
  const bool has_worlds = folder.filename() == "worlds" || folder.filename() == "world";
  return has_worlds ? folder.parent_path() / "models" : path();
}

}  // namespace

// What is known while a world is read.
struct WorldFolder::Reading {
  path folder;  // absolute
  PackageIndex packages;
};

namespace {

thread_local WorldFolder::Reading* reading = nullptr;  // none while no world is read

// The folders from which a file in `directory` may take others: where it lies, where the model or package
// lies that it is part of, and those that the user lists.
std::vector<path> roots_of(const std::string& uri, const path& directory) {
  const path begin = absolute_folder(directory);
  std::vector<path> roots{begin};
  if (reading != nullptr) roots.push_back(reading->folder);
  int levels = 0;
  for (path folder = begin; folder.has_relative_path(); folder = folder.parent_path()) {
    if (is_package(folder)) roots.push_back(folder.parent_path());
    const bool is_part = std::ranges::find(kPartsOfPackages, folder.filename()) != kPartsOfPackages.end();
    if (levels == 0 && is_part) roots.push_back(folder.parent_path());
    if (const path models = models_beside(folder); levels <= kLevelsBelowPackage && !models.empty())
      roots.push_back(models);
    if (levels++ <= kLevelsBelowPackage && folder.filename() == package_of(uri)) roots.push_back(folder);
  }
  for (const ListedFolder& one : listed_folders()) roots.push_back(one.folder);
  return roots;
}

// Whether `file` is below one of `roots`, whatever links lead to it.
bool is_below(const path& file, const std::vector<path>& roots) {
  std::error_code error;
  const path real = std::filesystem::canonical(file, error);
  if (error) return false;
  return std::ranges::any_of(roots, [&](const path& root) {
    std::error_code missing;
    const path base = std::filesystem::canonical(root, missing);
    return !missing && std::mismatch(base.begin(), base.end(), real.begin(), real.end()).first == base.end();
  });
}

// The places of NAME/REST, from the nearest to the farthest. A file of a model or package finds NAME beside
// that model, and itself by its own name, whatever its folder is called.
std::vector<path> places_of_model(const path& rest, const path& directory) {
  std::vector<path> places{directory / rest, directory / "models" / rest};
  const path name = *rest.begin();
  const path inside = rest.lexically_relative(name);
  const path begin = absolute_folder(directory);
  int levels = 0;
  for (path folder = begin; folder.has_relative_path(); folder = folder.parent_path()) {
    const bool package = is_package(folder);
    if (package) places.push_back(folder.parent_path() / rest);
    if (package) places.push_back(folder / "models" / rest);
    if (const path models = models_beside(folder); levels <= kLevelsBelowPackage && !models.empty())
      places.push_back(models / rest);
    // Robots lie in the folder `urdf` of theirs, which may lack the file that says so.
    const bool has_name = folder.filename() == name && levels <= kLevelsBelowPackage;
    const bool may_be_inside = package || begin == folder / "urdf";
    if (has_name || (may_be_inside && inside != ".")) places.push_back(folder / inside);
    ++levels;
  }
  for (const ListedFolder& one : listed_folders()) places.push_back(one.folder / rest);
  return places;
}

// The places of NAME/REST in packages that have this name in their package.xml, and whose folders are called
// otherwise: beside the package that the file is part of, and in the folders of variables.
std::vector<path> places_by_package(const path& rest, const path& directory) {
  PackageIndex for_now;
  PackageIndex& packages = reading == nullptr ? for_now : reading->packages;
  const std::string name = rest.begin()->string();
  const path inside = rest.lexically_relative(name);
  std::vector<path> places;
  const auto search_in = [&](const path& folder, int levels) {
    if (const path package = packages.find(folder, levels, name); !package.empty())
      places.push_back(package / inside);
  };
  for (path folder = absolute_folder(directory); folder.has_relative_path(); folder = folder.parent_path()) {
    if (is_package(folder)) search_in(folder.parent_path(), 1);
  }
  for (const ListedFolder& one : listed_folders()) search_in(one.folder, one.package_levels);
  return places;
}

std::string joined(const std::vector<path>& places) {
  return absl::StrJoin(places, ", ", [](std::string* out, const path& place) {
    absl::StrAppend(out, place.lexically_normal().string());
  });
}

// Whether a file or folder is what is wanted.
using Accepts = bool (*)(const path&);

absl::StatusOr<path> first_of(const std::string& uri, const std::vector<path>& candidates,
                              Accepts accepts = is_there) {
  for (const path& candidate : candidates) {
    if (accepts(candidate)) return candidate.lexically_normal();
  }
  return absl::NotFoundError(absl::StrCat("'", uri, "' was not found; searched: ", joined(candidates)));
}

// A file, or a folder that holds a model: others may have its name, as those of packages and of pictures do.
bool is_model(const path& file) {
  if (!is_folder(file)) return is_there(file);
  return is_there(file / "model.config") || is_there(file / "model.sdf");
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
  if (consume_package(rest)) {
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
    for (const ListedFolder& one : listed_folders()) candidates.push_back(one.folder / *below);
  }
  return candidates;
}

// Of the collections in the network, what is on this machine.
absl::StatusOr<path> search_fuel(const std::string& uri, Accepts accepts) {
  const std::optional<FuelUri> fuel = fuel_uri(uri);
  if (!fuel) {
    return absl::InvalidArgumentError(absl::StrCat(
        "'", uri,
        "': only file://, model:// and package:// are supported, and models of Gazebo's collections"));
  }
  absl::StatusOr<path> found = first_of(uri, places_in_fuel_caches(*fuel), accepts);
  if (!found.ok() || is_below(*found, fuel_caches())) return found;
  return absl::InvalidArgumentError(
      absl::StrCat("'", uri, "' leads out of Gazebo's cache to ", found->string()));
}

// The first of the places of a URI that is accepted. `suffix` may be omitted in the URI.
absl::StatusOr<path> search(const std::string& uri, const path& directory, const char* suffix,
                            Accepts accepts) {
  if (is_remote(uri)) return search_fuel(uri, accepts);
  const absl::StatusOr<std::vector<path>> candidates = candidates_of(uri, directory, suffix);
  if (!candidates.ok()) return candidates.status();
  absl::StatusOr<path> found = first_of(uri, *candidates, accepts);
  if (absl::string_view rest = uri; !found.ok() && consume_package(rest)) {
    const absl::StatusOr<path> by_name =
        first_of(uri, places_by_package(*path_below(rest), directory), accepts);
    if (by_name.ok()) found = by_name;
  }
  if (found.ok()) {
    const std::vector<path> roots = roots_of(uri, directory);
    if (is_below(*found, roots)) return found;
    return absl::InvalidArgumentError(absl::StrCat(
        "'", uri, "' leads to ", found->string(), ", which is in none of the folders of this file (",
        joined(roots), "): list its folder in TESSERA_MODEL_PATH if you trust the file"));
  }
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

WorldFolder::WorldFolder(const path& folder)
    : reading_(std::make_unique<Reading>(Reading{absolute_folder(folder), {}})),
      before_(std::exchange(reading, reading_.get())) {}
WorldFolder::~WorldFolder() { reading = before_; }

absl::StatusOr<path> find_uri(const std::string& uri, const path& directory) {
  return search(uri, directory, "", is_there);
}

absl::StatusOr<path> find_model(const std::string& uri, const path& directory) {
  absl::StatusOr<path> found = search(uri, directory, ".sdf", is_model);
  if (!found.ok() || !is_folder(*found)) return found;
  const path folder = *found;
  found = file_of_folder(folder);
  if (found.ok() && !is_below(*found, {folder})) {
    return absl::InvalidArgumentError(
        absl::StrCat("'", uri, "': ", found->string(), " leads out of the model's folder"));
  }
  return found;
}

bool is_file_below(const path& file, const path& folder) {
  return is_there(file) && !is_folder(file) && is_below(file, {folder});
}

}  // namespace tessera
