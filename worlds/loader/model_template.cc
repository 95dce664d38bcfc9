#include "worlds/loader/model_template.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <ignition/math/eigen3/Conversions.hh>
#include <sdf/Collision.hh>
#include <sdf/Frame.hh>
#include <sdf/Joint.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <sdf/Root.hh>
#include <utility>

#include "worlds/loader/elements.h"
#include "worlds/loader/inertia.h"
#include "worlds/loader/joint_reader.h"
#include "worlds/loader/sdf_parser.h"
#include "worlds/loader/surface_reader.h"

namespace tessera {
namespace {

using ignition::math::eigen3::convert;

Pose to_pose(const ignition::math::Pose3d& pose) {
  return {convert(pose.Pos()), convert(pose.Rot()).normalized()};
}

class Reader {
 public:
  Reader(ShapeTable& shapes, MeshLibrary& meshes, ShapeSource source, bool measures, ModelTemplate& result)
      : shapes_(shapes), meshes_(meshes), source_(source), measures_(measures), result_(result) {}

  absl::Status read(const sdf::Model& model, const std::set<std::string>& held) {
    self_collide_ = model.SelfCollide();
    jointed_.insert(held.begin(), held.end());
    if (held.contains("__model__")) jointed_.insert(model.CanonicalLinkAndRelativeName().second);
    note_unread(*model.Element(), result_.notices);
    collect_joints(model, "");
    find_fixed_links();
    if (absl::Status status = read_model(model, "", Pose{}, model.Static()); !status.ok()) return status;
    add_link_frames();
    add_carriers(model);
    for (const FoundJoint& joint : joints_) {
      if (absl::Status status = read_joint(joint); !status.ok()) {
        return absl::Status(status.code(), absl::StrCat("joint '", joint.name, "': ", status.message()));
      }
    }
    absl::flat_hash_set<std::string> names;
    for (const FoundJoint& joint : joints_) names.insert(joint.name);
    if (absl::Status status = connect_followers(names, gearboxes_, result_); !status.ok()) return status;
    if (result_.links.size() == 1) result_.links.front().properties.assembly = 0;
    return absl::OkStatus();
  }

 private:
  struct FoundJoint {
    std::string name;
    const sdf::Joint* joint = nullptr;
    std::string parent;  // a link, or "world"
    std::string child;
    std::string prefix;  // the models around it: "nested::"
  };

  void collect_joints(const sdf::Model& model, const std::string& prefix) {
    for (std::uint64_t n = 0; n < model.JointCount(); ++n) {
      const sdf::Joint& joint = *model.JointByIndex(n);
      FoundJoint found{prefix + joint.Name(), &joint, joint.ParentLinkName(), joint.ChildLinkName(), prefix};
      std::string link;
      if (joint.ResolveParentLink(link).empty()) found.parent = link;
      if (joint.ResolveChildLink(link).empty()) found.child = link;
      if (found.parent != "world") found.parent = prefix + found.parent;
      found.child = prefix + found.child;
      jointed_.insert(found.parent);
      jointed_.insert(found.child);
      joints_.push_back(std::move(found));
    }
    for (std::uint64_t n = 0; n < model.ModelCount(); ++n) {
      const sdf::Model& nested = *model.ModelByIndex(n);
      collect_joints(nested, absl::StrCat(prefix, nested.Name(), "::"));
    }
  }

  // Links that fixed joints connect to the world, directly or through others, cannot move: they are static.
  void find_fixed_links() {
    for (bool grown = true; grown;) {
      grown = false;
      for (const FoundJoint& joint : joints_) {
        if (joint.joint->Type() != sdf::JointType::FIXED) continue;
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
      std::string link;
      if (entry.ResolveAttachedToBody(link).empty())
        attached_.emplace_back(prefix + entry.Name(), prefix + link);
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
        // As in the file, without libsdformat's rounding.
        result_.frames[name] = prefix.empty() ? to_pose(link.RawPose()) : frame * to_pose(link.RawPose());
      } else if (absl::Status status = add_frame(name, link.SemanticPose(), frame); !status.ok()) {
        return status;
      }
      if (absl::Status status = read_link(model, link, prefix, is_static); !status.ok()) {
        return absl::Status(status.code(), absl::StrCat("link '", name, "': ", status.message()));
      }
    }
    for (std::uint64_t n = 0; n < model.ModelCount(); ++n) {
      const sdf::Model& nested = *model.ModelByIndex(n);
      const std::string name = prefix + nested.Name();
      if (absl::Status status = add_frame(name, nested.SemanticPose(), frame); !status.ok()) return status;
      if (std::string link = nested.CanonicalLinkAndRelativeName().second; !link.empty()) {
        carried_.emplace_back(name, absl::StrCat(name, "::", link));
      }
      const Pose place = result_.frames[name];  // which moves as more frames are added
      absl::Status status = read_model(nested, name + "::", place, is_static || nested.Static());
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  // Frames on links that are left out are left out, too.
  void add_link_frames() {
    absl::flat_hash_set<std::string> names;
    for (const auto& [name, link] : attached_) {
      const auto place = places_.find(link);
      if (place == places_.end() || places_.contains(name) || !names.insert(name).second) continue;
      const Pose in_link = result_.links[place->second].pose.inverse() * result_.frames.at(name);
      result_.link_frames.push_back({name, place->second, in_link});
    }
  }

  void add_carriers(const sdf::Model& model) {
    result_.carriers = places_;
    carried_.emplace_back("__model__", model.CanonicalLinkAndRelativeName().second);
    for (const FoundJoint& joint : joints_) carried_.emplace_back(joint.name, joint.child);
    for (const auto* names : {&attached_, &carried_}) {
      for (const auto& [name, link] : *names) {
        if (const auto place = places_.find(link); place != places_.end())
          result_.carriers.try_emplace(name, place->second);
      }
    }
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

  // The turn of a frame in a link of its model, where the frame is fixed to it: one that is attached to it,
  // and any one in a model that does not move.
  std::optional<Eigen::Quaterniond> turn_in_link(const std::string& frame, const sdf::Model& model,
                                                 const sdf::Link& link, bool is_static) const {
    const sdf::Frame* const named = model.FrameByName(frame);
    const sdf::Link* const other = model.LinkByName(frame);
    std::string carrier = frame;
    if (frame == "__model__") carrier = model.CanonicalLinkAndRelativeName().second;
    if (named != nullptr && !named->ResolveAttachedToBody(carrier).empty()) return std::nullopt;
    if (!is_static && carrier != link.Name()) return std::nullopt;
    ignition::math::Pose3d pose;
    ignition::math::Pose3d of_link;
    const bool is_known = frame == "__model__" ||
                          (named != nullptr && named->SemanticPose().Resolve(pose, "__model__").empty()) ||
                          (other != nullptr && other->SemanticPose().Resolve(pose, "__model__").empty());
    if (!is_known || !link.SemanticPose().Resolve(of_link, "__model__").empty()) return std::nullopt;
    return (to_pose(of_link).orientation.conjugate() * to_pose(pose).orientation).normalized();
  }

  absl::Status read_link(const sdf::Model& model, const sdf::Link& link, const std::string& prefix,
                         bool is_static) {
    const std::string name = prefix + link.Name();
    LinkTemplate entry{name, result_.frames[name], {}};
    BodyProperties& properties = entry.properties;
    bool kinematic = false;
    find_value(link.Element(), {"kinematic"}, kinematic);
    properties.motion = is_static || fixed_.contains(name) ? Motion::kStatic
                        : kinematic                        ? Motion::kKinematic
                                                           : Motion::kDynamic;
    const bool moves = properties.motion != Motion::kStatic;
    const std::vector<PartMaterial> materials = materials_of(
        link, [&](const std::string& frame) { return turn_in_link(frame, model, link, is_static); },
        result_.notices);
    const bool is_simulated = source_ == ShapeSource::kCollisions;
    absl::StatusOr<Shape> shape = shape_of(link, moves && is_simulated, materials, meshes_, result_.notices);
    if (!shape.ok()) return shape.status();
    if (!is_simulated) {
      absl::StatusOr<Look> look = look_of(link, meshes_, result_.notices);
      if (!look.ok()) return look.status();
      if (!look->shape.parts.empty()) entry.look = std::make_shared<const Look>(*std::move(look));
    }
    set_surface(link, materials, properties);
    entry.programs = programs_of(link);
    if (!moves) take_standing_sensors(entry, shape->parts.empty() && !jointed_.contains(name));
    if (shape->parts.empty()) {
      if (!jointed_.contains(name)) {
        result_.notices.count("link without collision shape, skipped");
        return absl::OkStatus();
      }
      // A joint holds the body; it collides with nothing.
      result_.notices.count("link without collision shape, collides with nothing");
      *shape = placeholder(properties);
    }
    bool collides = self_collide_;
    find_value(link.Element(), {"self_collide"}, collides);
    properties.assembly = collides ? 0 : 1;
    properties.shape = shapes_.add(*std::move(shape));
    find_value(link.Element(), {"gravity"}, properties.gravity);
    find_value(link.Element(), {"velocity_decay", "linear"}, properties.linear_damping);
    find_value(link.Element(), {"velocity_decay", "angular"}, properties.angular_damping);
    if (moves && is_simulated) {
      if (absl::Status status = read_inertia(link, properties); !status.ok()) return status;
    }
    entry.feels_wind = model.EnableWind() || link.EnableWind();
    if (measures_ && moves && is_simulated) entry.displaced = displacement_of_collisions(link, meshes_);
    places_[name] = result_.links.size();
    result_.links.push_back(std::move(entry));
    return absl::OkStatus();
  }

  // The shape of a body that collides with nothing.
  static Shape placeholder(BodyProperties& properties) {
    constexpr double kRadius = 0.01;
    properties.category = 0;
    properties.mask = 0;
    Shape shape;
    shape.parts.push_back({Sphere{kRadius}, Pose{}});
    return shape;
  }

  // Of a link that does not move: its sensors go to a body of their own, and programs of systems are left
  // out. `is_alone`: the link has no body.
  void take_standing_sensors(LinkTemplate& link, bool is_alone) {
    const auto others =
        std::stable_partition(link.programs.begin(), link.programs.end(),
                              [](const ProgramTemplate& p) { return !p.is_of_system || p.publishes; });
    StandingSensors standing;
    std::size_t left_out = 0;
    for (auto program = others; program != link.programs.end(); ++program) {
      if (is_sensor(program->record.kind)) {
        standing.body.programs.push_back(std::move(*program));
      } else {
        ++left_out;
      }
    }
    link.programs.erase(others, link.programs.end());
    if (left_out > 0)
      result_.notices.count("program of a system on a link that does not move, left out", left_out);
    if (standing.body.programs.empty()) return;
    result_.notices.count("link that does not move has sensors, which stand on a body of their own");
    standing.body.name = link.name + "::sensors";
    standing.body.pose = link.pose;
    standing.body.properties.motion = Motion::kKinematic;
    standing.body.properties.inertia = {1, 1, 1};
    standing.body.properties.shape = shapes_.add(placeholder(standing.body.properties));
    if (!is_alone) standing.link = result_.links.size();
    result_.standing_sensors.push_back(std::move(standing));
  }

  Motion motion_of(const std::optional<std::size_t>& place) const {
    return place ? result_.links[*place].properties.motion : Motion::kStatic;
  }

  absl::Status read_joint(const FoundJoint& found) {
    std::optional<std::size_t> parent;
    if (found.parent != "world") parent = places_.at(found.parent);
    const std::size_t child = places_.at(found.child);
    if (motion_of(parent) == Motion::kStatic && motion_of(child) == Motion::kStatic) {
      const bool fixed = found.joint->Type() == sdf::JointType::FIXED && fixed_.contains(found.child);
      result_.notices.count(fixed ? "link fixed to the world, treated as static"
                                  : "joint between links that no force moves, skipped");
      return absl::OkStatus();
    }
    if (motion_of(parent) != Motion::kDynamic && motion_of(child) != Motion::kDynamic) {
      result_.notices.count("joint between links that no force moves, skipped");
      return absl::OkStatus();
    }
    if (found.joint->Type() == sdf::JointType::GEARBOX) return read_gearbox(found, parent, child);
    const absl::StatusOr<std::optional<JointKind>> kind = tessera::read_joint(*found.joint, result_.notices);
    if (!kind.ok()) return kind.status();
    if (kind->has_value()) result_.joints.push_back(placed(found, **kind, parent, child));
    return absl::OkStatus();
  }

  absl::Status read_gearbox(const FoundJoint& found, std::optional<std::size_t> parent, std::size_t child) {
    Gearbox gearbox{found.name, parent, child, std::nullopt};
    std::string reference;
    find_value(found.joint->Element(), {"gearbox_ratio"}, gearbox.ratio);
    find_value(found.joint->Element(), {"gearbox_reference_body"}, reference);
    if (reference != "world") {
      const auto place = places_.find(found.prefix + reference);
      if (place == places_.end()) {
        return absl::InvalidArgumentError(
            absl::StrCat("<gearbox_reference_body>: there is no link '", reference, "'"));
      }
      gearbox.reference = place->second;
    }
    const Eigen::Quaterniond frame = result_.frames.at(found.name).orientation;
    for (const auto& [axis, direction] : {std::pair{found.joint->Axis(0), &gearbox.parent_axis},
                                          std::pair{found.joint->Axis(1), &gearbox.child_axis}}) {
      const absl::StatusOr<Eigen::Vector3d> local = direction_of(axis);
      if (!local.ok()) return local.status();
      *direction = frame * *local;
    }
    gearboxes_.push_back(std::move(gearbox));
    return absl::OkStatus();
  }

  // The joint at its place in the file; its child is the one that can move.
  JointTemplate placed(const FoundJoint& found, const JointKind& kind, std::optional<std::size_t> parent,
                       std::size_t child) const {
    JointTemplate entry{found.name, parent, child, kind.properties, kind.drives, kind.mimics};
    for (MimicByName& mimic : entry.mimics) mimic.leader = found.prefix + mimic.leader;
    const Pose frame = turned(result_.frames.at(found.name), kind.axes);
    entry.properties.in_parent = parent ? result_.links[*parent].pose.inverse() * frame : frame;
    entry.properties.in_child = result_.links[child].pose.inverse() * frame;
    if (found.joint->PoseRelativeTo().empty() && is_link(found.joint->ChildLinkName(), found)) {
      // As in the file, without the rounding of converting it back and forth.
      entry.properties.in_child = turned(to_pose(found.joint->RawPose()), kind.axes);
    }
    if (motion_of(child) == Motion::kDynamic) return entry;
    exchange_sides(entry.properties, entry.drives);
    entry.parent = child;
    entry.child = *parent;
    entry.is_exchanged = true;
    if (entry.properties.type == JointType::kUniversal) {
      for (MimicByName& mimic : entry.mimics) mimic.axis = 1 - mimic.axis;
    }
    return entry;
  }

  // Whether a joint names its child link itself, not a frame on it.
  static bool is_link(const std::string& name, const FoundJoint& found) {
    return found.child == name || found.child.ends_with(absl::StrCat("::", name));
  }

  absl::Status read_inertia(const sdf::Link& link, BodyProperties& properties) {
    if (!link.Element()->HasElement("tessera:auto_inertia")) {
      set_inertia(link.Inertial(), properties);
      return absl::OkStatus();
    }
    const absl::StatusOr<ignition::math::Inertiald> inertial = inertia_of_collisions(link, meshes_);
    if (!inertial.ok()) return inertial.status();
    set_inertia(*inertial, properties);
    return absl::OkStatus();
  }

  ShapeTable& shapes_;
  MeshLibrary& meshes_;
  const ShapeSource source_;
  const bool measures_;
  ModelTemplate& result_;
  bool self_collide_ = false;
  std::vector<FoundJoint> joints_;
  std::vector<Gearbox> gearboxes_;
  absl::flat_hash_map<std::string, std::size_t> places_;       // of links, in result_.links
  std::vector<std::pair<std::string, std::string>> attached_;  // frames, and the links that they go with
  std::vector<std::pair<std::string, std::string>> carried_;   // likewise, what else has a pose
  absl::flat_hash_set<std::string> jointed_;
  absl::flat_hash_set<std::string> fixed_;
};

}  // namespace

absl::StatusOr<const ModelTemplate*> ModelTemplates::get(const std::string& xml,
                                                         const std::set<std::string>& held) {
  std::unique_ptr<ModelTemplate>& entry = templates_[absl::StrCat(xml, "\n", absl::StrJoin(held, "\n"))];
  if (entry != nullptr) return entry.get();
  auto result = std::make_unique<ModelTemplate>();
  sdf::Root root;
  if (absl::Status status = parse_sdf(xml, root, result->notices); !status.ok()) return status;
  if (root.Model() == nullptr) return absl::InvalidArgumentError("there is no model");
  absl::Status status = Reader(shapes_, meshes_, source_, measures_, *result).read(*root.Model(), held);
  if (!status.ok()) return status;
  entry = std::move(result);
  return entry.get();
}

}  // namespace tessera
