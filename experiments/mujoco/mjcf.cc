#include "experiments/mujoco/mjcf.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <variant>
#include <vector>

namespace tessera {
namespace {

using Eigen::Vector3d;

std::string text_of(const Vector3d& v) { return absl::StrFormat("%.17g %.17g %.17g", v.x(), v.y(), v.z()); }
std::string text_of(const Eigen::Quaterniond& q) {
  return absl::StrFormat("%.17g %.17g %.17g %.17g", q.w(), q.x(), q.y(), q.z());
}
std::string text_of(const Pose& pose) {
  return absl::StrCat(" pos='", text_of(pose.position), "' quat='", text_of(pose.orientation), "'");
}

// Type and size of a geometry; nothing where MuJoCo has other ones.
std::string kind_of(const Geometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry))
    return absl::StrCat("type='box' size='", text_of(Vector3d(box->size / 2)), "'");
  if (const auto* ball = std::get_if<Sphere>(&geometry))
    return absl::StrFormat("type='sphere' size='%.17g'", ball->radius);
  if (const auto* capsule = std::get_if<Capsule>(&geometry))
    return absl::StrFormat("type='capsule' size='%.17g %.17g'", capsule->radius, capsule->length / 2);
  if (const auto* cylinder = std::get_if<Cylinder>(&geometry))
    return absl::StrFormat("type='cylinder' size='%.17g %.17g'", cylinder->radius, cylinder->length / 2);
  if (const auto* ellipsoid = std::get_if<Ellipsoid>(&geometry))
    return absl::StrCat("type='ellipsoid' size='", text_of(ellipsoid->radii), "'");
  const auto* plane = std::get_if<Plane>(&geometry);
  return plane != nullptr && plane->normal == Vector3d::UnitZ() ? "type='plane' size='0 0 1'" : "";
}

// A world as MuJoCo's XML: bodies as trees, in the order in which joints hang them on each other.
class Writer {
 public:
  Writer(const WorldDescription& world, const MujocoOptions& options) : world_(world), options_(options) {
    for (const JointDescription& joint : world.joints) {
      children_[joint.properties.parent].push_back(&joint);
      if (!hangs_.emplace(joint.properties.child, &joint).second) lacks("loops of joints");
    }
  }

  absl::StatusOr<std::string> write() {
    const auto* gravity = std::get_if<UniformGravity>(&world_.settings.gravity);
    if (gravity == nullptr) lacks("planets");
    std::string bodies;
    for (std::size_t n = 0; n < world_.bodies.size(); ++n) {
      const BodyDescription& body = world_.bodies[n];
      if (body.properties.motion == Motion::kKinematic) lacks("kinematic bodies");
      if (body.properties.restitution > 0 && body.properties.motion == Motion::kDynamic) lacks("restitution");
      if (body.properties.motion == Motion::kStatic) add_shape(body, pose_of(body), bodies);
      if (body.properties.motion == Motion::kDynamic && !hangs_.contains(BodyId{n + 1}))
        add_body(BodyId{n + 1}, Pose{}, nullptr, bodies);
    }
    for (const JointDescription* joint : children_[BodyId{}])
      add_body(joint->properties.child, Pose{}, joint, bodies);
    if (!lacks_.empty()) return absl::UnimplementedError(absl::StrCat("MuJoCo has no ", lacks_));
    return absl::StrCat("<mujoco><compiler angle='radian' balanceinertia='false'/><option cone='",
                        options_.is_elliptic ? "elliptic" : "pyramidal", "' integrator='",
                        options_.is_implicit ? "implicit" : "Euler",
                        absl::StrFormat("' timestep='%.17g", world_.settings.time_step / options_.steps),
                        "' gravity='", text_of(gravity->acceleration), "'/><worldbody>", bodies,
                        "</worldbody><contact>", exclusions(), "</contact><actuator>", servos_,
                        "</actuator></mujoco>");
  }

 private:
  void lacks(const std::string& what) { lacks_ = what; }

  Pose pose_of(const BodyDescription& body) const {
    return {relative_to(body.pose.position, world_.anchor, world_.settings.sector_size),
            body.pose.orientation};
  }

  // Of two frictions MuJoCo takes that of the geometry that comes first, by a number that we give.
  void add_shape(const BodyDescription& body, const Pose& pose, std::string& text) {
    const double friction = body.properties.friction;
    const int first = 1000 - static_cast<int>(std::min(friction, 1.0) * 1000);
    for (const ShapePart& part : world_.shapes[body.properties.shape].parts) {
      const std::string kind = kind_of(part.geometry);
      if (kind.empty()) lacks("meshes, fields or hulls here");
      absl::StrAppend(&text, "<geom ", kind, text_of(pose * part.pose), " priority='", first,
                      absl::StrFormat("' friction='%.17g 0 0'", friction), bits_of(body.properties), "/>");
    }
  }

  // MuJoCo's geometries collide where one's category matches the other's mask, ours where both do: the same,
  // if masks agree.
  static std::string bits_of(const BodyProperties& properties) {
    constexpr std::uint32_t kAll = 0x7fffffff;
    if (properties.category == 1 && (properties.mask & kAll) == kAll) return "";
    return absl::StrCat(" contype='", properties.category & kAll, "' conaffinity='", properties.mask & kAll,
                        "'");
  }

  void add_joint(const JointDescription& joint, std::string& text) {
    const JointType type = joint.properties.type;
    if (type == JointType::kBall || type == JointType::kScrew) lacks("joints of this type here");
    for (int axis = 0; axis < axis_count(type); ++axis) add_axis(joint, axis, text);
  }

  void add_axis(const JointDescription& joint, int place, std::string& text) {
    const JointProperties& properties = joint.properties;
    const JointAxis& axis = properties.axes[place];
    const JointDrive& drive = joint.drives[place];
    const bool is_servo = drive.mode == DriveMode::kServo;
    if (!is_servo && drive.mode != DriveMode::kEffort && drive.mode != DriveMode::kFree)
      lacks("drives of this mode here");
    // The second axis is that of the child; MuJoCo turns it by the joint before.
    const Vector3d direction = properties.in_child.orientation * Vector3d::Unit(place);
    absl::StrAppend(&text, "<joint name='", mjcf_joint(properties.child, place), "' type='",
                    properties.type == JointType::kPrismatic ? "slide" : "hinge", "' pos='",
                    text_of(properties.in_child.position), "' axis='", text_of(direction),
                    absl::StrFormat("' armature='%.17g' stiffness='%.17g' springref='%.17g' damping='%.17g'",
                                    axis.armature, axis.spring_stiffness, axis.spring_reference,
                                    axis.damping + (is_servo ? drive.damping : 0)));
    if (std::isfinite(axis.lower) && std::isfinite(axis.upper))
      absl::StrAppend(&text, absl::StrFormat(" limited='true' range='%.17g %.17g'", axis.lower, axis.upper));
    absl::StrAppend(&text, "/>");
    if (is_servo)
      absl::StrAppend(&servos_, "<position name='", mjcf_servo(properties.child, place), "' joint='",
                      mjcf_joint(properties.child, place),
                      absl::StrFormat("' kp='%.17g'/>", drive.stiffness));
  }

  // `parent`: where the body is that the joint hangs it on.
  void add_body(BodyId id, const Pose& parent, const JointDescription* joint, std::string& text) {
    const BodyDescription& body = world_.bodies[id.value - 1];
    const BodyProperties& properties = body.properties;
    const Pose pose = pose_of(body);
    absl::StrAppend(&text, "<body name='", mjcf_body(id), "'", text_of(parent.inverse() * pose), ">");
    if (joint == nullptr) {
      absl::StrAppend(&text, "<freejoint name='", mjcf_joint(id), "'/>");
    } else {
      add_joint(*joint, text);
    }
    absl::StrAppend(&text, "<inertial", text_of(centre_frame(properties)),
                    absl::StrFormat(" mass='%.17g' diaginertia='", properties.mass),
                    text_of(Vector3d(properties.inertia.data())), "'/>");
    add_shape(body, Pose{}, text);
    for (const JointDescription* child : children_[id]) add_body(child->properties.child, pose, child, text);
    absl::StrAppend(&text, "</body>");
  }

  // Links of one assembly.
  std::string exclusions() const {
    std::string text;
    for (std::size_t a = 0; a < world_.bodies.size(); ++a) {
      for (std::size_t b = a + 1; b < world_.bodies.size(); ++b) {
        const std::uint64_t assembly = world_.bodies[a].properties.assembly;
        if (assembly != 0 && assembly == world_.bodies[b].properties.assembly)
          absl::StrAppend(&text, "<exclude body1='", mjcf_body(BodyId{a + 1}), "' body2='",
                          mjcf_body(BodyId{b + 1}), "'/>");
      }
    }
    return text;
  }

  const WorldDescription& world_;
  const MujocoOptions& options_;
  std::map<BodyId, std::vector<const JointDescription*>> children_;
  std::map<BodyId, const JointDescription*> hangs_;
  std::string servos_;
  std::string lacks_;
};

}  // namespace

std::string mjcf_body(BodyId id) { return absl::StrCat("b", id.value); }
std::string mjcf_joint(BodyId child, int axis) { return absl::StrCat("j", child.value, "_", axis); }
std::string mjcf_servo(BodyId child, int axis) { return absl::StrCat("s", child.value, "_", axis); }

absl::StatusOr<std::string> mjcf_of(const WorldDescription& world, const MujocoOptions& options) {
  return Writer(world, options).write();
}

}  // namespace tessera
