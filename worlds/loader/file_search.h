// Finds the files that a world file refers to.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>
#include <string>

namespace tessera {

// The folder of the world that this thread reads, as long as the object lives: all files that the world takes
// in may take others from there. It knows the packages that were found by their names, so that folders are
// read once.
class WorldFolder {
 public:
  explicit WorldFolder(const std::filesystem::path& folder);
  ~WorldFolder();
  WorldFolder(const WorldFolder&) = delete;
  WorldFolder& operator=(const WorldFolder&) = delete;

  struct Reading;

 private:
  std::unique_ptr<Reading> reading_;
  Reading* before_;
};

// A file or folder of this machine for a URI in a file of `directory`. Relative paths and file:// start
// there; model://name/rest and package://name/rest are searched there, in `models` beside it, in `models`
// beside a folder `worlds` that the file is in, and in the model or package that the file is part of: beside
// it, in its `models`, and in it if that is its name. Then all but absolute paths are searched in the folders
// that environment variables list, separated by colons: TESSERA_MODEL_PATH, GZ_SIM_RESOURCE_PATH,
// IGN_GAZEBO_RESOURCE_PATH, GAZEBO_MODEL_PATH, SDF_PATH, AMENT_PREFIX_PATH (in `share`), ROS_PACKAGE_PATH. A
// package whose folder has another name is found by that in its package.xml, in the same folders, and up to
// four levels below those of ROS_PACKAGE_PATH and TESSERA_MODEL_PATH. https://server/owner/models/name is
// searched in Gazebo's cache (fuel_cache.h). NOT_FOUND with all places searched; INVALID_ARGUMENT for an
// empty URI, another scheme, or a name of a model that leaves these folders ("model://../secret").
//
// A world of a stranger must not make this machine read any file, so what is found must lie, whatever links
// lead to it: in `directory`; in that of the world (WorldFolder); in the folder of the model or package that
// the file is part of, or beside it; beside `directory` if that is a usual part of a package ("urdf",
// "worlds"); or in a folder that the variables list. INVALID_ARGUMENT, with these folders, for anything else.
// Pipes and devices are not found.
absl::StatusOr<std::filesystem::path> find_uri(const std::string& uri,
                                               const std::filesystem::path& directory);

// The same for a model: a folder means the SDF file that its model.config names, or its model.sdf, and one
// that has neither is passed over; model://name also finds name.sdf.
absl::StatusOr<std::filesystem::path> find_model(const std::string& uri,
                                                 const std::filesystem::path& directory);

// Whether `file` is a file (no pipe, no device) below `folder`, whatever links lead to it.
bool is_file_below(const std::filesystem::path& file, const std::filesystem::path& folder);

}  // namespace tessera
