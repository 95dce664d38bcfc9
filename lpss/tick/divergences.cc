#include "lpss/tick/divergences.h"

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <map>

namespace tessera {
namespace {

Eigen::Vector3d eigen(const std::array<double, 3>& v) { return Eigen::Vector3d(v.data()); }

JointSide side_of(const WorldBody& body) {
  const BodyState state = body.world->state(body.slot);
  return {{eigen(state.position), quaternion_of(state)},
          eigen(state.linear_velocity),
          eigen(state.angular_velocity)};
}

// Or may have, where it turns fast: integrate() decides, by its size.
bool has_diverged(const WorldBody& body) {
  constexpr double kOfAnySize = std::numeric_limits<double>::infinity();
  const BodyState state = body.world->state(body.slot);
  return divergence_of(eigen(state.linear_velocity), eigen(state.angular_velocity), kOfAnySize).has_value();
}

// m: how far the child is from where the joint would have it.
double error_of(const TaskJoint& joint) {
  const JointProperties& properties = *joint.properties;
  const JointSide child = side_of(joint.child);
  JointSide parent;
  if (joint.parent.world != nullptr) {
    parent = side_of(joint.parent);
    parent.pose.position += joint.parent_origin;
  } else {
    parent.pose = joint.fixed_parent * properties.in_parent.inverse();
  }
  const JointState state = joint_state(properties, parent, child);
  return state.gap + state.twist * properties.in_child.position.norm();
}

}  // namespace

void blame_joints(const SolveJob& job, BlamedJoints& blamed) {
  std::map<BodyId, double> worst;
  for (std::size_t n = 0; n < job.task.joints.size(); ++n) {
    const TaskJoint& joint = job.task.joints[n];
    const bool has_parent = joint.parent.world != nullptr;
    const bool child = has_diverged(joint.child);
    const bool parent = has_parent && has_diverged(joint.parent);
    if (!child && !parent) continue;
    const double error = error_of(joint);
    const auto blame = [&](BodyId body) {
      const auto [known, is_new] = worst.try_emplace(body, error);
      if (!is_new && !(error > known->second)) return;
      known->second = error;
      blamed[body] = job.joints[n];
    };
    if (child) blame(joint.properties->child);
    if (parent) blame(joint.properties->parent);
  }
}

std::optional<DivergenceKind> stop_if_diverged(Partition& partition, HomeBody& body) {
  SectorWorld& world = *body.sector->world;
  BodyState state = world.state(body.slot);
  const BodyProperties& properties = body.properties;
  Eigen::Vector3d linear = eigen(state.linear_velocity);
  Eigen::Vector3d angular = eigen(state.angular_velocity);
  if (properties.motion == Motion::kDynamic) {
    const Wrench wrench = world.total_wrench(body.slot);
    const double least = *std::ranges::min_element(properties.inertia);
    linear += eigen(wrench.force) * (partition.dt() / properties.mass);
    angular += eigen(wrench.torque) * (partition.dt() / least);
  }
  const std::optional<DivergenceKind> kind = divergence_of(linear, angular, body.radius);
  if (!kind) return std::nullopt;
  state.linear_velocity = {};
  state.angular_velocity = {};
  world.set_state(body.slot, state);
  if (properties.motion == Motion::kDynamic) world.set_total_wrench(body.slot, {});
  body.kinematic_target.reset();
  return kind;
}

std::vector<Divergence> divergences_of(Tick tick, const std::vector<Stopped>& stopped,
                                       const BlamedJoints& blamed) {
  std::vector<Divergence> events;
  for (const auto& [body, kind] : stopped) {
    const auto joint = blamed.find(body);
    events.push_back({tick, body, joint == blamed.end() ? JointId{} : joint->second, kind});
  }
  std::sort(events.begin(), events.end());
  return events;
}

}  // namespace tessera
