#include "viewer/world_shelf.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <system_error>
#include <utility>

namespace tessera::viewer {
namespace {

constexpr const char* kWorld = ".sdf";
constexpr const char* kSnapshot = ".snapshot";
constexpr std::size_t kHeadBytes = 4096;
constexpr std::size_t kTextMax = 240;

std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder, const char* extension) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator next(folder, error), end; !error && next != end;
       next.increment(error)) {
    if (next->path().extension() == extension && next->is_regular_file(error)) files.push_back(next->path());
  }
  std::sort(files.begin(), files.end());
  if (files.size() > kShelfMax) files.resize(kShelfMax);
  return files;
}

std::string first_sentence(const std::filesystem::path& file) {
  std::string head(kHeadBytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  const std::size_t from = head.find("<!--");
  const std::size_t to = head.find("-->", from);
  if (from == std::string::npos || to == std::string::npos) return "";
  const std::string comment = head.substr(from + 4, to - from - 4);
  std::string text =
      absl::StrJoin(absl::StrSplit(comment, absl::ByAnyChar(" \t\r\n"), absl::SkipEmpty()), " ");
  text = text.substr(0, text.find(". "));
  if (text.size() > kTextMax) text = absl::StrCat(text.substr(0, text.rfind(' ', kTextMax)), " ...");
  return text;
}

absl::StatusOr<std::filesystem::path> named(const std::vector<std::filesystem::path>& files,
                                            const std::string& name, const char* kind) {
  const auto found =
      std::ranges::find_if(files, [&](const std::filesystem::path& file) { return file.stem() == name; });
  if (found != files.end()) return *found;
  return absl::NotFoundError(absl::StrCat("this web UI has no ", kind, " of the name '", name, "'"));
}

bool is_name(const std::string& name) {
  const auto is_letter = [](char c) { return absl::ascii_isalnum(static_cast<unsigned char>(c)); };
  return !name.empty() && name.size() <= kSnapshotNameMax && is_letter(name.front()) &&
         std::ranges::all_of(name, [&](char c) { return is_letter(c) || c == '-' || c == '_' || c == '.'; });
}

std::filesystem::path folder_named_by(const char* variable) {
  const char* value = std::getenv(variable);
  return value == nullptr ? "" : value;
}

std::filesystem::path state_of_user(const char* what) {
  if (const auto folder = folder_named_by("STATE_DIRECTORY"); !folder.empty()) return folder / what;
  if (const auto folder = folder_named_by("XDG_STATE_HOME"); !folder.empty())
    return folder / "tessera" / what;
  if (const auto folder = folder_named_by("HOME"); !folder.empty())
    return folder / ".local/state/tessera" / what;
  return {};
}

}  // namespace

WorldShelf::WorldShelf(std::filesystem::path worlds, std::filesystem::path snapshots)
    : worlds_(std::move(worlds)), snapshots_(std::move(snapshots)) {}

std::vector<ShelfWorld> WorldShelf::worlds() const {
  std::vector<ShelfWorld> found;
  for (const std::filesystem::path& file : files_of(worlds_, kWorld))
    found.push_back({file.stem().string(), first_sentence(file)});
  return found;
}

std::vector<ShelfSnapshot> WorldShelf::snapshots() const {
  std::vector<ShelfSnapshot> found;
  for (const std::filesystem::path& file : files_of(snapshots_, kSnapshot)) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    if (!error) found.push_back({file.stem().string(), bytes});
  }
  return found;
}

absl::StatusOr<std::filesystem::path> WorldShelf::world(const std::string& name) const {
  return named(files_of(worlds_, kWorld), name, "world");
}

absl::StatusOr<std::filesystem::path> WorldShelf::snapshot(const std::string& name) const {
  return named(files_of(snapshots_, kSnapshot), name, "snapshot");
}

absl::StatusOr<std::filesystem::path> new_file(const std::filesystem::path& folder, const std::string& name,
                                               const char* extension, const char* kind) {
  if (folder.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("this web UI has no folder for ", kind, "s: start it with --", kind, "s FOLDER"));
  }
  if (!is_name(name)) {
    return absl::InvalidArgumentError(
        absl::StrCat("name: use 1 to ", kSnapshotNameMax,
                     " letters, digits, '-', '_' and '.', with a letter or a digit in front"));
  }
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return absl::UnavailableError(absl::StrCat(folder.string(), ": ", error.message()));
  std::filesystem::path file = folder / absl::StrCat(name, extension);
  if (std::filesystem::exists(file, error)) {
    return absl::AlreadyExistsError(
        absl::StrCat("there is a ", kind, " of the name '", name, "': choose another one"));
  }
  if (files_of(folder, extension).size() >= kShelfMax) {
    return absl::ResourceExhaustedError(absl::StrCat(folder.string(), " has ", kShelfMax, " ", kind,
                                                     "s, and more are not kept: remove some"));
  }
  return file;
}

absl::StatusOr<std::filesystem::path> WorldShelf::new_snapshot(const std::string& name) const {
  return new_file(snapshots_, name, kSnapshot, "snapshot");
}

std::filesystem::path worlds_of_installation(const std::filesystem::path& executable_folder) {
  std::error_code error;
  for (const char* place : {"../share/tessera/worlds", "../../../worlds"}) {
    std::filesystem::path folder = std::filesystem::weakly_canonical(executable_folder / place, error);
    if (!error && std::filesystem::is_directory(folder, error)) return folder;
  }
  return {};
}

std::filesystem::path snapshots_of_user() { return state_of_user("snapshots"); }
std::filesystem::path recordings_of_user() { return state_of_user("recordings"); }

}  // namespace tessera::viewer
