// The dynamics of an assembly, computed here: servers tell where its bodies are and how they move.

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "coordinator/asked_states.h"
#include "coordinator/limits.h"
#include "coordinator/query_kinds.h"
#include "lpss/joints/tree_dynamics.h"
#include "lpss/model/checks.h"
#include "lpss/model/gravity.h"
#include "proto/convert.h"

namespace tessera {
namespace {

using joints::TreeBody;
using joints::TreeDynamics;
using joints::TreeJoint;

// Bodies that joints connect, as a tree from its base on.
struct Assembly {
  std::vector<BodyId> bodies;              // that can be pushed; the first floats, or hangs on the ground
  std::vector<BodyProperties> properties;  // of these
  std::vector<JointRecord> joints;         // each after the one that its inner body hangs on
  std::vector<TreeJoint> tree;             // of these, without their forms
  BodyId ground;                           // of the first joint, where nothing floats; 0 may be the world
  BodyProperties of_ground;                // if it is a body
  bool floats = true;
  std::size_t freedoms = 0;
};

struct AskedPoint {
  std::size_t body;       // of the assembly
  Eigen::Vector3d local;  // m, in its centre frame
};

bool can_be_pushed(const WorldRegistry& world, BodyId id) {
  const WorldRegistry::Entry* const body = world.find(id);
  return body != nullptr && body->properties.motion == Motion::kDynamic;
}

// All bodies that can be pushed that joints connect with this one.
std::set<BodyId> connected(BodyId body, const WorldRegistry& world) {
  std::set<BodyId> all{body};
  std::vector<BodyId> open{body};
  while (!open.empty()) {
    const BodyId at = open.back();
    open.pop_back();
    for (const JointRegistry::Entry* const joint : world.joints().of(at)) {
      const JointProperties& properties = joint->record.properties;
      const BodyId other = properties.child == at ? properties.parent : properties.child;
      if (can_be_pushed(world, other) && all.insert(other).second) open.push_back(other);
    }
  }
  return all;
}

// Grows a tree from its base on, by the joints with the lowest ids that reach farther.
class Grower {
 public:
  Grower(const std::set<BodyId>& bodies, const WorldRegistry& world) : world_(world) {
    for (const BodyId body : bodies) {
      for (const JointRegistry::Entry* const joint : world.joints().of(body)) {
        joints_.emplace(joint->record.id, joint);
        if (is_ground(joint->record) && (!root_ || joint->record.id < root_->record.id)) root_ = joint;
      }
    }
    if (root_ != nullptr) {
      assembly_.floats = false;
      assembly_.ground = root_->record.properties.parent;
      if (const WorldRegistry::Entry* const ground = world.find(assembly_.ground))
        assembly_.of_ground = ground->properties;
      frontier_.insert(root_->record.id);
    } else {
      reach(*bodies.begin());
    }
  }

  absl::StatusOr<Assembly> grown() {
    while (!frontier_.empty()) {
      const JointId next = *frontier_.begin();
      frontier_.erase(frontier_.begin());
      if (absl::Status status = add(*joints_.at(next)); !status.ok()) return status;
    }
    return std::move(assembly_);
  }

 private:
  bool is_ground(const JointRecord& joint) const { return !can_be_pushed(world_, joint.properties.parent); }

  std::optional<std::size_t> place_of(BodyId body) const {
    const auto found = places_.find(body);
    return found == places_.end() ? std::nullopt : std::optional(found->second);
  }

  void reach(BodyId body) {
    places_.emplace(body, assembly_.bodies.size());
    assembly_.bodies.push_back(body);
    assembly_.properties.push_back(world_.find(body)->properties);
    for (const JointRegistry::Entry* const joint : world_.joints().of(body)) {
      if (!added_.contains(joint->record.id)) frontier_.insert(joint->record.id);
    }
  }

  absl::Status add(const JointRegistry::Entry& joint) {
    const JointProperties& properties = joint.record.properties;
    const bool on_ground = is_ground(joint.record);
    const std::optional<std::size_t> child = place_of(properties.child);
    const std::optional<std::size_t> parent = on_ground ? std::nullopt : place_of(properties.parent);
    if (child && (parent || on_ground))
      return refused("joint \"", joint.name, "\" closes a loop: the assembly must be a tree");
    added_.insert(joint.record.id);
    TreeJoint link;
    link.outer_is_child = !child;
    link.inner = child ? child : parent;
    link.outer = assembly_.bodies.size();
    assembly_.tree.push_back(link);
    assembly_.joints.push_back(joint.record);
    assembly_.freedoms += TreeDynamics::freedoms(properties.type);
    reach(child ? properties.parent : properties.child);
    return absl::OkStatus();
  }

  const WorldRegistry& world_;
  std::map<JointId, const JointRegistry::Entry*> joints_;
  const JointRegistry::Entry* root_ = nullptr;
  std::map<BodyId, std::size_t> places_;
  std::set<JointId> frontier_;
  std::set<JointId> added_;
  Assembly assembly_;
};

absl::StatusOr<BodyId> body_of(const v1::DynamicsQuery& query, const WorldRegistry& world) {
  if (query.has_body()) {
    absl::StatusOr<BodyId> body = world.resolve(query.body());
    if (!body.ok()) return in("body", body.status());
    if (!can_be_pushed(world, *body)) return refused("body must be dynamic");
    return body;
  }
  if (!query.has_joint()) return refused("body or joint must say which assembly is meant");
  const absl::StatusOr<JointId> joint = world.joints().resolve(query.joint());
  if (!joint.ok()) return in("joint", joint.status());
  return world.joints().find(*joint)->record.properties.child;
}

absl::StatusOr<Assembly> assembly_of(const v1::DynamicsQuery& query, const WorldRegistry& world) {
  const absl::StatusOr<BodyId> body = body_of(query, world);
  if (!body.ok()) return body.status();
  const std::set<BodyId> bodies = connected(*body, world);
  if (bodies.size() > kDynamicsBodiesMax)
    return refused("the assembly has ", bodies.size(), " bodies, at most ", kDynamicsBodiesMax);
  absl::StatusOr<Assembly> assembly = Grower(bodies, world).grown();
  if (assembly.ok() && assembly->floats) assembly->freedoms += 6;
  return assembly;
}

absl::StatusOr<std::vector<AskedPoint>> points_of(const v1::DynamicsQuery& query, const Assembly& assembly,
                                                  const WorldRegistry& world) {
  if (query.points_size() > kDynamicsPointsMax)
    return refused("points: ", query.points_size(), " elements must be at most ", kDynamicsPointsMax);
  std::vector<AskedPoint> points;
  for (const v1::DynamicsQuery::Point& point : query.points()) {
    const absl::StatusOr<BodyId> body = world.resolve(point.body());
    if (!body.ok()) return in("points: body", body.status());
    const auto found = std::ranges::find(assembly.bodies, *body);
    if (found == assembly.bodies.end()) return refused("points: body must be of the assembly");
    const Eigen::Vector3d local = from_proto(point.local());
    if (absl::Status status = finite("points: local", local); !status.ok()) return status;
    points.push_back({static_cast<std::size_t>(found - assembly.bodies.begin()),
                      centre_frame(world.find(*body)->properties).inverse() * local});
  }
  return points;
}

// Where the bodies are, relative to the sector of the first one. Nothing if one of them is not there or is in
// another frame.
std::optional<TreeDynamics> dynamics_of(const Assembly& assembly, std::span<const BodyRow> rows,
                                        const WorldSettings& settings) {
  const BodyRow* const first = row_of(rows, assembly.bodies.front());
  if (first == nullptr) return std::nullopt;
  const SectorIndex& sector = first->pose.position.sector;
  std::vector<TreeBody> bodies;
  for (std::size_t n = 0; n < assembly.bodies.size(); ++n) {
    const BodyRow* const row = row_of(rows, assembly.bodies[n]);
    if (row == nullptr || row->pose.position.sector.frame != sector.frame) return std::nullopt;
    const BodyProperties& properties = assembly.properties[n];
    TreeBody& body = bodies.emplace_back();
    body.mass = properties.mass;
    body.side = side_of(*row, properties, sector, settings.sector_size);
    const Eigen::Matrix3d axes = body.side.pose.orientation.toRotationMatrix();
    body.inertia = axes * Eigen::Vector3d(properties.inertia.data()).asDiagonal() * axes.transpose();
    if (!properties.gravity) continue;
    const SectorIndex& home = row->pose.position.sector;
    const Eigen::Vector3d centre = side_of(*row, properties, home, settings.sector_size).pose.position;
    body.force = body.mass * acceleration_at(settings.gravity, home, centre, settings.sector_size);
  }
  std::vector<TreeJoint> tree = assembly.tree;
  for (std::size_t n = 0; n < tree.size(); ++n) tree[n].form = &assembly.joints[n].properties;
  JointSide ground;
  if (assembly.ground.value != 0) {
    const BodyRow* const row = row_of(rows, assembly.ground);
    if (row == nullptr || row->pose.position.sector.frame != sector.frame) return std::nullopt;
    ground = side_of(*row, assembly.of_ground, sector, settings.sector_size);
  } else if (!assembly.floats) {
    const SectorIndex& anchor = assembly.joints.front().properties.anchor;
    if (anchor.frame != sector.frame) return std::nullopt;
    ground.pose.position = metres_between(sector, anchor, settings.sector_size);
  }
  return TreeDynamics(bodies, tree, ground);
}

using Numbers = google::protobuf::RepeatedField<double>;

void write(const Eigen::MatrixXd& rows, Numbers& into) {
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    for (Eigen::Index column = 0; column < rows.cols(); ++column) into.Add(rows(row, column));
  }
}

v1::Dynamics result_of(const v1::DynamicsQuery& query, const Assembly& assembly,
                       std::span<const AskedPoint> points, const TreeDynamics& dynamics) {
  v1::Dynamics result;
  if (assembly.floats) result.set_base(assembly.bodies.front().value);
  for (const JointRecord& joint : assembly.joints) {
    result.add_joints(joint.id.value);
    result.add_freedoms(static_cast<std::uint32_t>(TreeDynamics::freedoms(joint.properties.type)));
  }
  write(dynamics.velocities(), *result.mutable_velocities());
  write(dynamics.efforts(Eigen::VectorXd::Zero(dynamics.freedoms())), *result.mutable_bias());
  if (query.accelerations_size() > 0) {
    const Eigen::Map<const Eigen::VectorXd> given(query.accelerations().data(), dynamics.freedoms());
    write(dynamics.efforts(given), *result.mutable_efforts());
  }
  if (query.mass_matrix()) write(dynamics.mass_matrix(), *result.mutable_mass_matrix());
  for (const auto& [body, local] : points) write(dynamics.jacobian(body, local), *result.mutable_jacobians());
  return result;
}

}  // namespace

absl::StatusOr<AskedQuery> ask(const v1::DynamicsQuery& query, const WorldRegistry& world) {
  absl::StatusOr<Assembly> assembly = assembly_of(query, world);
  if (!assembly.ok()) return assembly.status();
  if (query.accelerations_size() > 0 && query.accelerations_size() != static_cast<int>(assembly->freedoms)) {
    return refused("accelerations: ", query.accelerations_size(), " elements must be as many as the ",
                   assembly->freedoms, " degrees of freedom of the assembly");
  }
  for (const double acceleration : query.accelerations()) {
    if (absl::Status status = bounded("accelerations", acceleration, -kNoBound, kNoBound, "m/s^2 or rad/s^2");
        !status.ok())
      return status;
  }
  absl::StatusOr<std::vector<AskedPoint>> points = points_of(query, *assembly, world);
  if (!points.ok()) return points.status();
  std::set<std::uint64_t> bodies{assembly->ground.value};
  for (const BodyId id : assembly->bodies) bodies.insert(id.value);
  AskedQuery ask;
  ask.asked.push_back(ask_states_of(bodies));
  ask.finish = [query, assembly = *std::move(assembly), points = *std::move(points)](
                   std::span<Parts> parts, const WorldRegistry& now, v1::QueryResult& result) {
    const absl::StatusOr<std::vector<BodyRow>> rows = states_of(parts[0]);
    if (!rows.ok()) return rows.status();
    v1::Dynamics& told = *result.mutable_dynamics();
    const std::optional<TreeDynamics> dynamics = dynamics_of(assembly, *rows, now.settings());
    if (dynamics) told = result_of(query, assembly, points, *dynamics);
    return absl::OkStatus();
  };
  return ask;
}

}  // namespace tessera
