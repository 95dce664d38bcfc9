#include "lpss/partition/mesh_tree.h"

#include <algorithm>
#include <numeric>

namespace tessera {
namespace {

Eigen::AlignedBox3d box_of_triangle(const TriangleMesh& mesh, std::uint32_t triangle) {
  Eigen::AlignedBox3d box;
  for (std::size_t corner = 0; corner < 3; ++corner) {
    box.extend(mesh.vertices[mesh.indices[3 * std::size_t{triangle} + corner]]);
  }
  return box;
}

// What Eigen::BVIntersect asks, and tells.
struct Overlaps {
  const TriangleMesh& mesh;
  const Eigen::AlignedBox3d& wanted;
  std::vector<std::uint32_t> found;

  bool intersectVolume(const Eigen::AlignedBox3d& volume) const { return volume.intersects(wanted); }
  // True would end the search.
  bool intersectObject(std::uint32_t triangle) {
    if (box_of_triangle(mesh, triangle).intersects(wanted)) found.push_back(triangle);
    return false;
  }
};

}  // namespace

MeshTree::MeshTree(const TriangleMesh& mesh) : mesh_(mesh) {
  std::vector<std::uint32_t> triangles(mesh.indices.size() / 3);
  std::iota(triangles.begin(), triangles.end(), 0u);
  std::vector<Eigen::AlignedBox3d> boxes;
  boxes.reserve(triangles.size());
  for (const std::uint32_t triangle : triangles) boxes.push_back(box_of_triangle(mesh, triangle));
  tree_.init(triangles.begin(), triangles.end(), boxes.begin(), boxes.end());
}

std::vector<std::uint32_t> MeshTree::overlapping(const Eigen::AlignedBox3d& box) const {
  Overlaps query{mesh_, box, {}};
  if (!mesh_.indices.empty()) Eigen::BVIntersect(tree_, query);
  std::sort(query.found.begin(), query.found.end());
  return std::move(query.found);
}

}  // namespace tessera
