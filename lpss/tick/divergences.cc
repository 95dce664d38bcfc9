#include "lpss/tick/divergences.h"

#include <Eigen/Core>
#include <algorithm>

namespace tessera {
namespace {

Eigen::Vector3d eigen(const std::array<double, 3>& v) { return Eigen::Vector3d(v.data()); }

}  // namespace

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
