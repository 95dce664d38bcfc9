#include "lpss/observe/mechanics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "lpss/model/world_records.h"

namespace tessera {
namespace {

double larger(double a, double b) {
  return std::isfinite(b) ? std::max(a, b) : std::numeric_limits<double>::infinity();
}

}  // namespace

absl::StatusOr<MechanicsOfWorld> MechanicsOfWorld::create(const WorldDescription& world) {
  absl::StatusOr<std::vector<BodyRecord>> bodies = records_of(world);
  if (!bodies.ok()) return bodies.status();
  absl::StatusOr<std::vector<JointRecord>> joints = joint_records_of(world);
  if (!joints.ok()) return joints.status();
  MechanicsOfWorld mechanics;
  mechanics.settings_ = world.settings;
  mechanics.anchor_ = world.anchor;
  mechanics.bodies_ = *std::move(bodies);
  mechanics.joints_ = *std::move(joints);
  return mechanics;
}

// Relative to the centre of the anchor's sector.
JointSide MechanicsOfWorld::side(BodyId id) const {
  const BodyRecord& body = bodies_[id.value - 1];
  return {{metres_between(anchor_, body.home, settings_.sector_size) +
               Eigen::Vector3d(body.state.position.data()),
           quaternion_of(body.state)},
          Eigen::Vector3d(body.state.linear_velocity.data()),
          Eigen::Vector3d(body.state.angular_velocity.data())};
}

Mechanics MechanicsOfWorld::at(std::span<const BodyRecord> bodies, double lag) {
  const auto* gravity = std::get_if<UniformGravity>(&settings_.gravity);
  Mechanics now;
  for (const BodyRecord& body : bodies) {
    bodies_[body.id.value - 1] = body;
    const BodyProperties& properties = body.properties;
    if (properties.motion != Motion::kDynamic) continue;
    const JointSide at = side(body.id);
    const Eigen::Vector3d inertia(properties.inertia.data());
    const Eigen::Vector3d spin = at.pose.orientation.conjugate() * at.angular_velocity;
    const Eigen::Vector3d momentum = properties.mass * at.linear_velocity;
    now.kinetic += (momentum.dot(at.linear_velocity) + spin.cwiseAbs2().dot(inertia)) / 2;
    if (gravity != nullptr && properties.gravity) {
      const Eigen::Vector3d place = at.pose.position - at.linear_velocity * lag;
      now.potential -= properties.mass * gravity->acceleration.dot(place);
    }
    now.momentum += momentum;
    now.angular_momentum +=
        at.pose.position.cross(momentum) + at.pose.orientation * inertia.cwiseProduct(spin);
  }
  for (const JointRecord& joint : joints_) {
    const JointProperties& properties = joint.properties;
    JointSide parent;
    if (properties.parent.value != 0) {
      parent = side(properties.parent);
    } else {
      parent.pose.position = metres_between(anchor_, properties.anchor, settings_.sector_size);
    }
    now.joints.push_back(joint_state(properties, parent, side(properties.child)));
    const std::span<const JointAxis> axes = axes_of(properties);
    for (std::size_t n = 0; n < axes.size(); ++n) {
      const double rate = now.joints.back().velocity[n];
      now.kinetic += axes[n].armature * rate * rate / 2;
    }
    now.gap = larger(now.gap, now.joints.back().gap);
    now.twist = larger(now.twist, now.joints.back().twist);
  }
  return now;
}

}  // namespace tessera
