// Rigid transforms.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tessera {

// A rigid transform in metres, mapping coordinates of the child frame to those of its parent.
struct Pose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();

  Pose operator*(const Pose& child) const;
  Pose inverse() const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return position + orientation * point; }
  bool is_identity() const;
};

}  // namespace tessera
