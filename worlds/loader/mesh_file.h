// Meshes from files: OBJ, STL and the other formats that assimp reads.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tessera {

// One object of a file; metres, in the file's axes.
struct SubMesh {
  std::string name;      // of the nearest node that has one
  std::string geometry;  // its own
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::uint32_t> indices;   // three per triangle
  std::optional<std::uint32_t> colour;  // of its material: 0xRRGGBB
};

// The objects of a file in its order. NOT_FOUND if there is no such file; INVALID_ARGUMENT if it has no
// triangles, cannot be read as a mesh, or exceeds the limits on bytes, vertices and indices.
absl::StatusOr<std::vector<SubMesh>> read_mesh_file(const std::filesystem::path& file);

// At most `points_max` points whose convex hull is nearly that of `points`: the farthest ones in
// this many evenly distributed directions. All points, without duplicates, if they are few enough.
std::vector<Eigen::Vector3d> hull_points(const std::vector<Eigen::Vector3d>& points, std::size_t points_max);

}  // namespace tessera
