#include "worlds/loader/world_file.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lpss/model/validate.h"
#include "worlds/loader/file_search.h"
#include "worlds/loader/world_reader.h"
#include "worlds/loader/xml.h"

namespace tessera {
namespace {

// libsdformat and assimp throw on unexpected input.
absl::StatusOr<WorldDescription> read(xml::File& file, Notices& notices, Looks* looks = nullptr) {
  try {
    return read_world(file, notices, looks);
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat(file.name(), ": ", error.what()));
  }
}

absl::StatusOr<LoadedWorld> load(xml::File& file, Faults faults) {
  Notices notices;
  LoadedWorld result;
  const WorldFolder folder(file.directory());
  absl::StatusOr<WorldDescription> world = read(file, notices);
  // What is wrong else may follow from what is missing.
  if (absl::Status status = notices.missing_files(); !status.ok()) return status;
  if (!world.ok()) return world.status();
  result.world = *std::move(world);
  if (absl::Status status = validate(result.world); !status.ok()) {
    return absl::Status(status.code(), absl::StrCat(file.name(), ": ", status.message()));
  }
  result.notices = notices.lines();
  result.repairs = notices.repairs();
  if (faults == Faults::kRefuse) {
    std::vector<std::string> refused = result.repairs;
    for (std::string& loss : notices.losses()) refused.push_back(std::move(loss));
    if (!refused.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat(file.name(), ": has faults: ", absl::StrJoin(refused, "; ")));
    }
  }
  return result;
}

}  // namespace

absl::StatusOr<Looks> load_looks(const std::filesystem::path& path) {
  absl::StatusOr<std::unique_ptr<xml::File>> file = xml::File::read(path);
  if (!file.ok()) return file.status();
  const WorldFolder folder((*file)->directory());
  Notices notices;
  Looks looks;
  absl::StatusOr<WorldDescription> world = read(**file, notices, &looks);
  if (!world.ok()) return world.status();
  looks.world = std::move(world->name);
  return looks;
}

absl::StatusOr<LoadedWorld> load_world_file(const std::filesystem::path& file, Faults faults) {
  absl::StatusOr<std::unique_ptr<xml::File>> xml = xml::File::read(file);
  if (!xml.ok()) return xml.status();
  return load(**xml, faults);
}

absl::StatusOr<LoadedWorld> load_world_string(const std::string& xml,
                                              const std::filesystem::path& base_directory, Faults faults) {
  absl::StatusOr<std::unique_ptr<xml::File>> file = xml::File::parse(xml, "<string>", base_directory);
  if (!file.ok()) return file.status();
  return load(**file, faults);
}

}  // namespace tessera
