// Finds the triangles of a large mesh by place.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <unsupported/Eigen/BVH>
#include <vector>

#include "lpss/model/shape.h"

namespace tessera {

class MeshTree {
 public:
  // The mesh must outlive the tree.
  explicit MeshTree(const TriangleMesh& mesh);

  // The triangles whose boxes meet `box` (m, in the frame of the mesh), as their places among the triangles
  // of the mesh, ascending.
  std::vector<std::uint32_t> overlapping(const Eigen::AlignedBox3d& box) const;

 private:
  const TriangleMesh& mesh_;
  Eigen::KdBVH<double, 3, std::uint32_t> tree_;
};

}  // namespace tessera
