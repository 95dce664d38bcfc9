// A model as libsdformat understands it, without its place in the world: made once, used by every model that
// is equal but for name and pose.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

#include "lpss/engine/body.h"
#include "worlds/loader/collision_shape.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/shape_table.h"

namespace tessera {

struct LinkTemplate {
  std::string name;  // "link", "nested::link"
  Pose pose;         // in the model's frame
  BodyProperties properties;
};

// A joint between two links of a model; `parent` may be "world".
struct JointTemplate {
  std::string name;
  std::string type;  // SDF's word: "revolute"
  std::string parent;
  std::string child;
};

struct ModelTemplate {
  std::vector<LinkTemplate> links;
  std::vector<JointTemplate> joints;
  absl::flat_hash_map<std::string, Pose> frames;  // links, frames, joints and nested models, by scoped name
  Notices notices;
};

class ModelTemplates {
 public:
  ModelTemplates(ShapeTable& shapes, MeshLibrary& meshes) : shapes_(shapes), meshes_(meshes) {}

  // `xml` is one whole document <sdf version=".."><model name="..">..</model></sdf> without includes, its
  // mesh URIs being paths. Each different text is parsed once. Pointers stay valid. INVALID_ARGUMENT with
  // what libsdformat says; NOT_FOUND for meshes.
  absl::StatusOr<const ModelTemplate*> get(const std::string& xml);

 private:
  ShapeTable& shapes_;
  MeshLibrary& meshes_;
  absl::flat_hash_map<std::string, std::unique_ptr<ModelTemplate>> templates_;
};

}  // namespace tessera
