// Where a ray meets a convex solid, by closed forms in double precision: what queries are compared with.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lpss/model/shape.h"

namespace tessera::truth {

// A convex solid in its own frame: box, ball, capsule, cylinder, ellipsoid, plane, or a hull of up to 128
// points (which are tried three by three).
class RayOracle {
 public:
  // The surface is moved outwards by `grown` (m).
  explicit RayOracle(const Geometry& geometry, double grown = 0);

  // m, along the unit vector `direction`, to where the ray from `origin`, outside the solid, meets it first;
  // nothing where it does not.
  std::optional<double> distance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  // rad, from `normal` to the nearest of the normals that the surface has within `tolerance` (m) of `point`:
  // one, or several at edges. pi where the point is not that near.
  double normal_error(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double tolerance) const;

 private:
  struct HalfSpace {
    Eigen::Vector3d normal;  // unit length, out
    double offset = 0;       // m, along it
  };
  // Stretched along the axes, with balls at the ends of a segment along z; or, if `is_tube`, what is around
  // that segment alone.
  struct Round {
    Eigen::Vector3d radii = Eigen::Vector3d::Zero();
    double half_length = 0;
    bool is_tube = false;
  };
  using Normals = std::vector<Eigen::Vector3d>;

  void add_hull(const std::vector<Eigen::Vector3d>& points, double grown);
  Normals normals_at(const Eigen::Vector3d& point, double tolerance) const;

  std::vector<HalfSpace> half_spaces_;  // the solid is in all of them
  std::optional<Round> round_;          // and in this
};

}  // namespace tessera::truth
