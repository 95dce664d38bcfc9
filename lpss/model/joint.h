// Joints of a world, which connect two bodies. Plain data, like bodies.
#pragma once

#include <compare>

#include "lpss/grid/sector_index.h"
#include "lpss/joints/joint_form.h"
#include "lpss/joints/joint_loads.h"
#include "lpss/model/body.h"

namespace tessera {

struct JointProperties : JointForm {
  BodyId parent;                // of any motion; 0: the world
  BodyId child;                 // dynamic
  SectorIndex anchor;           // parent is the world: the sector to whose centre `in_parent` is relative
  bool bodies_collide = false;  // whether parent and child collide with each other
};

// A joint as one record.
struct JointRecord {
  JointId id;
  JointProperties properties;
  Motion parent_motion = Motion::kStatic;  // of the parent body; the world is static
  JointDrives drives;
  JointLoads loads;  // of the last tick in which its bodies were awake
};

// What is known of a joint away from the home of its child. Only the motion of its parent ever changes.
struct JointTie {
  JointId id;
  BodyId parent;  // 0: the world
  BodyId child;
  Motion parent_motion = Motion::kStatic;
  bool bodies_collide = false;

  friend auto operator<=>(const JointTie&, const JointTie&) = default;
};

inline JointTie tie_of(const JointRecord& joint) {
  const JointProperties& properties = joint.properties;
  return {joint.id, properties.parent, properties.child, joint.parent_motion, properties.bodies_collide};
}

// A body as a side of its joints.
inline JointSide side_of(const BodyState& state) {
  return {{Eigen::Vector3d(state.position.data()), quaternion_of(state)},
          Eigen::Vector3d(state.linear_velocity.data()),
          Eigen::Vector3d(state.angular_velocity.data())};
}

}  // namespace tessera
