#include "cli/world_overrides.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "lpss/model/validate.h"
#include "tessera/world_message.h"

namespace tessera::cli {
namespace {

absl::StatusOr<LoadedWorld> read_world(const std::filesystem::path& file, bool strict) {
  if (file.extension() != kWorldMessageExtension) {
    return load_world_file(file, strict ? Faults::kRefuse : Faults::kRepair);
  }
  absl::StatusOr<WorldDescription> world = read_world_message(file);
  if (!world.ok()) return world.status();
  return LoadedWorld{.world = *std::move(world)};
}

}  // namespace

absl::StatusOr<LoadedWorld> load_world(const std::filesystem::path& file, const WorldOverrides& overrides) {
  absl::StatusOr<LoadedWorld> loaded = read_world(file, overrides.strict);
  if (!loaded.ok()) return loaded.status();
  if (absl::Status status = apply(overrides, loaded->world); !status.ok()) return status;
  return loaded;
}

absl::Status apply(const WorldOverrides& overrides, WorldDescription& world) {
  if (absl::Status status = apply(overrides.knobs, world); !status.ok()) return status;
  if (absl::Status status = move_by(world, overrides.shift); !status.ok()) {
    return absl::Status(status.code(), absl::StrCat("--shift: ", status.message()));
  }
  return validate(world);
}

}  // namespace tessera::cli
