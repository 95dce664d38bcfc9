// World files: SDF 1.6 to 1.9, URDF and MuJoCo's MJCF, read into a world as data.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <string>
#include <vector>

#include "lpss/model/world_description.h"
#include "worlds/loader/look.h"

namespace tessera {

struct LoadedWorld {
  WorldDescription world;            // has passed validate()
  std::vector<std::string> notices;  // joints, and unsupported elements: one line per kind, with its count
  std::vector<std::string> repairs;  // faults of the file that were mended, likewise
};

// What to do with a file that has faults that can be mended: links without mass, impossible moments of
// inertia, flat meshes, unknown elements and others; and with one that has more than the world that is read
// from it: models of the network that are not here, and what hangs on them. worlds/README.md lists both.
enum class Faults {
  kRepair,
  kRefuse,  // INVALID_ARGUMENT with all of them
};

// Reads an SDF world, an SDF model, a URDF robot or an MJCF model; the content decides which. A model or a
// robot becomes a world of its own with default settings. Includes and meshes are files of this machine;
// elements that are not physics (lights, visuals, cameras, unknown plugins) are skipped and counted.
//
// Elements with the prefix `tessera:` are read as well; tessera_elements.h lists them.
//
// NOT_FOUND if the file does not exist, or with all includes and meshes that do not; INVALID_ARGUMENT, with
// file, line and element, for invalid input: malformed, too large or too deeply nested XML, numbers out of
// bounds, names used twice; OUT_OF_RANGE for positions outside the 64-bit range of sectors;
// FAILED_PRECONDITION for MJCF without MuJoCo, which reads it, with the package to install.
//
// Thread-safe; libsdformat and MuJoCo are used by one thread at a time.
absl::StatusOr<LoadedWorld> load_world_file(const std::filesystem::path& file,
                                            Faults faults = Faults::kRepair);

// The same for text in memory. Relative includes and meshes are searched in `base_directory`.
absl::StatusOr<LoadedWorld> load_world_string(const std::string& xml,
                                              const std::filesystem::path& base_directory,
                                              Faults faults = Faults::kRepair);

// What the bodies of a world file look like, by its visuals, for whoever shows it: shapes, meshes with the
// colours of their materials, and the colours of the file. Textures are not read. Errors as above; visuals
// whose meshes are not there are left out.
absl::StatusOr<Looks> load_looks(const std::filesystem::path& file);

}  // namespace tessera
