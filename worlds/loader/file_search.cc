#include "worlds/loader/file_search.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>
#include <absl/strings/strip.h>

#include <cstdlib>
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

std::vector<path> model_folders(const path& directory) {
  std::vector<path> folders{directory, directory / "models"};
  if (const char* list = std::getenv("TESSERA_MODEL_PATH"); list != nullptr) {
    for (absl::string_view folder : absl::StrSplit(list, ':', absl::SkipEmpty()))
      folders.emplace_back(std::string(folder));
  }
  return folders;
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

// The candidate places of a URI, in order. `suffix` may be omitted in the URI.
absl::StatusOr<std::vector<path>> candidates_of(const std::string& uri, const path& directory,
                                                const char* suffix) {
  absl::string_view rest = uri;
  if (rest.empty()) return absl::InvalidArgumentError("the URI is empty");
  std::vector<path> candidates;
  if (absl::ConsumePrefix(&rest, "model://") || absl::ConsumePrefix(&rest, "package://")) {
    for (const path& folder : model_folders(directory)) {
      candidates.push_back(folder / std::string(rest));
      if (*suffix != '\0') candidates.push_back(folder / absl::StrCat(rest, suffix));
    }
    return candidates;
  }
  absl::ConsumePrefix(&rest, "file://");
  if (absl::StrContains(rest, "://")) {
    return absl::InvalidArgumentError(absl::StrCat("'", uri, "': only file:// and model:// are supported"));
  }
  candidates.push_back(directory / std::string(rest));
  return candidates;
}

// The file that represents a model's folder.
absl::StatusOr<path> file_of_folder(const path& folder) {
  if (is_there(folder / "model.config")) {
    auto config = xml::File::read(folder / "model.config");
    if (!config.ok()) return config.status();
    // Folders hold one file for each version of SDF; the last one is the newest by convention.
    const xml::Element* newest = (*config)->root().LastChildElement("sdf");
    if (newest == nullptr) return xml::invalid((*config)->root(), "names no <sdf> file");
    return first_of(xml::text_of(*newest), {folder / xml::text_of(*newest)});
  }
  return first_of(folder.string(), {folder / "model.sdf"});
}

}  // namespace

absl::StatusOr<path> find_uri(const std::string& uri, const path& directory) {
  const absl::StatusOr<std::vector<path>> candidates = candidates_of(uri, directory, "");
  if (!candidates.ok()) return candidates.status();
  return first_of(uri, *candidates);
}

absl::StatusOr<path> find_model(const std::string& uri, const path& directory) {
  const absl::StatusOr<std::vector<path>> candidates = candidates_of(uri, directory, ".sdf");
  if (!candidates.ok()) return candidates.status();
  absl::StatusOr<path> found = first_of(uri, *candidates);
  if (!found.ok() || !is_folder(*found)) return found;
  return file_of_folder(*found);
}

bool is_remote(const std::string& uri) {
  return absl::StartsWith(uri, "http://") || absl::StartsWith(uri, "https://");
}

}  // namespace tessera
