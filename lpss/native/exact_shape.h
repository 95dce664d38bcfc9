// Convex shapes as sweeps see them: in double precision, and nothing of them rounded off.
#pragma once

#include <vector>

#include "lpss/collision/core.h"
#include "lpss/native/solid.h"

namespace tessera::native {

class ExactShape {
 public:
  // Not convex: nothing of it touches anything.
  explicit ExactShape(const Geometry& geometry);
  // Of a part that is convex, and no plane.
  explicit ExactShape(const Part& part);
  explicit ExactShape(const MeshTriangle<Scalar>& triangle);

  ExactShape(const ExactShape&) = delete;
  ExactShape& operator=(const ExactShape&) = delete;

  bool is_convex() const { return is_convex_; }
  const collision::Core<double>& core() const { return core_; }

  // The point that is farthest along `direction`, of the shape turned by `rotation` around the origin.
  Eigen::Vector3d farthest(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& direction) const;

 private:
  void set_points(std::vector<Eigen::Vector3d> points, double margin);

  collision::Core<double> core_;
  std::vector<Eigen::Vector3d> points_;
  bool is_convex_ = true;
};

}  // namespace tessera::native
