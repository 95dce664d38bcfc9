#include "coordinator/command_checks.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <cmath>
#include <string>
#include <utility>

#include "coordinator/set_state.h"
#include "lpss/model/checks.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/model/world_records.h"
#include "lpss/programs/registry.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// A finite vector of at most that length, or an error that states its actual value.
absl::StatusOr<std::array<double, 3>> bounded_vector(absl::string_view what, const v1::Vector3& vector,
                                                     double most, absl::string_view unit) {
  if (absl::Status status = finite(std::string(what), from_proto(vector), most, unit); !status.ok())
    return status;
  return std::array<double, 3>{vector.x(), vector.y(), vector.z()};
}

absl::StatusOr<Wrench> bounded_wrench(const v1::Vector3& force, const v1::Vector3& torque) {
  const auto bounded_force = bounded_vector("force", force, kForceMax, "N");
  if (!bounded_force.ok()) return bounded_force.status();
  const auto bounded_torque = bounded_vector("torque", torque, kTorqueMax, "N m");
  if (!bounded_torque.ok()) return bounded_torque.status();
  return Wrench{*bounded_force, *bounded_torque};
}

struct Target {
  BodyId id;
  const WorldRegistry::Entry* entry = nullptr;

  std::string title() const { return absl::StrCat("body '", entry->name, "'"); }
};

absl::StatusOr<Target> target(const v1::BodyRef& reference, const WorldRegistry& world) {
  const absl::StatusOr<BodyId> id = world.resolve(reference);
  if (!id.ok()) return id.status();
  return Target{*id, world.find(*id)};
}

// A dynamic body: impulses and forces move no other kind.
absl::StatusOr<Target> dynamic_target(const v1::BodyRef& reference, const WorldRegistry& world) {
  absl::StatusOr<Target> body = target(reference, world);
  if (!body.ok() || body->entry->properties.motion == Motion::kDynamic) return body;
  return refused(body->title(), ": it is ", name_of(body->entry->properties.motion), ", and must be dynamic");
}

// The centre frame of a body whose body frame is at the pose of `request`, with the same checks as for a body
// of a loaded world. If the body keeps its orientation, which is unknown here: its body frame without
// rotation.
template <typename Request>
absl::StatusOr<BodyRecord> placed(const Target& target, const Request& command, const Eigen::Vector3d& linear,
                                  const Eigen::Vector3d& angular, const WorldRegistry& world) {
  if (!command.has_pose()) return refused(target.title(), ": pose must be set");
  BodyDescription body;
  body.name = target.entry->name;
  body.properties = target.entry->properties;
  body.pose = from_proto(command.pose());
  if (command.keeps_orientation()) body.pose.orientation.setIdentity();
  body.linear_velocity = linear;
  body.angular_velocity = angular;
  const Shape* shape = world.shapes().find(body.properties.shape);
  if (absl::Status status = validate(body, *shape, world.settings()); !status.ok()) return status;
  if (command.keeps_orientation()) {
    body.properties.centre = {};
    body.properties.principal_axes = BodyProperties().principal_axes;
  }
  absl::StatusOr<BodyRecord> record = record_of(body, world.settings());
  if (!record.ok()) return record;
  if (absl::Status status = carrier_home(record->home, target.id, world.settings()); !status.ok())
    return in(target.title(), status);
  return record;
}

absl::StatusOr<Command> checked(const v1::SetVelocity& command, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(command.body(), world);
  if (!body.ok()) return body.status();
  if (body->entry->properties.motion == Motion::kStatic) {
    return refused(body->title(), ": it is static, and must be dynamic or kinematic");
  }
  const auto linear = bounded_vector("linear velocity", command.linear(), kSpeedMax, "m/s");
  if (!linear.ok()) return in(body->title(), linear.status());
  const auto angular = bounded_vector("angular velocity", command.angular(), kAngularSpeedMax, "rad/s");
  if (!angular.ok()) return in(body->title(), angular.status());
  return SetVelocity{body->id, *linear, *angular};
}

absl::StatusOr<Command> checked(const v1::ApplyImpulse& command, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = dynamic_target(command.body(), world);
  if (!body.ok()) return body.status();
  const auto impulse = bounded_vector("impulse", command.impulse(), kImpulseMax, "N s");
  if (!impulse.ok()) return in(body->title(), impulse.status());
  const auto lever = bounded_vector("lever", command.lever(), kLeverMax, "m");
  if (!lever.ok()) return in(body->title(), lever.status());
  return ApplyImpulse{body->id, *impulse, *lever};
}

absl::StatusOr<Command> checked(const v1::ApplyForce& command, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = dynamic_target(command.body(), world);
  if (!body.ok()) return body.status();
  const absl::StatusOr<Wrench> wrench = bounded_wrench(command.force(), command.torque());
  if (!wrench.ok()) return in(body->title(), wrench.status());
  return ApplyForce{body->id, *wrench};
}

absl::StatusOr<Command> checked(const v1::SetForce& command, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = dynamic_target(command.body(), world);
  if (!body.ok()) return body.status();
  const absl::StatusOr<Wrench> wrench = bounded_wrench(command.force().force(), command.force().torque());
  if (!wrench.ok()) return in(body->title(), wrench.status());
  SetForce set{body->id, {}};
  if (command.has_force()) set.force = LastingForce{*wrench, command.force().body_axes()};
  return set;
}

absl::StatusOr<Command> checked(const v1::TellProgram& command, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(command.body(), world);
  if (!body.ok()) return body.status();
  const std::vector<std::string>& kinds = body->entry->tags.programs;
  if (kinds.empty()) return refused(body->title(), ": it has no programs");
  if (command.program() >= kinds.size())
    return refused(body->title(), ": program = ", command.program(), " must be below ", kinds.size(),
                   ", the number of its programs");
  const Program* const program = find_program(kinds[command.program()]);
  if (program == nullptr)
    return refused(body->title(), ": program ", kinds[command.program()], " is unknown");
  TellProgram told{body->id, command.program(), {}, {}};
  if (command.numbers().size() > static_cast<int>(kProgramNumbersMax))
    return refused(body->title(), ": ", command.numbers().size(), " numbers must be at most ",
                   kProgramNumbersMax);
  for (const v1::NamedNumber& number : command.numbers()) {
    if (const auto input = place_of(number.name(), program->inputs())) {
      told.inputs.emplace_back(*input, number.value());
    } else if (const auto parameter = place_of(number.name(), program->parameters())) {
      told.parameters.emplace_back(*parameter, number.value());
    } else {
      return refused(body->title(), ": ", no_number(*program, number.name()));
    }
  }
  if (absl::Status status = check_numbers(*program, told); !status.ok()) return in(body->title(), status);
  return told;
}

absl::StatusOr<Command> checked(const v1::Teleport& command, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(command.body(), world);
  if (!body.ok()) return body.status();
  const JointRegistry::Entry* joint = world.joints().holding(body->id);
  if (joint != nullptr && !command.alone()) {
    return absl::FailedPreconditionError(
        absl::StrCat(body->title(), ": the joint \"", joint->name,
                     "\" holds it, and a teleport moves one body only: set `alone` to do so nevertheless"));
  }
  const Eigen::Vector3d kept = Eigen::Vector3d::Zero();
  const absl::StatusOr<BodyRecord> record =
      placed(*body, command, command.keeps_linear_velocity() ? kept : from_proto(command.linear_velocity()),
             command.keeps_angular_velocity() ? kept : from_proto(command.angular_velocity()), world);
  if (!record.ok()) return record.status();
  return Teleport{body->id,
                  record->home,
                  record->state,
                  command.keeps_orientation(),
                  command.keeps_linear_velocity(),
                  command.keeps_angular_velocity()};
}

absl::StatusOr<Command> checked(const v1::SetKinematicTarget& command, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(command.body(), world);
  if (!body.ok()) return body.status();
  const Motion motion = body->entry->properties.motion;
  if (motion != Motion::kKinematic) {
    return refused(body->title(), ": it is ", name_of(motion), ", and must be kinematic");
  }
  const absl::StatusOr<BodyRecord> record =
      placed(*body, command, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), world);
  if (!record.ok()) return record.status();
  return KinematicTarget{body->id, record->home, record->state, command.keeps_orientation()};
}

absl::StatusOr<Command> checked(const v1::SetSurfaceMotion& command, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(command.body(), world);
  if (!body.ok()) return body.status();
  const auto velocity = bounded_vector("surface velocity", command.velocity(), kSurfaceSpeedMax, "m/s");
  if (!velocity.ok()) return in(body->title(), velocity.status());
  const auto running = bounded_vector("running surface", command.running(), kSurfaceSpeedMax, "m/s");
  if (!running.ok()) return in(body->title(), running.status());
  return SetSurfaceMotion{body->id, *velocity, *running};
}

// Of those, the ones that servers know.
bool changes_physics(const v1::SetProperties& command) {
  return command.has_motion() || command.has_mass() || command.has_inertia() || command.has_friction() ||
         command.has_restitution() || command.has_linear_damping() || command.has_angular_damping() ||
         command.has_category() || command.has_mask() || command.has_gravity();
}

absl::StatusOr<std::vector<Command>> checked(const v1::SetProperties& command, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(command.body(), world);
  if (!body.ok()) return body.status();
  if (!changes_physics(command)) return std::vector<Command>();
  BodyDescription changed;
  changed.name = body->entry->name;
  changed.properties = body->entry->properties;
  BodyProperties& properties = changed.properties;
  if (command.has_motion()) {
    const absl::StatusOr<Motion> motion = from_proto(command.motion());
    if (!motion.ok()) return in(body->title(), motion.status());
    if ((*motion == Motion::kStatic) != (properties.motion == Motion::kStatic))
      return refused(body->title(), ": what is static stays so, and nothing becomes static");
    const JointRegistry::Entry* joint = world.joints().with_child(body->id);
    if (*motion == Motion::kKinematic && joint != nullptr) {
      return absl::FailedPreconditionError(absl::StrCat(
          body->title(), ": it must be dynamic, for it is the child of the joint '", joint->name, "'"));
    }
    properties.motion = *motion;
  }
  if (command.has_mass()) properties.mass = command.mass();
  if (command.has_inertia())
    properties.inertia = {command.inertia().x(), command.inertia().y(), command.inertia().z()};
  if (command.has_friction()) properties.friction = command.friction();
  if (command.has_restitution()) properties.restitution = command.restitution();
  if (command.has_linear_damping()) properties.linear_damping = command.linear_damping();
  if (command.has_angular_damping()) properties.angular_damping = command.angular_damping();
  if (command.has_category()) properties.category = command.category();
  if (command.has_mask()) properties.mask = command.mask();
  if (command.has_gravity()) properties.gravity = command.gravity();
  const Shape* shape = world.shapes().find(properties.shape);
  if (absl::Status status = validate(changed, *shape, world.settings()); !status.ok()) return status;
  return std::vector<Command>{SetProperties{body->id, properties}};
}

absl::StatusOr<Command> checked(const v1::ApplyRadialImpulse& command, const WorldRegistry& world) {
  if (!command.has_centre()) return refused("centre must be set");
  const double size = world.settings().sector_size;
  const WorldPosition given = from_proto(command.centre());
  const absl::StatusOr<WorldPosition> centre = canonical(given.sector, given.local, size);
  if (!centre.ok()) return in("centre", centre.status());
  if (absl::Status status = bounded("radius", command.radius(), 0, kRadialSectorsMax * size, "m");
      !status.ok())
    return status;
  if (absl::Status status = bounded("impulse", command.impulse(), -kImpulseMax, kImpulseMax, "N s");
      !status.ok())
    return status;
  const std::uint32_t mask = command.mask() == 0 ? 0xffffffff : command.mask();
  return ApplyRadialImpulse{centre->sector,
                            {centre->local.x(), centre->local.y(), centre->local.z()},
                            command.radius(),
                            command.impulse(),
                            mask};
}

absl::StatusOr<Command> checked(const v1::RemoveJoint& command, const WorldRegistry& world) {
  const absl::StatusOr<JointId> joint = world.joints().resolve(command.joint());
  if (!joint.ok()) return joint.status();
  return RemoveJoint{*joint};
}

absl::Status add(std::uint32_t axis, const v1::JointDrive& given, SetDrives& drives) {
  if (axis < 1 || axis > drives.drives.size())
    return refused("axis = ", axis, " must be 1 to ", drives.drives.size());
  const absl::StatusOr<JointDrive> drive = from_proto(given);
  if (!drive.ok()) return refused("drive of axis ", axis, ": ", drive.status().message());
  drives.drives[axis - 1] = *drive;
  drives.axes = static_cast<AxisMask>(drives.axes | 1 << (axis - 1));
  return absl::OkStatus();
}

absl::StatusOr<Command> checked(const v1::SetJointDrives& command, const WorldRegistry& world) {
  const absl::StatusOr<JointId> id = world.joints().resolve(command.joint());
  if (!id.ok()) return id.status();
  const JointRegistry::Entry& joint = *world.joints().find(*id);
  const std::string title = absl::StrCat("joint '", joint.name, "': ");
  if (command.drives().empty()) return refused(title, "drives must not be empty");
  SetDrives result{*id, joint.record.drives, 0};
  for (const v1::AxisDrive& given : command.drives()) {
    if (absl::Status status = add(given.axis(), given.drive(), result); !status.ok())
      return refused(title, status.message());
  }
  if (absl::Status status = validate(result.drives, joint.record.properties.type); !status.ok())
    return refused(title, status.message());
  return result;
}

// A column of DriveJoints.
class DriveColumn {
 public:
  DriveColumn(const char* name, const google::protobuf::RepeatedField<double>& numbers)
      : name_(name), numbers_(numbers) {}

  absl::Status check(int joints) const {
    const int size = numbers_.size();
    if (size == 0 || size == 1 || size == joints) return absl::OkStatus();
    return refused(name_, ": ", size, " elements must be one for each of ", joints,
                   " joints, or one for all");
  }
  double operator[](int joint) const {
    return numbers_.empty() ? 0 : numbers_.Get(numbers_.size() == 1 ? 0 : joint);
  }

 private:
  const char* name_;
  const google::protobuf::RepeatedField<double>& numbers_;
};

absl::StatusOr<std::vector<Command>> checked(const v1::DriveJoints& command, const WorldRegistry& world) {
  const int count = command.joints_size();
  if (count == 0) return refused("joints must not be empty");
  const DriveColumn targets("targets", command.targets());
  const DriveColumn stiffness("stiffness", command.stiffness());
  const DriveColumn damping("damping", command.damping());
  const DriveColumn velocities("velocities", command.velocities());
  const DriveColumn efforts("efforts", command.efforts());
  for (const DriveColumn* column : {&targets, &stiffness, &damping, &velocities, &efforts}) {
    if (absl::Status status = column->check(count); !status.ok()) return status;
  }
  std::vector<Command> commands;
  commands.reserve(static_cast<std::size_t>(count));
  v1::JointRef reference;
  v1::JointDrive drive;
  drive.set_mode(command.mode());
  for (int n = 0; n < count; ++n) {
    reference.set_id(command.joints(n));
    const absl::StatusOr<JointId> id = world.joints().resolve(reference);
    if (!id.ok()) return in(absl::StrCat("joints[", n, "]"), id.status());
    const JointRegistry::Entry& joint = *world.joints().find(*id);
    drive.set_target(targets[n]);
    drive.set_stiffness(stiffness[n]);
    drive.set_damping(damping[n]);
    drive.set_velocity(velocities[n]);
    drive.set_effort(efforts[n]);
    SetDrives result{*id, joint.record.drives, 0};
    absl::Status status = add(command.axis(), drive, result);
    if (status.ok()) status = validate(result.drives, joint.record.properties.type);
    if (!status.ok()) return in(absl::StrCat("joints[", n, "] ('", joint.name, "')"), status);
    commands.emplace_back(result);
  }
  return commands;
}

// As a list of one.
absl::StatusOr<std::vector<Command>> alone(absl::StatusOr<Command> command) {
  if (!command.ok()) return command.status();
  std::vector<Command> list;
  list.push_back(*std::move(command));
  return list;
}

}  // namespace

absl::StatusOr<std::vector<Command>> checked(const v1::Command& command, const WorldRegistry& world) {
  switch (command.kind_case()) {
    case v1::Command::kSetVelocity:
      return alone(checked(command.set_velocity(), world));
    case v1::Command::kApplyImpulse:
      return alone(checked(command.apply_impulse(), world));
    case v1::Command::kApplyForce:
      return alone(checked(command.apply_force(), world));
    case v1::Command::kSetForce:
      return alone(checked(command.set_force(), world));
    case v1::Command::kTellProgram:
      return alone(checked(command.tell_program(), world));
    case v1::Command::kTeleport:
      return alone(checked(command.teleport(), world));
    case v1::Command::kSetState:
      return checked(command.set_state(), world);
    case v1::Command::kSetKinematicTarget:
      return alone(checked(command.set_kinematic_target(), world));
    case v1::Command::kSetSurfaceMotion:
      return alone(checked(command.set_surface_motion(), world));
    case v1::Command::kSetProperties:
      return checked(command.set_properties(), world);
    case v1::Command::kApplyRadialImpulse:
      return alone(checked(command.apply_radial_impulse(), world));
    case v1::Command::kRemoveJoint:
      return alone(checked(command.remove_joint(), world));
    case v1::Command::kSetJointDrives:
      return alone(checked(command.set_joint_drives(), world));
    case v1::Command::kDriveJoints:
      return checked(command.drive_joints(), world);
    default:
      return refused("a command of no known kind");
  }
}

}  // namespace tessera
