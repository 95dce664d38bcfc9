#include <utility>

#include "client_sdk/src/references.h"
#include "proto/convert.h"
#include "tessera.pb.h"
#include "tessera/batch.h"

namespace tessera {
namespace {

template <typename Command>
void set_pose(Command& command, const TargetPose& pose) {
  *command.mutable_pose() =
      to_proto(WorldPose{pose.position, pose.orientation.value_or(Eigen::Quaterniond::Identity())});
  command.set_keeps_orientation(!pose.orientation);
}

void set_orientation(const Eigen::Quaterniond& from, v1::Quaternion& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
  to.set_w(from.w());
}

}  // namespace

CommandList::CommandList() : request_(std::make_unique<v1::Request>()) {}
CommandList::~CommandList() = default;
CommandList::CommandList(CommandList&&) noexcept = default;
CommandList& CommandList::operator=(CommandList&&) noexcept = default;

std::size_t CommandList::size() const { return static_cast<std::size_t>(request_->commands_size()); }

CommandList& CommandList::spawn(const NewBody& body) {
  v1::Model& model = *request_->add_commands()->mutable_spawn()->mutable_model();
  *model.add_shapes() = to_proto(body.shape);
  *model.add_bodies() = to_proto(body.body);
  model.mutable_bodies(0)->mutable_properties()->set_shape(0);
  for (const std::shared_ptr<const ProgramModule>& module : body.modules) model.add_modules(module->bytes);
  return *this;
}

CommandList& CommandList::spawn(const WorldDescription& model, const std::string& prefix,
                                const std::optional<WorldPose>& pose) {
  v1::Spawn& spawn = *request_->add_commands()->mutable_spawn();
  v1::World world = to_proto(model);
  spawn.mutable_model()->mutable_shapes()->Swap(world.mutable_shapes());
  spawn.mutable_model()->mutable_bodies()->Swap(world.mutable_bodies());
  spawn.mutable_model()->mutable_joints()->Swap(world.mutable_joints());
  spawn.mutable_model()->mutable_frames()->Swap(world.mutable_frames());
  spawn.mutable_model()->mutable_modules()->Swap(world.mutable_settings()->mutable_modules());
  spawn.set_prefix(prefix);
  if (pose) *spawn.mutable_pose() = to_proto(*pose);
  return *this;
}

CommandList& CommandList::remove(const BodyName& body) {
  *request_->add_commands()->mutable_remove()->mutable_body() = reference_to(body);
  return *this;
}

CommandList& CommandList::remove_all(const std::string& prefix) {
  request_->add_commands()->mutable_remove()->set_prefix(prefix);
  return *this;
}

CommandList& CommandList::set_velocity(const BodyName& body, const Eigen::Vector3d& linear,
                                       const Eigen::Vector3d& angular) {
  v1::SetVelocity& command = *request_->add_commands()->mutable_set_velocity();
  *command.mutable_body() = reference_to(body);
  *command.mutable_linear() = to_proto(linear);
  *command.mutable_angular() = to_proto(angular);
  return *this;
}

CommandList& CommandList::apply_impulse(const BodyName& body, const Eigen::Vector3d& impulse,
                                        const Eigen::Vector3d& lever) {
  v1::ApplyImpulse& command = *request_->add_commands()->mutable_apply_impulse();
  *command.mutable_body() = reference_to(body);
  *command.mutable_impulse() = to_proto(impulse);
  *command.mutable_lever() = to_proto(lever);
  return *this;
}

CommandList& CommandList::apply_force(const BodyName& body, const Eigen::Vector3d& force,
                                      const Eigen::Vector3d& torque) {
  v1::ApplyForce& command = *request_->add_commands()->mutable_apply_force();
  *command.mutable_body() = reference_to(body);
  *command.mutable_force() = to_proto(force);
  *command.mutable_torque() = to_proto(torque);
  return *this;
}

CommandList& CommandList::set_force(const BodyName& body, const std::optional<LastingForce>& force) {
  v1::SetForce& command = *request_->add_commands()->mutable_set_force();
  *command.mutable_body() = reference_to(body);
  if (force) *command.mutable_force() = to_proto(*force);
  return *this;
}

CommandList& CommandList::tell_program(const BodyName& body, const std::vector<NamedNumber>& numbers,
                                       std::uint32_t program) {
  v1::TellProgram& command = *request_->add_commands()->mutable_tell_program();
  *command.mutable_body() = reference_to(body);
  command.set_program(program);
  for (const NamedNumber& number : numbers) {
    v1::NamedNumber& added = *command.add_numbers();
    added.set_name(number.name);
    added.set_value(number.value);
  }
  return *this;
}

CommandList& CommandList::teleport(const BodyName& body, const TargetPose& pose,
                                   const std::optional<Eigen::Vector3d>& linear_velocity,
                                   const std::optional<Eigen::Vector3d>& angular_velocity, bool alone) {
  v1::Teleport& command = *request_->add_commands()->mutable_teleport();
  command.set_alone(alone);
  *command.mutable_body() = reference_to(body);
  set_pose(command, pose);
  command.set_keeps_linear_velocity(!linear_velocity);
  if (linear_velocity) *command.mutable_linear_velocity() = to_proto(*linear_velocity);
  command.set_keeps_angular_velocity(!angular_velocity);
  if (angular_velocity) *command.mutable_angular_velocity() = to_proto(*angular_velocity);
  return *this;
}

CommandList& CommandList::set_state(const std::vector<PlacedBody>& bodies,
                                    const std::vector<PlacedJoint>& joints, bool keeps_contacts) {
  v1::SetState& command = *request_->add_commands()->mutable_set_state();
  command.set_keeps_contacts(keeps_contacts);
  for (const PlacedBody& body : bodies) {
    v1::SetState::OfBody& placed = *command.add_bodies();
    *placed.mutable_body() = reference_to(body.body);
    *placed.mutable_pose() = to_proto(body.pose);
    *placed.mutable_linear_velocity() = to_proto(body.linear_velocity);
    *placed.mutable_angular_velocity() = to_proto(body.angular_velocity);
  }
  for (const PlacedJoint& joint : joints) {
    v1::SetState::OfJoint& placed = *command.add_joints();
    *placed.mutable_joint() = reference_to(joint.joint);
    placed.mutable_positions()->Add(joint.positions.begin(), joint.positions.end());
    placed.mutable_rates()->Add(joint.rates.begin(), joint.rates.end());
    if (joint.orientation) set_orientation(*joint.orientation, *placed.mutable_orientation());
  }
  return *this;
}

CommandList& CommandList::set_kinematic_target(const BodyName& body, const TargetPose& pose) {
  v1::SetKinematicTarget& command = *request_->add_commands()->mutable_set_kinematic_target();
  *command.mutable_body() = reference_to(body);
  set_pose(command, pose);
  return *this;
}

CommandList& CommandList::set_surface_motion(const BodyName& body, const Eigen::Vector3d& velocity,
                                             const Eigen::Vector3d& running) {
  v1::SetSurfaceMotion& command = *request_->add_commands()->mutable_set_surface_motion();
  *command.mutable_body() = reference_to(body);
  *command.mutable_velocity() = to_proto(velocity);
  *command.mutable_running() = to_proto(running);
  return *this;
}

CommandList& CommandList::set_properties(const BodyName& body, const ChangedProperties& properties) {
  v1::SetProperties& command = *request_->add_commands()->mutable_set_properties();
  *command.mutable_body() = reference_to(body);
  if (properties.motion) command.set_motion(to_proto(*properties.motion));
  if (properties.mass) command.set_mass(*properties.mass);
  if (properties.inertia) *command.mutable_inertia() = to_proto(*properties.inertia);
  if (properties.friction) command.set_friction(*properties.friction);
  if (properties.restitution) command.set_restitution(*properties.restitution);
  if (properties.linear_damping) command.set_linear_damping(*properties.linear_damping);
  if (properties.angular_damping) command.set_angular_damping(*properties.angular_damping);
  if (properties.category) command.set_category(*properties.category);
  if (properties.mask) command.set_mask(*properties.mask);
  if (properties.gravity) command.set_gravity(*properties.gravity);
  if (properties.user_data) command.set_user_data(*properties.user_data);
  if (properties.owner) command.set_owner(*properties.owner);
  return *this;
}

CommandList& CommandList::apply_radial_impulse(const WorldPosition& centre, double radius, double impulse,
                                               std::uint32_t mask) {
  v1::ApplyRadialImpulse& command = *request_->add_commands()->mutable_apply_radial_impulse();
  *command.mutable_centre() = to_proto(centre);
  command.set_radius(radius);
  command.set_impulse(impulse);
  command.set_mask(mask);
  return *this;
}

CommandList& CommandList::add_joint(const NewJoint& joint) {
  JointDescription description = joint.joint;
  description.properties.parent = {};
  description.properties.child = {};
  v1::AddJoint& command = *request_->add_commands()->mutable_add_joint();
  *command.mutable_joint() = to_proto(description);
  if (joint.parent) *command.mutable_parent() = reference_to(*joint.parent);
  *command.mutable_child() = reference_to(joint.child);
  return *this;
}

CommandList& CommandList::remove_joint(const JointName& joint) {
  *request_->add_commands()->mutable_remove_joint()->mutable_joint() = reference_to(joint);
  return *this;
}

CommandList& CommandList::set_drive(const JointName& joint, const JointDrive& drive, int axis) {
  v1::SetJointDrives& command = *request_->add_commands()->mutable_set_joint_drives();
  *command.mutable_joint() = reference_to(joint);
  v1::AxisDrive& given = *command.add_drives();
  given.set_axis(static_cast<std::uint32_t>(axis));
  *given.mutable_drive() = to_proto(drive);
  return *this;
}

CommandList& CommandList::set_drives(const JointName& joint, const JointDrives& drives) {
  v1::SetJointDrives& command = *request_->add_commands()->mutable_set_joint_drives();
  *command.mutable_joint() = reference_to(joint);
  for (std::size_t n = 0; n < drives.size(); ++n) {
    v1::AxisDrive& given = *command.add_drives();
    given.set_axis(static_cast<std::uint32_t>(n + 1));
    *given.mutable_drive() = to_proto(drives[n]);
  }
  return *this;
}

CommandList& CommandList::set_drives(std::span<const JointId> joints, const DriveColumns& drives, int axis) {
  v1::DriveJoints& command = *request_->add_commands()->mutable_drive_joints();
  for (const JointId joint : joints) command.add_joints(joint.value);
  command.set_axis(static_cast<std::uint32_t>(axis));
  command.set_mode(to_proto(JointDrive{.mode = drives.mode}).mode());
  command.mutable_targets()->Add(drives.targets.begin(), drives.targets.end());
  command.mutable_stiffness()->Add(drives.stiffness.begin(), drives.stiffness.end());
  command.mutable_damping()->Add(drives.damping.begin(), drives.damping.end());
  command.mutable_velocities()->Add(drives.velocities.begin(), drives.velocities.end());
  command.mutable_efforts()->Add(drives.efforts.begin(), drives.efforts.end());
  return *this;
}

}  // namespace tessera
