// What the command line changes of a world file.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lpss/world/world_description.h"
#include "worlds/loader/world_file.h"

namespace tessera::cli {

struct WorldOverrides {
  std::optional<Precision> precision;
  std::optional<double> sector_size;  // m
  std::optional<double> time_step;    // s
  std::optional<SeamPolicy> seams;
  std::optional<int> clone_depth;
  std::optional<std::uint32_t> island_cap;
  std::optional<std::uint64_t> shuffle;
  SectorOffset shift;  // the whole world, a planet included, is moved by this
};

// Reads the world file, applies the overrides and validates what comes out. Errors as load_world_file(),
// validate() and move_by(); OUT_OF_RANGE where a world is too large to be cut into other sectors.
absl::StatusOr<LoadedWorld> load_world(const std::filesystem::path& file, const WorldOverrides& overrides);

// The same world in sectors of another size: everything stays where it is, measured from the anchor's centre.
// OUT_OF_RANGE, naming the body or joint, for what is too far from there to be placed to the micrometre
// (2^40 m).
absl::Status change_sector_size(WorldDescription& world, double sector_size);

}  // namespace tessera::cli
