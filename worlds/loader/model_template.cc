#include "worlds/loader/model_template.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <ignition/math/eigen3/Conversions.hh>
#include <sdf/Collision.hh>
#include <sdf/Frame.hh>
#include <sdf/Joint.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <sdf/Root.hh>
#include <utility>

#include "worlds/loader/inertia.h"
#include "worlds/loader/sdf_parser.h"

namespace tessera {
namespace {

using ignition::math::eigen3::convert;

Pose to_pose(const ignition::math::Pose3d& pose) {
  return {convert(pose.Pos()), convert(pose.Rot()).normalized()};
}

const char* type_name(sdf::JointType type) {
  switch (type) {
    case sdf::JointType::BALL:
      return "ball";
    case sdf::JointType::CONTINUOUS:
      return "continuous";
    case sdf::JointType::FIXED:
      return "fixed";
    case sdf::JointType::GEARBOX:
      return "gearbox";
    case sdf::JointType::PRISMATIC:
      return "prismatic";
    case sdf::JointType::REVOLUTE:
      return "revolute";
    case sdf::JointType::REVOLUTE2:
      return "revolute2";
    case sdf::JointType::SCREW:
      return "screw";
    case sdf::JointType::UNIVERSAL:
      return "universal";
    case sdf::JointType::INVALID:
      break;
  }
  return "unknown";
}

// A number deep in an element that the DOM classes of libsdformat do not cover.
template <typename T>
bool find_value(sdf::ElementPtr element, std::initializer_list<const char*> path, T& value) {
  for (const char* name : path) {
    if (element == nullptr || !element->HasElement(name)) return false;
    element = element->GetElement(name);
  }
  value = element->Get<T>();
  return true;
}

struct SurfaceOfCollision {
  double friction = 1;  // SDF's default
  double restitution = 0;
  std::uint32_t bitmask = 0xffff;

  friend bool operator==(const SurfaceOfCollision&, const SurfaceOfCollision&) = default;
};

SurfaceOfCollision surface_of(const sdf::Collision& collision) {
  SurfaceOfCollision result;
  const sdf::ElementPtr element = collision.Element();
  if (!find_value(element, {"surface", "friction", "ode", "mu"}, result.friction)) {
    find_value(element, {"surface", "friction", "bullet", "friction"}, result.friction);
  }
  find_value(element, {"surface", "bounce", "restitution_coefficient"}, result.restitution);
  // Not through libsdformat's Contact: where the file says nothing, that has 0xff.
  unsigned bitmask = result.bitmask;
  find_value(element, {"surface", "contact", "collide_bitmask"}, bitmask);
  result.bitmask = bitmask;
  return result;
}

// A body has one surface: that of its first collision, and all bits of them.
void set_surface(const sdf::Link& link, BodyProperties& properties, Notices& notices) {
  if (link.CollisionCount() == 0) return;
  const SurfaceOfCollision first = surface_of(*link.CollisionByIndex(0));
  std::uint32_t bits = 0;
  bool differ = false;
  for (std::uint64_t n = 0; n < link.CollisionCount(); ++n) {
    const SurfaceOfCollision surface = surface_of(*link.CollisionByIndex(n));
    differ = differ || surface != first;
    bits |= surface.bitmask;
  }
  if (differ) notices.count("link whose collisions differ in their surface: the first one's counts");
  properties.friction = first.friction;
  properties.restitution = first.restitution;
  // In SDF two collisions meet if their bitmasks have a bit in common.
  properties.category = bits;
  properties.mask = bits;
}

class Reader {
 public:
  Reader(ShapeTable& shapes, MeshLibrary& meshes, ModelTemplate& result)
      : shapes_(shapes), meshes_(meshes), result_(result) {}

  absl::Status read(const sdf::Model& model) {
    collect_joints(model, "");
    find_fixed_links();
    for (const JointTemplate& joint : result_.joints) {
      if (joint.type == "fixed" && fixed_.contains(joint.child) &&
          (joint.parent == "world" || fixed_.contains(joint.parent))) {
        result_.notices.count("link fixed to the world, taken as static");
      } else {
        result_.notices.count_joint(joint.type);
      }
    }
    return read_model(model, "", Pose{}, model.Static());
  }

 private:
  void collect_joints(const sdf::Model& model, const std::string& prefix) {
    for (std::uint64_t n = 0; n < model.JointCount(); ++n) {
      const sdf::Joint& joint = *model.JointByIndex(n);
      JointTemplate entry{prefix + joint.Name(), type_name(joint.Type()), joint.ParentLinkName(),
                          joint.ChildLinkName()};
      std::string link;
      if (joint.ResolveParentLink(link).empty()) entry.parent = link;
      if (joint.ResolveChildLink(link).empty()) entry.child = link;
      if (entry.parent != "world") entry.parent = prefix + entry.parent;
      entry.child = prefix + entry.child;
      jointed_.insert(entry.parent);
      jointed_.insert(entry.child);
      result_.joints.push_back(std::move(entry));
    }
    for (std::uint64_t n = 0; n < model.ModelCount(); ++n) {
      const sdf::Model& nested = *model.ModelByIndex(n);
      collect_joints(nested, absl::StrCat(prefix, nested.Name(), "::"));
    }
  }

  // What a fixed joint ties to the world, and what others tie to that, cannot move: it is static.
  void find_fixed_links() {
    for (bool grown = true; grown;) {
      grown = false;
      for (const JointTemplate& joint : result_.joints) {
        if (joint.type != "fixed") continue;
        const bool parent = joint.parent == "world" || fixed_.contains(joint.parent);
        if (parent) grown = fixed_.insert(joint.child).second || grown;
        if (!parent && fixed_.contains(joint.child)) grown = fixed_.insert(joint.parent).second || grown;
      }
    }
  }

  absl::Status read_model(const sdf::Model& model, const std::string& prefix, const Pose& frame,
                          bool is_static) {
    for (std::uint64_t n = 0; n < model.FrameCount(); ++n) {
      const sdf::Frame& entry = *model.FrameByIndex(n);
      absl::Status status = add_frame(prefix + entry.Name(), entry.SemanticPose(), frame);
      if (!status.ok()) return status;
    }
    for (std::uint64_t n = 0; n < model.JointCount(); ++n) {
      const sdf::Joint& entry = *model.JointByIndex(n);
      absl::Status status = add_frame(prefix + entry.Name(), entry.SemanticPose(), frame);
      if (!status.ok()) return status;
    }
    for (std::uint64_t n = 0; n < model.LinkCount(); ++n) {
      const sdf::Link& link = *model.LinkByIndex(n);
      const std::string name = prefix + link.Name();
      if (link.PoseRelativeTo().empty()) {
        // As it stands in the file, without libsdformat's rounding.
        result_.frames[name] = prefix.empty() ? to_pose(link.RawPose()) : frame * to_pose(link.RawPose());
      } else if (absl::Status status = add_frame(name, link.SemanticPose(), frame); !status.ok()) {
        return status;
      }
      if (absl::Status status = read_link(link, name, is_static); !status.ok()) {
        return absl::Status(status.code(), absl::StrCat("link '", name, "': ", status.message()));
      }
    }
    for (std::uint64_t n = 0; n < model.ModelCount(); ++n) {
      const sdf::Model& nested = *model.ModelByIndex(n);
      const std::string name = prefix + nested.Name();
      if (absl::Status status = add_frame(name, nested.SemanticPose(), frame); !status.ok()) return status;
      absl::Status status =
          read_model(nested, name + "::", result_.frames[name], is_static || nested.Static());
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  absl::Status add_frame(const std::string& name, const sdf::SemanticPose& semantic, const Pose& model) {
    ignition::math::Pose3d pose;
    const sdf::Errors errors = semantic.Resolve(pose, "__model__");
    if (!errors.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("pose of '", name, "': ", errors.front().Message()));
    }
    const Pose resolved = to_pose(pose);
    result_.frames[name] = model.is_identity() ? resolved : model * resolved;
    return absl::OkStatus();
  }

  absl::Status read_link(const sdf::Link& link, const std::string& name, bool is_static) {
    LinkTemplate entry{name, result_.frames[name], {}};
    BodyProperties& properties = entry.properties;
    bool kinematic = false;
    find_value(link.Element(), {"kinematic"}, kinematic);
    properties.motion = is_static || fixed_.contains(name) ? Motion::kStatic
                        : kinematic                        ? Motion::kKinematic
                                                           : Motion::kDynamic;
    const bool moves = properties.motion != Motion::kStatic;
    absl::StatusOr<Shape> shape = shape_of(link, moves, meshes_, result_.notices);
    if (!shape.ok()) return shape.status();
    set_surface(link, properties, result_.notices);
    if (shape->parts.empty()) {
      if (!jointed_.contains(name)) {
        result_.notices.count("link without collision shape, skipped");
        return absl::OkStatus();
      }
      // Joints will want the body; nothing else meets it.
      result_.notices.count("link without collision shape, collides with nothing");
      constexpr double kPlaceholderRadius = 0.01;
      shape->parts.push_back({Sphere{kPlaceholderRadius}, Pose{}});
      properties.category = 0;
      properties.mask = 0;
    }
    properties.shape = shapes_.add(*std::move(shape));
    find_value(link.Element(), {"gravity"}, properties.gravity);
    find_value(link.Element(), {"velocity_decay", "linear"}, properties.linear_damping);
    find_value(link.Element(), {"velocity_decay", "angular"}, properties.angular_damping);
    if (moves) {
      if (absl::Status status = read_inertia(link, properties); !status.ok()) return status;
    }
    result_.links.push_back(std::move(entry));
    return absl::OkStatus();
  }

  absl::Status read_inertia(const sdf::Link& link, BodyProperties& properties) {
    if (!link.Element()->HasElement("tessera:auto_inertia")) {
      set_inertia(link.Inertial(), properties);
      return absl::OkStatus();
    }
    const absl::StatusOr<ignition::math::Inertiald> inertial = inertia_of_collisions(link);
    if (!inertial.ok()) return inertial.status();
    set_inertia(*inertial, properties);
    return absl::OkStatus();
  }

  ShapeTable& shapes_;
  MeshLibrary& meshes_;
  ModelTemplate& result_;
  absl::flat_hash_set<std::string> jointed_;
  absl::flat_hash_set<std::string> fixed_;
};

}  // namespace

absl::StatusOr<const ModelTemplate*> ModelTemplates::get(const std::string& xml) {
  std::unique_ptr<ModelTemplate>& entry = templates_[xml];
  if (entry != nullptr) return entry.get();
  auto result = std::make_unique<ModelTemplate>();
  sdf::Root root;
  if (absl::Status status = parse_sdf(xml, root, result->notices); !status.ok()) return status;
  if (root.Model() == nullptr) return absl::InvalidArgumentError("there is no model");
  absl::Status status = Reader(shapes_, meshes_, *result).read(*root.Model());
  if (!status.ok()) return status;
  entry = std::move(result);
  return entry.get();
}

}  // namespace tessera
