#include "simulator/workload.h"

#include <absl/strings/match.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "lpss/programs/registry.h"
#include "lpss/simulation/example_worlds.h"
#include "proto/convert.h"
#include "simulator/late_module.h"

namespace tessera {
namespace {

constexpr std::uint32_t kWorkloadStream = 2;
constexpr std::uint32_t kRequestStreams = 1'000'000;  // that of the first request; others follow

// Maximum distance along an axis of placed bodies from the start of others, m: some overlap, some leave the
// sector.
constexpr double kAround = 3;
constexpr double kEdge = 0.5;  // m, of the smallest new bodies
constexpr std::uint64_t kSizes = 4;
constexpr std::size_t kSnapshotsMax = 3;
constexpr double kApart = 0.7;  // m, between two new bodies with a joint
constexpr std::uint64_t kSnapshotEvery = 10;
constexpr std::uint64_t kListMax = 5;
constexpr std::uint64_t kNewProgramsMax = 2;  // of a new body
constexpr std::uint64_t kDataMax = 40;        // bytes
constexpr int kTriesMax = 20;                 // of a request whose coordinator is lost
constexpr std::uint64_t kEventsBetweenTries = 50;

v1::BodyRef by_id(std::uint64_t id) {
  v1::BodyRef body;
  body.set_id(id);
  return body;
}

// Two bodies that a joint holds, as spawn_pair() makes them.
bool is_pair(const KnownWorld::Joint& joint) { return joint.parent != 0; }

}  // namespace

Workload::Workload(std::uint64_t seed, const WorldDescription& world, bool has_extremes)
    : seed_(seed), has_extremes_(has_extremes), dice_(seed, kWorkloadStream), session_(seed + 1) {
  known_.settings = world.settings;
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    if (world.bodies[i].properties.motion != Motion::kDynamic) continue;
    known_.bodies.push_back({i + 1, world.bodies[i].name, v1::MOTION_DYNAMIC});
    known_.places.push_back(world.bodies[i].pose.position);
  }
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    for (std::uint32_t place = 0; place < world.bodies[i].programs.size(); ++place)
      known_.programs.push_back({i + 1, place, world.bodies[i].programs[place].kind});
  }
  has_programs_ = !known_.programs.empty();
  if (known_.places.empty()) known_.places.push_back({world.anchor, Eigen::Vector3d::Zero()});
}

void Workload::begin_world() {
  known_.bodies.clear();
  known_.joints.clear();
  known_.programs.clear();
}

absl::Status Workload::give(std::uint32_t place, SimulatedCluster& cluster) {
  dice_ = Dice(seed_, kRequestStreams + place);
  if (snapshots_.size() < kSnapshotsMax && dice_.one_in(kSnapshotEvery)) return take_snapshot(cluster);
  if (has_extremes_) return give_any(cluster);
  v1::Request request;
  const std::uint64_t commands = dice_.one_in(3) ? 1 + dice_.below(kListMax) : 1;
  for (std::uint64_t n = 0; n < commands; ++n) add_command(request);
  absl::Status status = send(cluster, request);
  if (!is_of_torn_joint(status)) return status;
  ++counts_.refused;
  for (const v1::Command& command : request.commands()) {
    for (const v1::SetState::OfJoint& given : command.set_state().joints()) forget_joint(given.joint().id());
  }
  return absl::OkStatus();
}

// A program may have removed a joint before a client has heard of it; nobody else does.
bool Workload::is_of_torn_joint(const absl::Status& status) const {
  return absl::IsNotFound(status) && absl::StrContains(status.message(), "there is no joint") &&
         std::ranges::any_of(known_.programs, [](const KnownWorld::ProgramOf& program) {
           const Program* const kind = find_program(program.kind);
           return kind != nullptr && kind->removes_joints();
         });
}

void Workload::add_command(v1::Request& request) {
  using Add = void (Workload::*)(v1::Request&);
  static constexpr Add kOnBodies[] = {
      &Workload::push,        &Workload::set_velocity, &Workload::apply_force,    &Workload::teleport,
      &Workload::remove_body, &Workload::burst,        &Workload::set_properties, &Workload::set_force};
  if (!known_.programs.empty() && dice_.one_in(4)) return tell(request);
  constexpr std::uint64_t kKinds = std::size(kOnBodies) + 5;
  const std::uint64_t kind = dice_.below(kKinds);
  const bool has_pairs = std::ranges::any_of(known_.joints, is_pair);
  if (kind < std::size(kOnBodies) && !dynamic().empty()) return (this->*kOnBodies[kind])(request);
  if (kind == kKinds - 1 && has_pairs) return remove_joint(request);
  if (kind == kKinds - 2 && !kinematic().empty()) return set_target(request);
  if (kind == kKinds - 3) return spawn_pair(request);
  if (kind == kKinds - 4 && has_pairs) return place_pair(request);
  spawn(request, any_place(), dice_.one_in(4) ? Motion::kKinematic : Motion::kDynamic);
}

// As a client does: where the answer is lost, the request is made again under its number, and a network may
// bring it twice.
Workload::Sent Workload::post(SimulatedCluster& cluster, const v1::Request& request) {
  Sent sent{.id = {session_, ++last_number_}, .request = request};
  sent.request.set_number(last_number_);
  sent.request.set_answered(sent_.empty() ? last_number_ - 1 : sent_.front().id.number - 1);
  cluster.log_of_clients(sent.request.ShortDebugString());
  post_again(cluster, sent);
  counts_.commands += static_cast<std::uint64_t>(request.commands_size());
  counts_.queries += static_cast<std::uint64_t>(request.queries_size());
  return sent;
}

void Workload::post_again(SimulatedCluster& cluster, Sent& sent) {
  sent.first = cluster.post<v1::Request, v1::Reply>(sent.request, sent.id);
  sent.again = dice_.one_in(6) ? cluster.post<v1::Request, v1::Reply>(sent.request, sent.id) : sent.first;
  ++sent.tries;
}

absl::Status Workload::send(SimulatedCluster& cluster, const v1::Request& request) {
  Sent sent = post(cluster, request);
  for (;; post_again(cluster, sent)) {
    absl::StatusOr<v1::Reply> reply = cluster.wait<v1::Reply>(sent.first);
    if (!reply.ok() && sent.again != sent.first) reply = cluster.wait<v1::Reply>(sent.again);
    if (reply.ok()) take(request, reply->applied());
    const bool is_lost = absl::IsUnavailable(reply.status());
    if (!is_lost || sent.tries > kTriesMax || dice_.one_in(3)) return reply.status();
    cluster.run_events(kEventsBetweenTries);
  }
}

// What it has made.
void Workload::take(const v1::Request& request, const v1::Applied& applied) {
  for (const v1::Created& created : applied.created()) {
    const v1::Command& command = request.commands(static_cast<int>(created.command()));
    if (!command.has_spawn()) continue;
    const v1::Model& model = command.spawn().model();
    for (std::uint64_t n = 0; n < created.bodies(); ++n) {
      const v1::Body& body = model.bodies(static_cast<int>(n));
      const std::uint64_t id = created.first_body() + n;
      known_.bodies.push_back({id, "", body.properties().motion()});
      for (int place = 0; place < body.programs_size(); ++place)
        known_.programs.push_back({id, static_cast<std::uint32_t>(place), body.programs(place).kind()});
    }
    for (std::uint64_t n = 0; n < created.joints(); ++n) {
      const v1::JointProperties& joint = model.joints(static_cast<int>(n)).properties();
      const std::uint64_t before = created.first_body() - 1;
      known_.joints.push_back({created.first_joint() + n, "", joint.type(),
                               joint.parent() == 0 ? 0 : before + joint.parent(), before + joint.child()});
    }
  }
}

void Workload::forget_body(std::uint64_t id) {
  std::erase_if(known_.bodies, [id](const KnownWorld::Body& body) { return body.id == id; });
  std::erase_if(known_.joints,
                [id](const KnownWorld::Joint& joint) { return joint.parent == id || joint.child == id; });
  std::erase_if(known_.programs, [id](const KnownWorld::ProgramOf& program) { return program.body == id; });
}

// The joint of one.
std::uint64_t Workload::any_pair() {
  std::vector<std::uint64_t> pairs;
  for (const KnownWorld::Joint& joint : known_.joints) {
    if (is_pair(joint)) pairs.push_back(joint.id);
  }
  return any(pairs);
}

v1::Vector3 Workload::any_vector(double longest) {
  std::array<double, 3> v;
  for (double& coordinate : v) coordinate = dice_.between(-longest, longest);
  return to_proto(Eigen::Vector3d(v.data()));
}

WorldPosition Workload::any_place() {
  const WorldPosition& start = known_.places[dice_.below(known_.places.size())];
  const Eigen::Vector3d there = start.local + from_proto(any_vector(kAround));
  const absl::StatusOr<WorldPosition> place = canonical(start.sector, there, known_.settings.sector_size);
  return place.ok() ? *place : start;  // there is nothing beyond the last sector
}

// What carries a frame stays in the frame that it moves in.
WorldPosition Workload::any_place_for(std::uint64_t body) {
  WorldPosition place = any_place();
  for (const MovingFrame& frame : known_.settings.frames) {
    if (frame.carrier && frame.carrier->body.value == body) place.sector.frame = frame.parent();
  }
  return place;
}

// Some are equal, and shapes go with the last body that has them.
v1::Body Workload::any_body(Motion motion, v1::Model& model) {
  WorldBuilder builder(known_.settings);
  const double edge = kEdge * (1 + static_cast<double>(dice_.below(kSizes)) / kSizes);
  const ShapeId shape = builder.shape(dice_.one_in(2) ? Geometry(Box{{edge, edge, edge}}) : Sphere{edge / 2});
  const BodyDescription body = builder.add("", shape, 1, Eigen::Vector3d::Zero(), motion);
  *model.add_shapes() = to_proto(builder.world().shapes.front());
  v1::Body message = to_proto(body);
  message.mutable_properties()->set_shape(static_cast<std::uint64_t>(model.shapes_size()) - 1);
  return message;
}

AnyProgram Workload::any_program() {
  return {dice_, known_, [this](const NumberSpec& spec) { return usual_number(dice_, spec); }};
}

// In worlds that have some.
void Workload::add_programs(v1::Model& model) {
  if (!has_programs_) return;
  AnyProgram program = any_program();
  const auto bodies = static_cast<std::uint64_t>(model.bodies_size());
  const auto joints = static_cast<std::uint64_t>(model.joints_size());
  for (v1::Body& body : *model.mutable_bodies()) {
    for (std::uint64_t left = dice_.below(kNewProgramsMax + 1); left > 0; --left)
      *body.add_programs() = program.for_body(body.properties().motion(), bodies, joints);
  }
  bring_late_module(model);
}

void Workload::tell(v1::Request& request) {
  *request.add_commands()->mutable_tell_program() = any_program().told();
}

void Workload::spawn(v1::Request& request, const WorldPosition& place, Motion motion) {
  v1::Model& model = *request.add_commands()->mutable_spawn()->mutable_model();
  v1::Body body = any_body(motion, model);
  *body.mutable_pose()->mutable_position() = to_proto(place);
  *model.add_bodies() = std::move(body);
  add_programs(model);
}

// Two bodies with a joint, as a model.
void Workload::spawn_pair(v1::Request& request) {
  v1::Spawn& spawn = *request.add_commands()->mutable_spawn();
  *spawn.mutable_pose() = to_proto(WorldPose{any_place(), Eigen::Quaterniond::Identity()});
  v1::Model& model = *spawn.mutable_model();
  const Eigen::Vector3d across(kApart, 0, 0);
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(0, 0, 0), across}) {
    v1::Body body = any_body(Motion::kDynamic, model);
    *body.mutable_pose()->mutable_position() = to_proto(WorldPosition{{}, place});
    *model.add_bodies() = std::move(body);
  }
  JointDescription joint;
  joint.properties.type = JointType::kBall;
  joint.properties.parent = BodyId{1};
  joint.properties.child = BodyId{2};
  joint.properties.in_parent.position = across / 2;
  joint.properties.in_child.position = -across / 2;
  *model.add_joints() = to_proto(joint);
  add_programs(model);
}

void Workload::place_pair(v1::Request& request) {
  const std::uint64_t id = any_pair();
  const auto joint = std::ranges::find(known_.joints, id, &KnownWorld::Joint::id);
  v1::SetState& state = *request.add_commands()->mutable_set_state();
  v1::SetState::OfBody& parent = *state.add_bodies();
  *parent.mutable_body() = by_id(joint->parent);
  *parent.mutable_pose() = to_proto(WorldPose{any_place_for(joint->parent), Eigen::Quaterniond::Identity()});
  *parent.mutable_angular_velocity() = any_vector(3);
  state.add_joints()->mutable_joint()->set_id(id);
  state.set_keeps_contacts(dice_.one_in(2));
}

void Workload::remove_body(v1::Request& request) {
  const std::uint64_t id = any(dynamic());
  *request.add_commands()->mutable_remove()->mutable_body() = by_id(id);
  forget_body(id);
}

void Workload::remove_joint(v1::Request& request) {
  const std::uint64_t id = any_pair();
  request.add_commands()->mutable_remove_joint()->mutable_joint()->set_id(id);
  forget_joint(id);
}

void Workload::forget_joint(std::uint64_t id) {
  std::erase_if(known_.joints, [id](const KnownWorld::Joint& joint) { return joint.id == id; });
}

void Workload::push(v1::Request& request) {
  v1::ApplyImpulse& command = *request.add_commands()->mutable_apply_impulse();
  *command.mutable_body() = by_id(any(dynamic()));
  *command.mutable_impulse() = any_vector(8);
  *command.mutable_lever() = any_vector(0.2);
}

void Workload::burst(v1::Request& request) {
  v1::ApplyRadialImpulse& command = *request.add_commands()->mutable_apply_radial_impulse();
  *command.mutable_centre() = to_proto(any_place());
  command.set_radius(dice_.between(0.0, known_.settings.sector_size));
  command.set_impulse(dice_.between(-4.0, 4.0));
}

void Workload::set_velocity(v1::Request& request) {
  v1::SetVelocity& command = *request.add_commands()->mutable_set_velocity();
  *command.mutable_body() = by_id(any(dynamic()));
  *command.mutable_linear() = any_vector(5);
  *command.mutable_angular() = any_vector(5);
}

void Workload::set_force(v1::Request& request) {
  v1::SetForce& command = *request.add_commands()->mutable_set_force();
  *command.mutable_body() = by_id(any(dynamic()));
  if (dice_.one_in(3)) return;
  v1::LastingForce& force = *command.mutable_force();
  *force.mutable_force() = any_vector(10);
  *force.mutable_torque() = any_vector(1);
  force.set_body_axes(dice_.one_in(2));
}

void Workload::set_properties(v1::Request& request) {
  v1::SetProperties& command = *request.add_commands()->mutable_set_properties();
  *command.mutable_body() = by_id(any(dynamic()));
  if (dice_.one_in(4)) return command.set_user_data(std::string(1 + dice_.below(kDataMax), 'x'));
  command.set_friction(dice_.between(0.0, 1.0));
  command.set_restitution(dice_.between(0.0, 0.5));
  command.set_gravity(!dice_.one_in(8));
}

void Workload::apply_force(v1::Request& request) {
  v1::ApplyForce& command = *request.add_commands()->mutable_apply_force();
  *command.mutable_body() = by_id(any(dynamic()));
  *command.mutable_force() = any_vector(100);
  *command.mutable_torque() = any_vector(10);
}

void Workload::teleport(v1::Request& request) {
  v1::Teleport& command = *request.add_commands()->mutable_teleport();
  command.set_alone(true);
  const std::uint64_t body = any(dynamic());
  *command.mutable_body() = by_id(body);
  *command.mutable_pose() = to_proto(WorldPose{any_place_for(body), Eigen::Quaterniond::Identity()});
}

void Workload::set_target(v1::Request& request) {
  v1::SetKinematicTarget& command = *request.add_commands()->mutable_set_kinematic_target();
  const std::uint64_t body = any(kinematic());
  *command.mutable_body() = by_id(body);
  *command.mutable_pose() = to_proto(WorldPose{any_place_for(body), Eigen::Quaterniond::Identity()});
}

absl::Status Workload::take_snapshot(SimulatedCluster& cluster) {
  absl::StatusOr<SnapshotChunks> taken = cluster.call<v1::SnapshotRequest, SnapshotChunks>({});
  if (!taken.ok()) return taken.status();
  snapshots_.push_back(*std::move(taken));
  return absl::OkStatus();
}

}  // namespace tessera
