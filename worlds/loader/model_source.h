// Prepares models of SDF files for libsdformat: without elements that are not physics, with includes
// resolved.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lpss/model/program.h"
#include "worlds/loader/collision_shape.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/visuals.h"
#include "worlds/loader/xml.h"

namespace tessera {

// The name of every model in the documents that libsdformat reads.
inline constexpr char kAnyModel[] = "tessera:model";

// A prepared <model> element, owned by its document.
struct ModelSource {
  std::string version;  // of SDF
  std::string name;
  std::optional<xml::RelativePose> pose;  // its own; an include may override it
  std::string pose_xml;                   // the same as it was written
  std::string placement_frame;
  xml::Element* element = nullptr;  // without pose and placement frame
  bool is_empty = false;            // all that it consists of was left out
  Notices notices;                  // what was removed

  // A whole document with this model in it, named kAnyModel, for ModelTemplates: equal for models equal but
  // for name and pose.
  std::string document(std::optional<bool> is_static) const;
};

class ModelSources {
 public:
  ModelSources(MeshLibrary& meshes, ShapeSource shapes) : meshes_(meshes), shapes_(shapes) {}

  // Prepares a <model> of a file in `directory`, in place. `version` is that of its file.
  // Errors name file, line and element: INVALID_ARGUMENT for invalid or out-of-bounds numbers, unknown
  // tessera: elements, includes nested too deeply or in a circle. Includes and meshes that are not there are
  // told in the notices.
  absl::StatusOr<ModelSource> prepare(xml::Element& model, const std::string& version,
                                      const std::filesystem::path& directory);

  // The model that an <include> of a file in `directory` names, read once. nullptr, and a notice, for one
  // that is not here (of the network), that is not there at all, and for another element (a light). Pointers
  // stay valid.
  absl::StatusOr<const ModelSource*> included(const xml::Element& include,
                                              const std::filesystem::path& directory, Notices& notices);

  // Of all programs so far.
  const ProgramModules& modules() const { return modules_; }

 private:
  struct IncludedFile {
    bool reading = true;
    std::unique_ptr<xml::File> file;
    std::optional<ModelSource> model;  // none in a file of lights or actors
  };
  // What stood in the place of an <include> inside a model, which may have to be converted first.
  struct Slot {
    const ModelSource* model = nullptr;
    std::string name;
    std::string pose_xml;
    std::string placement_frame;
    std::optional<bool> is_static;
    bool is_merged = false;
  };

  // The includes in a model.
  struct Includes {
    std::vector<Slot> slots;
    bool lacks_some = false;  // they were left out
  };

  // A file by its path; or a built-in one, whose text is given, by its URI. With the plugins that an
  // <include> has for its model, it is a file of its own.
  absl::StatusOr<const ModelSource*> included_file(const xml::Element& include, const std::string& name,
                                                   const char* builtin, Notices& notices);
  absl::Status read_file(const xml::Element& include, IncludedFile& entry, Notices& notices);
  absl::Status clean(xml::Element& element, const std::filesystem::path& directory, Includes& includes,
                     Notices& notices);
  absl::Status take_include(xml::Element& include, const std::filesystem::path& directory, Includes& includes,
                            Notices& notices);
  absl::Status fill(xml::Element& model, const std::string& version, const std::vector<Slot>& slots);
  absl::StatusOr<xml::Element*> to_latest(const xml::Element& model, const std::string& version);
  absl::Status take_given(const xml::Element& kind, const std::filesystem::path& directory, Notices& notices);
  absl::Status take_mesh(xml::Element& mesh, const std::filesystem::path& directory, Notices& notices);

  MeshLibrary& meshes_;
  const ShapeSource shapes_;
  ProgramModules modules_;
  absl::flat_hash_map<std::string, std::unique_ptr<IncludedFile>> files_;  // by canonical path
  std::vector<std::unique_ptr<xml::File>> converted_;                      // documents that sources live in
  int depth_ = 0;
  std::size_t bytes_ = 0;  // of models put in the place of nested includes
};

// The version of an SDF root element, "1.9" for newer ones (counted in `notices`).
// INVALID_ARGUMENT where there is none.
absl::StatusOr<std::string> sdf_version(const xml::Element& root, Notices& notices);

}  // namespace tessera
