#include "simulator/workload.h"

#include <algorithm>
#include <array>
#include <utility>

#include "lpss/simulation/example_worlds.h"
#include "proto/convert.h"

namespace tessera {
namespace {

constexpr std::uint32_t kWorkloadStream = 2;

// Maximum distance along an axis of placed bodies from the start of others, m: some overlap, some leave the
// sector.
constexpr double kAround = 3;
constexpr double kEdge = 0.5;  // m, of the smallest new bodies
constexpr std::uint64_t kSizes = 4;
constexpr std::size_t kSnapshotsMax = 3;
constexpr double kApart = 0.7;  // m, between two new bodies with a joint

v1::BodyRef by_id(std::uint64_t id) {
  v1::BodyRef body;
  body.set_id(id);
  return body;
}

void drop(std::vector<std::uint64_t>& ids, std::uint64_t id) { std::erase(ids, id); }

}  // namespace

Workload::Workload(std::uint64_t seed, const WorldDescription& world)
    : dice_(seed, kWorkloadStream), settings_(world.settings) {
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    if (world.bodies[i].properties.motion != Motion::kDynamic) continue;
    dynamic_.push_back(i + 1);
    places_.push_back(world.bodies[i].pose.position);
  }
  if (places_.empty()) places_.push_back({world.anchor, Eigen::Vector3d::Zero()});
}

absl::Status Workload::give_next(SimulatedCluster& cluster) {
  using Request = absl::Status (Workload::*)(SimulatedCluster&);
  static constexpr Request kOnBodies[] = {&Workload::push, &Workload::set_velocity, &Workload::apply_force,
                                          &Workload::teleport, &Workload::remove_body};
  constexpr std::uint64_t kKinds = std::size(kOnBodies) + 5;
  const std::uint64_t kind = dice_.below(kKinds);
  if (kind < std::size(kOnBodies) && !dynamic_.empty()) return (this->*kOnBodies[kind])(cluster);
  if (kind == kKinds - 1 && !joints_.empty()) return remove_joint(cluster);
  if (kind == kKinds - 2 && !kinematic_.empty()) return set_target(cluster);
  if (kind == kKinds - 3) return spawn_pair(cluster);
  if (kind == kKinds - 4 && snapshots_.size() < kSnapshotsMax) return take_snapshot(cluster);
  return spawn(cluster, any_place(), dice_.one_in(4) ? Motion::kKinematic : Motion::kDynamic).status();
}

v1::Vector3 Workload::any_vector(double longest) {
  std::array<double, 3> v;
  for (double& coordinate : v) coordinate = dice_.between(-longest, longest);
  return to_proto(Eigen::Vector3d(v.data()));
}

WorldPosition Workload::any_place() {
  const WorldPosition& start = places_[dice_.below(places_.size())];
  const Eigen::Vector3d there = start.local + from_proto(any_vector(kAround));
  const absl::StatusOr<WorldPosition> place = canonical(start.sector, there, settings_.sector_size);
  return place.ok() ? *place : start;  // there is nothing beyond the last sector
}

absl::StatusOr<std::uint64_t> Workload::spawn(SimulatedCluster& cluster, const WorldPosition& place,
                                              Motion motion) {
  WorldBuilder builder(settings_);
  // Some are equal, and shapes go with the last body that has them.
  const double edge = kEdge * (1 + static_cast<double>(dice_.below(kSizes)) / kSizes);
  const ShapeId shape = builder.shape(dice_.one_in(2) ? Geometry(Box{{edge, edge, edge}}) : Sphere{edge / 2});
  BodyDescription body = builder.add("", shape, 1, Eigen::Vector3d::Zero(), motion);
  body.pose.position = place;
  v1::SpawnRequest request;
  *request.mutable_body() = to_proto(body);
  *request.mutable_shape() = to_proto(builder.world().shapes.front());
  const auto reply = cluster.call<v1::SpawnRequest, v1::SpawnReply>(std::move(request));
  if (!reply.ok()) return reply.status();
  (motion == Motion::kDynamic ? dynamic_ : kinematic_).push_back(reply->id());
  return reply->id();
}

absl::Status Workload::spawn_pair(SimulatedCluster& cluster) {
  const WorldPosition place = any_place();
  const Eigen::Vector3d across(kApart, 0, 0);
  const absl::StatusOr<WorldPosition> beside =
      canonical(place.sector, place.local + across, settings_.sector_size);
  const absl::StatusOr<std::uint64_t> parent = spawn(cluster, place, Motion::kDynamic);
  if (!parent.ok() || !beside.ok()) return parent.status();
  const absl::StatusOr<std::uint64_t> child = spawn(cluster, *beside, Motion::kDynamic);
  if (!child.ok()) return child.status();
  JointDescription joint;
  joint.properties.type = JointType::kBall;
  joint.properties.parent = BodyId{*parent};
  joint.properties.child = BodyId{*child};
  joint.properties.in_parent.position = across / 2;
  joint.properties.in_child.position = -across / 2;
  v1::AddJointRequest request;
  *request.mutable_joint() = to_proto(joint);
  const auto reply = cluster.call<v1::AddJointRequest, v1::AddJointReply>(std::move(request));
  if (reply.ok()) joints_.push_back({reply->id(), *parent, *child});
  return reply.status();
}

absl::Status Workload::remove_body(SimulatedCluster& cluster) {
  const std::uint64_t id = any(dynamic_);
  v1::RemoveRequest request;
  *request.mutable_body() = by_id(id);
  const auto reply = cluster.call<v1::RemoveRequest, v1::CommandReply>(std::move(request));
  drop(dynamic_, id);
  std::erase_if(joints_, [id](const OwnJoint& joint) { return joint.parent == id || joint.child == id; });
  return reply.status();
}

absl::Status Workload::remove_joint(SimulatedCluster& cluster) {
  const auto joint = joints_.begin() + static_cast<std::ptrdiff_t>(dice_.below(joints_.size()));
  v1::RemoveJointRequest request;
  request.mutable_joint()->set_id(joint->id);
  joints_.erase(joint);
  return cluster.call<v1::RemoveJointRequest, v1::CommandReply>(std::move(request)).status();
}

absl::Status Workload::push(SimulatedCluster& cluster) {
  v1::ApplyImpulseRequest request;
  *request.mutable_body() = by_id(any(dynamic_));
  *request.mutable_impulse() = any_vector(8);
  *request.mutable_lever() = any_vector(0.2);
  return cluster.call<v1::ApplyImpulseRequest, v1::CommandReply>(std::move(request)).status();
}

absl::Status Workload::set_velocity(SimulatedCluster& cluster) {
  v1::SetVelocityRequest request;
  *request.mutable_body() = by_id(any(dynamic_));
  *request.mutable_linear() = any_vector(5);
  *request.mutable_angular() = any_vector(5);
  return cluster.call<v1::SetVelocityRequest, v1::CommandReply>(std::move(request)).status();
}

absl::Status Workload::apply_force(SimulatedCluster& cluster) {
  v1::ApplyForceRequest request;
  *request.mutable_body() = by_id(any(dynamic_));
  *request.mutable_force() = any_vector(100);
  *request.mutable_torque() = any_vector(10);
  return cluster.call<v1::ApplyForceRequest, v1::CommandReply>(std::move(request)).status();
}

absl::Status Workload::teleport(SimulatedCluster& cluster) {
  v1::TeleportRequest request;
  request.set_alone(true);
  *request.mutable_body() = by_id(any(dynamic_));
  *request.mutable_pose() = to_proto(WorldPose{any_place(), Eigen::Quaterniond::Identity()});
  return cluster.call<v1::TeleportRequest, v1::CommandReply>(std::move(request)).status();
}

absl::Status Workload::set_target(SimulatedCluster& cluster) {
  v1::KinematicTargetRequest request;
  *request.mutable_body() = by_id(any(kinematic_));
  *request.mutable_pose() = to_proto(WorldPose{any_place(), Eigen::Quaterniond::Identity()});
  return cluster.call<v1::KinematicTargetRequest, v1::CommandReply>(std::move(request)).status();
}

absl::Status Workload::take_snapshot(SimulatedCluster& cluster) {
  absl::StatusOr<SnapshotChunks> taken = cluster.call<v1::SnapshotRequest, SnapshotChunks>({});
  if (!taken.ok()) return taken.status();
  snapshots_.push_back(*std::move(taken));
  return absl::OkStatus();
}

}  // namespace tessera
