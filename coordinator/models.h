// Models, as they are spawned into a world.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "command.pb.h"
#include "lpss/model/world_description.h"

namespace tessera {

// Names for bodies and joints of a model that have none, by their places in it.
struct ModelNames {
  std::function<std::string(std::size_t)> body;
  std::function<std::string(std::size_t)> joint;
};

// A model as a world of these settings, for records_of() to check: with its prefix, at the pose where it is
// to be. Its assemblies are numbered from `first_assembly` on. INVALID_ARGUMENT with the element and the
// bound; OUT_OF_RANGE for places outside the 64-bit range of sectors.
absl::StatusOr<WorldDescription> placed_model(const v1::Spawn& spawn, const WorldSettings& settings,
                                              std::uint64_t first_assembly, const ModelNames& names);

}  // namespace tessera
