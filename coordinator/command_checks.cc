#include "coordinator/command_checks.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <cmath>
#include <string>
#include <utility>

#include "coordinator/limits.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "lpss/model/world_records.h"
#include "proto/convert.h"

namespace tessera {
namespace {

template <typename... Args>
absl::Status refused(const Args&... args) {
  return absl::InvalidArgumentError(absl::StrCat(args...));
}

// A finite vector of at most that length, or an error that states its actual value.
absl::StatusOr<std::array<double, 3>> bounded(absl::string_view what, const v1::Vector3& vector, double most,
                                              absl::string_view unit) {
  const std::array<double, 3> value{vector.x(), vector.y(), vector.z()};
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(value[axis])) {
      return refused(what, " ", std::string(1, "xyz"[axis]), " = ", value[axis], " must be finite");
    }
  }
  const double length = std::hypot(value[0], value[1], value[2]);
  if (length <= most) return value;
  return refused(what, " = ", length, " ", unit, " must be at most ", most, " ", unit);
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

absl::Status in(const Target& target, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(target.title(), ": ", status.message()));
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
absl::StatusOr<BodyRecord> placed(const Target& target, const Request& request, const Eigen::Vector3d& linear,
                                  const Eigen::Vector3d& angular, const WorldRegistry& world) {
  if (!request.has_pose()) return refused(target.title(), ": pose must be set");
  BodyDescription body;
  body.name = target.entry->name;
  body.properties = target.entry->properties;
  body.pose = from_proto(request.pose());
  if (request.keeps_orientation()) body.pose.orientation.setIdentity();
  body.linear_velocity = linear;
  body.angular_velocity = angular;
  const Shape* shape = world.shapes().find(body.properties.shape);
  if (absl::Status status = validate(body, *shape, world.settings()); !status.ok()) return status;
  if (request.keeps_orientation()) {
    body.properties.centre = {};
    body.properties.principal_axes = BodyProperties().principal_axes;
  }
  return record_of(body, world.settings());
}

absl::StatusOr<Eigen::Vector3d> unit_direction(const v1::Vector3& from) {
  Eigen::Vector3d direction = from_proto(from);
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(direction[axis])) {
      return refused("direction ", std::string(1, "xyz"[axis]), " = ", direction[axis], " must be finite");
    }
  }
  const double largest = direction.cwiseAbs().maxCoeff();
  if (largest == 0) return refused("direction = (0, 0, 0) must not be zero");
  direction /= largest;  // so that no square underflows or overflows
  return direction.normalized();
}

}  // namespace

absl::StatusOr<Command> checked(const v1::RemoveRequest& request, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(request.body(), world);
  if (!body.ok()) return body.status();
  return world.removal_of(body->id);
}

absl::StatusOr<Command> checked(const v1::SetVelocityRequest& request, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(request.body(), world);
  if (!body.ok()) return body.status();
  if (body->entry->properties.motion == Motion::kStatic) {
    return refused(body->title(), ": it is static, and must be dynamic or kinematic");
  }
  const auto linear = bounded("linear velocity", request.linear(), kSpeedMax, "m/s");
  if (!linear.ok()) return in(*body, linear.status());
  const auto angular = bounded("angular velocity", request.angular(), kAngularSpeedMax, "rad/s");
  if (!angular.ok()) return in(*body, angular.status());
  return SetVelocity{body->id, *linear, *angular};
}

absl::StatusOr<Command> checked(const v1::ApplyImpulseRequest& request, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = dynamic_target(request.body(), world);
  if (!body.ok()) return body.status();
  const auto impulse = bounded("impulse", request.impulse(), kImpulseMax, "N s");
  if (!impulse.ok()) return in(*body, impulse.status());
  const auto lever = bounded("lever", request.lever(), kLeverMax, "m");
  if (!lever.ok()) return in(*body, lever.status());
  return ApplyImpulse{body->id, *impulse, *lever};
}

absl::StatusOr<Command> checked(const v1::ApplyForceRequest& request, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = dynamic_target(request.body(), world);
  if (!body.ok()) return body.status();
  const auto force = bounded("force", request.force(), kForceMax, "N");
  if (!force.ok()) return in(*body, force.status());
  const auto torque = bounded("torque", request.torque(), kTorqueMax, "N m");
  if (!torque.ok()) return in(*body, torque.status());
  return ApplyForce{body->id, {*force, *torque}};
}

absl::StatusOr<Command> checked(const v1::TeleportRequest& request, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(request.body(), world);
  if (!body.ok()) return body.status();
  const JointRegistry::Entry* joint = world.joints().holding(body->id);
  if (joint != nullptr && !request.alone()) {
    return absl::FailedPreconditionError(
        absl::StrCat(body->title(), ": the joint \"", joint->name,
                     "\" holds it, and a teleport moves one body only: set `alone` to do so nevertheless"));
  }
  const Eigen::Vector3d kept = Eigen::Vector3d::Zero();
  const absl::StatusOr<BodyRecord> record =
      placed(*body, request, request.keeps_linear_velocity() ? kept : from_proto(request.linear_velocity()),
             request.keeps_angular_velocity() ? kept : from_proto(request.angular_velocity()), world);
  if (!record.ok()) return record.status();
  return Teleport{body->id,
                  record->home,
                  record->state,
                  request.keeps_orientation(),
                  request.keeps_linear_velocity(),
                  request.keeps_angular_velocity()};
}

absl::StatusOr<Command> checked(const v1::KinematicTargetRequest& request, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(request.body(), world);
  if (!body.ok()) return body.status();
  const Motion motion = body->entry->properties.motion;
  if (motion != Motion::kKinematic) {
    return refused(body->title(), ": it is ", name_of(motion), ", and must be kinematic");
  }
  const absl::StatusOr<BodyRecord> record =
      placed(*body, request, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), world);
  if (!record.ok()) return record.status();
  return KinematicTarget{body->id, record->home, record->state, request.keeps_orientation()};
}

absl::StatusOr<Command> checked(const v1::SurfaceMotionRequest& request, const WorldRegistry& world) {
  const absl::StatusOr<Target> body = target(request.body(), world);
  if (!body.ok()) return body.status();
  const auto velocity = bounded("surface velocity", request.velocity(), kSurfaceSpeedMax, "m/s");
  if (!velocity.ok()) return in(*body, velocity.status());
  const auto running = bounded("running surface", request.running(), kSurfaceSpeedMax, "m/s");
  if (!running.ok()) return in(*body, running.status());
  return SetSurfaceMotion{body->id, *velocity, *running};
}

absl::StatusOr<v1::RayQuery> checked(const v1::RaycastRequest& request, const WorldRegistry& world) {
  if (!request.has_origin()) return refused("origin must be set");
  const double size = world.settings().sector_size;
  const WorldPosition given = from_proto(request.origin());
  const absl::StatusOr<WorldPosition> origin = canonical(given.sector, given.local, size);
  if (!origin.ok())
    return absl::Status(origin.status().code(), absl::StrCat("origin: ", origin.status().message()));
  const absl::StatusOr<Eigen::Vector3d> direction = unit_direction(request.direction());
  if (!direction.ok()) return direction.status();
  const double length = request.length();
  if (!std::isfinite(length) || length <= 0 || length > kRayLengthMax) {
    return refused("length = ", length, " m must be above 0 m and at most ", kRayLengthMax, " m");
  }
  const double length_max = kRaySectorsMax * size / direction->lpNorm<1>();
  if (length > length_max) {
    return refused("length = ", length, " m must be at most ", length_max,
                   " m: in this direction, the ray then passes through ", kRaySectorsMax, " sectors");
  }
  const auto end = canonical(origin->sector, origin->local + length * *direction, size);
  if (!end.ok())
    return absl::Status(end.status().code(), absl::StrCat("the ray's end: ", end.status().message()));
  v1::RayQuery ray;
  *ray.mutable_origin() = to_proto(*origin);
  *ray.mutable_direction() = to_proto(*direction);
  ray.set_length(length);
  ray.set_mask(request.mask() == 0 ? 0xffffffff : request.mask());
  return ray;
}

// A probe is checked like a moving body. A point is a tiny ball.
absl::StatusOr<v1::NearQuery> checked(const v1::NearRequest& request, const WorldRegistry& world) {
  constexpr double kPointRadius = 1e-3;  // m
  if (!request.has_pose()) return refused("pose must be set");
  v1::NearQuery near;
  if (request.has_probe()) {
    *near.mutable_probe() = request.probe();
  } else {
    near.mutable_probe()->mutable_sphere()->set_radius(kPointRadius);
  }
  v1::Shape message;
  *message.add_parts()->mutable_geometry() = near.probe();
  absl::StatusOr<Shape> shape = from_proto(message);
  if (!shape.ok()) return shape.status();
  if (absl::Status status = validate(*shape, "probe"); !status.ok()) return status;
  BodyDescription probe;
  probe.name = "probe";
  probe.properties.motion = Motion::kKinematic;
  probe.pose = from_proto(request.pose());
  const double size = world.settings().sector_size;
  if (absl::Status status = validate(probe, *shape, world.settings()); !status.ok()) return status;
  const absl::StatusOr<WorldPosition> position =
      canonical(probe.pose.position.sector, probe.pose.position.local, size);
  if (!position.ok()) return position.status();
  const double reach = request.reach();
  if (!std::isfinite(reach) || reach < 0 || reach > kReachMax * size) {
    return refused("reach = ", reach, " m must be 0 m to ", kReachMax, " sectors, which are ",
                   kReachMax * size, " m");
  }
  *near.mutable_pose() = to_proto(WorldPose{*position, probe.pose.orientation.normalized()});
  near.set_reach(reach);
  near.set_mask(request.mask() == 0 ? 0xffffffff : request.mask());
  return near;
}

absl::StatusOr<Command> checked(const v1::RemoveJointRequest& request, const WorldRegistry& world) {
  const absl::StatusOr<JointId> joint = world.joints().resolve(request.joint());
  if (!joint.ok()) return joint.status();
  return RemoveJoint{*joint};
}

absl::StatusOr<Command> checked(const v1::SetJointDrivesRequest& request, const WorldRegistry& world) {
  const absl::StatusOr<JointId> id = world.joints().resolve(request.joint());
  if (!id.ok()) return id.status();
  const JointRegistry::Entry& joint = *world.joints().find(*id);
  const std::string title = absl::StrCat("joint '", joint.name, "': ");
  JointDrives drives = joint.record.drives;
  if (request.drives().empty()) return refused(title, "drives must not be empty");
  for (const v1::AxisDrive& given : request.drives()) {
    if (given.axis() < 1 || given.axis() > drives.size()) {
      return refused(title, "axis = ", given.axis(), " must be 1 to ", drives.size());
    }
    const absl::StatusOr<JointDrive> drive = from_proto(given.drive());
    if (!drive.ok()) return refused(title, "drive of axis ", given.axis(), ": ", drive.status().message());
    drives[given.axis() - 1] = *drive;
  }
  if (absl::Status status = validate(drives, joint.record.properties.type); !status.ok()) {
    return refused(title, status.message());
  }
  return SetDrives{*id, drives};
}

}  // namespace tessera
