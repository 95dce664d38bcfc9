// The knobs of a world, apart from the world: what a command line, a file of settings or a search changes.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "lpss/model/world_description.h"

namespace tessera {

// Settings that are to change; the others stay as the world has them. Units as in WorldSettings.
struct Knobs {
  std::optional<Precision> precision;
  std::optional<double> sector_size;
  std::optional<double> time_step;
  std::optional<SeamPolicy> seams;
  std::optional<int> clone_depth;
  std::optional<std::uint32_t> island_cap;
  std::optional<std::uint64_t> shuffle;
  std::optional<int> solver_iterations;
  std::optional<int> substeps;
  std::optional<bool> adapt;
  std::optional<double> warm_starting;
  std::optional<double> split_from;
  std::optional<bool> friction_in_two_directions;
  std::optional<bool> continuous_collision;
  std::optional<double> sleep_linear_speed;
  std::optional<double> sleep_angular_speed;
  std::optional<double> sleep_after;
};

// Changes the world's settings; with another sector size everything stays where it is. Bounds are checked by
// validate(), except those of a sector size. Errors as change_sector_size().
absl::Status apply(const Knobs& knobs, WorldDescription& world);

// An object with the names that <tessera:settings> has, of what is to change.
nlohmann::ordered_json to_json(const Knobs& knobs);
// INVALID_ARGUMENT, naming the setting, for one that does not exist or is of another kind.
absl::StatusOr<Knobs> knobs_from_json(const nlohmann::ordered_json& json);

// The same world in sectors of another size: everything stays where it is, measured from the anchor's centre.
// OUT_OF_RANGE, naming the body or joint, for what is too far from there to be placed to the micrometre
// (2^40 m). INVALID_ARGUMENT for a size that is out of bounds.
absl::Status change_sector_size(WorldDescription& world, double sector_size);

}  // namespace tessera
