// What the command line changes of a world file.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>

#include "worlds/knobs.h"
#include "worlds/loader/world_file.h"

namespace tessera::cli {

struct WorldOverrides {
  Knobs knobs;
  bool strict = false;  // refuse a file with faults that could be mended
  SectorOffset shift;   // the whole world, a planet included, is moved by this
};

// Reads the world file (SDF, URDF, MJCF, or NAME.pb, a message), applies the overrides and validates what
// comes out. Errors as load_world_file(), read_world_message(), validate() and move_by(); OUT_OF_RANGE where
// a world is too large to be cut into other sectors.
absl::StatusOr<LoadedWorld> load_world(const std::filesystem::path& file, const WorldOverrides& overrides);

// Changes and validates a world that comes from elsewhere. Errors likewise.
absl::Status apply(const WorldOverrides& overrides, WorldDescription& world);

}  // namespace tessera::cli
