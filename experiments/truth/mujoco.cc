#include "experiments/truth/mujoco.h"

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>
#include <variant>

#include "lpss/simulation/simulation.h"

namespace tessera::truth {
namespace {

using Eigen::Vector3d;

// MuJoCo's own steps are of 2 ms; a tick of 1/60 s becomes eight.
constexpr int kSteps = 8;

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
  explicit Writer(const WorldDescription& world) : world_(world) {
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
    return absl::StrCat(
        "<mujoco><compiler angle='radian' balanceinertia='false'/><option cone='elliptic' timestep='",
        absl::StrFormat("%.17g", world_.settings.time_step / kSteps), "' gravity='",
        text_of(gravity->acceleration), "'/><worldbody>", bodies, "</worldbody><contact>", exclusions(),
        "</contact></mujoco>");
  }

  static std::string name_of(BodyId id) { return absl::StrCat("b", id.value); }
  static std::string joint_name_of(BodyId child) { return absl::StrCat("j", child.value); }

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
                      absl::StrFormat("' friction='%.17g 0 0'/>", friction));
    }
  }

  void add_joint(const JointDescription& joint, std::string& text) {
    const JointProperties& properties = joint.properties;
    const JointAxis& axis = properties.axes[0];
    const JointDrive& drive = joint.drives[0];
    if (properties.type == JointType::kFixed) return;
    const bool turns = properties.type == JointType::kRevolute;
    if (!turns && properties.type != JointType::kPrismatic) lacks("joints of this type here");
    const bool is_servo = drive.mode == DriveMode::kServo;
    if (!is_servo && drive.mode != DriveMode::kEffort && drive.mode != DriveMode::kFree)
      lacks("drives of this mode here");
    if (is_servo && axis.spring_stiffness > 0) lacks("springs with servos here");
    const double stiffness = is_servo ? drive.stiffness : axis.spring_stiffness;
    const double reference = is_servo ? drive.target : axis.spring_reference;
    const double damping = axis.damping + (is_servo ? drive.damping : 0);
    absl::StrAppend(&text, "<joint name='", joint_name_of(properties.child), "' type='",
                    turns ? "hinge" : "slide", "' pos='", text_of(properties.in_child.position), "' axis='",
                    text_of(Vector3d(properties.in_child.orientation * Vector3d::UnitX())),
                    absl::StrFormat("' stiffness='%.17g' springref='%.17g' damping='%.17g'/>", stiffness,
                                    reference, damping));
  }

  // `parent`: where the body is that the joint hangs it on.
  void add_body(BodyId id, const Pose& parent, const JointDescription* joint, std::string& text) {
    const BodyDescription& body = world_.bodies[id.value - 1];
    const BodyProperties& properties = body.properties;
    const Pose pose = pose_of(body);
    absl::StrAppend(&text, "<body name='", name_of(id), "'", text_of(parent.inverse() * pose), ">");
    if (joint == nullptr) {
      absl::StrAppend(&text, "<freejoint name='", joint_name_of(id), "'/>");
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
          absl::StrAppend(&text, "<exclude body1='b", a + 1, "' body2='b", b + 1, "'/>");
      }
    }
    return text;
  }

  const WorldDescription& world_;
  std::map<BodyId, std::vector<const JointDescription*>> children_;
  std::map<BodyId, const JointDescription*> hangs_;
  std::string lacks_;
};

struct Delete {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

class Mujoco : public LocalWorld {
 public:
  Mujoco(std::vector<BodyRecord> records, std::unique_ptr<mjModel, Delete> model,
         const WorldDescription& world)
      : world_(world),
        records_(std::move(records)),
        model_(std::move(model)),
        data_(mj_makeData(model_.get())) {
    for (BodyRecord& record : records_) {
      Eigen::Map<Vector3d>(record.state.position.data()) +=
          metres_between(world_.anchor, record.home, world_.settings.sector_size);
      record.home = world_.anchor;
    }
    mj_forward(model_.get(), data_.get());
    for (std::size_t n = 0; n < world_.bodies.size(); ++n) set_velocity(BodyId{n + 1});
    for (const JointDescription& joint : world_.joints) set_drive(joint.properties.child, joint.drives[0]);
  }

  using LocalWorld::step;
  void step(std::span<const Command>) override {
    for (int n = 0; n < kSteps; ++n) mj_step(model_.get(), data_.get());
  }

  std::vector<BodyRecord> bodies() const override {
    mj_forward(model_.get(), data_.get());
    std::vector<BodyRecord> records;
    for (BodyRecord record : records_) {
      if (record.properties.motion != Motion::kDynamic) continue;
      const int body = mj_name2id(model_.get(), mjOBJ_BODY, Writer::name_of(record.id).c_str());
      const mjtNum* q = data_->xquat + 4 * body;
      const Pose centre = Pose{Vector3d(data_->xpos + 3 * body), Eigen::Quaterniond(q[0], q[1], q[2], q[3])} *
                          centre_frame(record.properties);
      Eigen::Map<Vector3d>(record.state.position.data()) = centre.position;
      record.state.rotation = rotation_of(centre.orientation);
      std::array<mjtNum, 6> velocity{};  // spin, then that of the centre of mass
      mj_objectVelocity(model_.get(), data_.get(), mjOBJ_BODY, body, velocity.data(), 0);
      std::copy_n(velocity.begin() + 3, 3, record.state.linear_velocity.begin());
      std::copy_n(velocity.begin(), 3, record.state.angular_velocity.begin());
      records.push_back(record);
    }
    return records;
  }

 private:
  // The first degree of freedom of what moves the body against what it hangs on; negative: none.
  int freedom_of(BodyId id) const {
    const int joint = mj_name2id(model_.get(), mjOBJ_JOINT, Writer::joint_name_of(id).c_str());
    return joint < 0 ? -1 : model_->jnt_dofadr[joint];
  }

  void set_velocity(BodyId id) {
    const int freedom = freedom_of(id);
    if (freedom < 0) return;
    const BodyDescription& body = world_.bodies[id.value - 1];
    mjtNum* speeds = data_->qvel + freedom;
    const auto joint = std::ranges::find_if(
        world_.joints, [&](const JointDescription& other) { return other.properties.child == id; });
    if (joint == world_.joints.end()) {
      const Vector3d spin = body.pose.orientation.conjugate() * body.angular_velocity;
      for (int axis = 0; axis < 3; ++axis) {
        speeds[axis] = body.linear_velocity[axis];
        speeds[3 + axis] = spin[axis];
      }
      return;
    }
    Vector3d linear = body.linear_velocity, angular = body.angular_velocity;
    if (joint->properties.parent != BodyId{}) {
      const BodyDescription& parent = world_.bodies[joint->properties.parent.value - 1];
      linear -= parent.linear_velocity;
      angular -= parent.angular_velocity;
    }
    const Vector3d axis = body.pose.orientation * joint->properties.in_child.orientation * Vector3d::UnitX();
    speeds[0] = axis.dot(joint->properties.type == JointType::kPrismatic ? linear : angular);
  }

  void set_drive(BodyId child, const JointDrive& drive) {
    const int freedom = freedom_of(child);
    if (freedom >= 0 && drive.mode == DriveMode::kEffort) data_->qfrc_applied[freedom] = drive.target;
  }

  WorldDescription world_;
  std::vector<BodyRecord> records_;
  std::unique_ptr<mjModel, Delete> model_;
  std::unique_ptr<mjData, Delete> data_;
};

}  // namespace

bool has_mujoco() { return true; }

absl::StatusOr<std::unique_ptr<LocalWorld>> in_mujoco(const WorldDescription& world) {
  absl::StatusOr<std::vector<BodyRecord>> records = records_of(world);
  if (!records.ok()) return records.status();
  const absl::StatusOr<std::string> text = Writer(world).write();
  if (!text.ok()) return text.status();
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  constexpr char kName[] = "world.xml";
  if (mj_makeEmptyFileVFS(files.get(), kName, static_cast<int>(text->size())) != 0)
    return absl::InternalError("MuJoCo takes no file");
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), kName)], text->data(), text->size());
  std::array<char, 1000> error{};
  std::unique_ptr<mjModel, Delete> model(mj_loadXML(kName, files.get(), error.data(), error.size()));
  mj_deleteVFS(files.get());
  if (!model) return absl::InternalError(absl::StrCat("MuJoCo: ", error.data()));
  return std::make_unique<Mujoco>(*std::move(records), std::move(model), world);
}

}  // namespace tessera::truth
