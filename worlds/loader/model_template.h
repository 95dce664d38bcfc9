// A model as parsed by libsdformat, without its pose in the world: made once, and shared by all models that
// are equal except for name and pose.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/joint.h"
#include "worlds/loader/collision_shape.h"
#include "worlds/loader/inertia.h"
#include "worlds/loader/joint_followers.h"
#include "worlds/loader/notices.h"
#include "worlds/loader/program_reader.h"
#include "worlds/loader/shape_table.h"
#include "worlds/loader/visuals.h"

namespace tessera {

struct LinkTemplate {
  std::string name;           // "link", "nested::link"
  Pose pose;                  // in the model's frame
  BodyProperties properties;  // assembly: 1 for the links that do not collide with each other
  std::vector<ProgramTemplate> programs = {};
  bool feels_wind = false;
  std::shared_ptr<const Look> look = {};       // null: it has none, or none is asked for
  std::optional<Displacement> displaced = {};  // where there is water
};

// The sensors of a link that does not move. They are programs of a body of their own, which stands there and
// touches nothing: bodies that do not move have no programs.
struct StandingSensors {
  LinkTemplate body;
  std::optional<std::size_t> link;  // its place in the links; none: it has no collision shape
};

struct JointTemplate {
  std::string name;                   // "joint", "nested::joint"
  std::optional<std::size_t> parent;  // a place in the links; none: the world
  std::size_t child = 0;              // likewise
  // Without bodies; if the parent is the world, `in_parent` is in the model's frame.
  JointProperties properties;  // leaders of mimics: places in the joints plus one
  JointDrives drives;
  std::vector<MimicByName> mimics;  // as read, with scoped names
  bool is_exchanged = false;        // parent and child, since only the parent of the file can move
};

// A frame that goes with a link: a <frame>, or a link that a URDF file fixes to another one.
struct FrameTemplate {
  std::string name;      // "frame", "nested::frame"
  std::size_t link = 0;  // a place in the links
  Pose pose;             // in the link's frame
};

struct ModelTemplate {
  std::vector<LinkTemplate> links;
  std::vector<StandingSensors> standing_sensors;
  std::vector<JointTemplate> joints;
  std::vector<FrameTemplate> link_frames;
  absl::flat_hash_map<std::string, Pose> frames;  // links, frames, joints and nested models, by scoped name
  // The places of the links that these move with, and "__model__". Links that are left out carry nothing.
  absl::flat_hash_map<std::string, std::size_t> carriers;
  Notices notices;
};

class ModelTemplates {
 public:
  ModelTemplates(ShapeTable& shapes, MeshLibrary& meshes, ShapeSource source)
      : shapes_(shapes), meshes_(meshes), source_(source) {}

  // `xml` is one whole document <sdf version=".."><model name="..">..</model></sdf> without includes, its
  // mesh URIs being paths. `held` are the links that joints of the world hold ("__model__": the canonical
  // one), so that they are kept even without a collision shape. Each different model is parsed once. Pointers
  // stay valid. INVALID_ARGUMENT with libsdformat's errors; NOT_FOUND for meshes.
  absl::StatusOr<const ModelTemplate*> get(const std::string& xml, const std::set<std::string>& held);

  // From now on, links that can move are told what they displace.
  void measure_displacements() { measures_ = true; }

 private:
  ShapeTable& shapes_;
  MeshLibrary& meshes_;
  const ShapeSource source_;
  bool measures_ = false;
  absl::flat_hash_map<std::string, std::unique_ptr<ModelTemplate>> templates_;
};

}  // namespace tessera
