#include "client_sdk/src/joint_stream.h"

#include <algorithm>

namespace tessera {
namespace {

// A body's state in its body frame, relative to the centre of `sector`. The sample has the velocity of the
// point `centre`.
JointSide side_of(const BodySample& body, const Eigen::Vector3d& centre, const SectorIndex& sector,
                  double sector_size) {
  JointSide side;
  side.pose = {relative_to(body.pose.position, sector, sector_size), body.pose.orientation};
  side.angular_velocity = body.angular_velocity;
  side.linear_velocity = body.linear_velocity - body.angular_velocity.cross(body.pose.orientation * centre);
  return side;
}

const BodySample* find(const BodyFrame& frame, BodyId id) {
  const auto found = std::lower_bound(frame.bodies.begin(), frame.bodies.end(), id,
                                      [](const BodySample& body, BodyId wanted) { return body.id < wanted; });
  return found != frame.bodies.end() && found->id == id ? &*found : nullptr;
}

}  // namespace

JointState joint_state(const FoundJoint& joint, const BodySample* parent, const BodySample& child,
                       double sector_size) {
  const JointProperties& properties = joint.joint.properties;
  // Relative to the child's sector, numbers are small anywhere in the world.
  const SectorIndex& sector = child.pose.position.sector;
  JointSide parent_side;
  parent_side.pose.position = metres_between(sector, properties.anchor, sector_size);
  if (parent != nullptr) parent_side = side_of(*parent, joint.parent_centre, sector, sector_size);
  return joint_state(properties, parent_side, side_of(child, joint.child_centre, sector, sector_size));
}

std::vector<BodyId> bodies_of(const std::vector<FoundJoint>& joints) {
  std::vector<BodyId> bodies;
  for (const FoundJoint& joint : joints) {
    bodies.push_back(joint.joint.properties.child);
    if (joint.joint.properties.parent.value != 0) bodies.push_back(joint.joint.properties.parent);
  }
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  return bodies;
}

JointFrame joints_in(const BodyFrame& bodies, const std::vector<FoundJoint>& joints, double sector_size) {
  JointFrame frame{bodies.tick, {}};
  frame.joints.reserve(joints.size());
  for (const FoundJoint& joint : joints) {
    const BodyId parent_id = joint.joint.properties.parent;
    const BodySample* child = find(bodies, joint.joint.properties.child);
    const BodySample* parent = parent_id.value == 0 ? nullptr : find(bodies, parent_id);
    if (child == nullptr || (parent == nullptr && parent_id.value != 0)) continue;
    frame.joints.push_back({joint.id, joint_state(joint, parent, *child, sector_size), child->asleep});
  }
  return frame;
}

}  // namespace tessera
