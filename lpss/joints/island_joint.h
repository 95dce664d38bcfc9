// A joint of an island, as a task has it.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "lpss/joints/joint_form.h"

namespace tessera {

// A joint needs no clone: only relative quantities go into its rows, so its bodies may be in any two worlds.
struct IslandJoint {
  static constexpr std::size_t kNoBody = ~std::size_t{0};

  JointId id;
  const JointForm* form = nullptr;
  const JointDrives* drives = nullptr;
  std::size_t child = 0;         // a place among the bodies
  std::size_t parent = kNoBody;  // likewise; none for the world, static and kinematic bodies
  // Only without a parent: the joint frame on its side, relative to the centre of the child's sector, and its
  // motion.
  Pose fixed_parent;
  Eigen::Vector3d fixed_velocity = Eigen::Vector3d::Zero();  // m/s, of its origin
  Eigen::Vector3d fixed_spin = Eigen::Vector3d::Zero();      // rad/s
  Eigen::Vector3d parent_origin = Eigen::Vector3d::Zero();   // the parent's sector from the child's, m

  bool has_parent() const { return parent != kNoBody; }

  // By a side that no solver moves; `origin`: its sector from the child's, m.
  void fix_parent(const JointSide& side, const Eigen::Vector3d& origin) {
    const Eigen::Vector3d lever = side.pose.orientation * form->in_parent.position;
    fixed_parent = side.pose * form->in_parent;
    fixed_parent.position += origin;
    fixed_velocity = side.linear_velocity + side.angular_velocity.cross(lever);
    fixed_spin = side.angular_velocity;
  }
};

// A body that has diverged, and of its joints the one whose error is largest: how far the child would have to
// be moved, its centre by a twist of the joint included.
struct BlamedJoint {
  std::size_t body;   // a place among the bodies
  std::size_t joint;  // likewise
};

}  // namespace tessera
