// Which triangles of a mesh share edges.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace tessera::bullet {

// Positions in m, in the frame of the mesh. An edge belongs to two triangles that have its corners within 0.1
// mm; one of a single triangle, or of more than two, is an outer edge. Triangles without area have no edges.
class TriangleEdges {
 public:
  using Corners = std::array<Eigen::Vector3d, 3>;
  using Vertices = std::array<std::uint32_t, 3>;

  // Makes room for so many vertices and triangles.
  void reserve(std::size_t vertices, std::size_t triangles);

  // Adds a vertex. Its number: they count from 0.
  std::uint32_t add(const Eigen::Vector3d& vertex);

  // Adds a triangle. `key` is its name for beyond(); keys that count from 0, in order, are found fastest.
  void add(std::uint64_t key, const Vertices& vertices);
  void add(std::uint64_t key, const Corners& corners);

  // Finds the shared edges, after all triangles are added, and forgets the vertices.
  void connect();

  // The triangle beyond edge `n` of a triangle, from its corner n to the next. None at outer edges and for
  // unknown triangles.
  struct Neighbour {
    std::uint64_t key;
    bool is_reversed;  // it winds the other way
  };
  std::optional<Neighbour> beyond(std::uint64_t key, int n) const;

  // Its unit normal, on the side to which the triangle's own normal points.
  std::optional<Eigen::Vector3d> across(std::uint64_t key, int n) const;

 private:
  struct Triangle {
    std::uint64_t key;
    Eigen::Vector3d normal;                          // 0 without area
    std::array<std::int32_t, 3> beyond{-1, -1, -1};  // by edge, an index into triangles_
    std::array<bool, 3> is_reversed{};               // the one beyond winds the other way
  };

  const Triangle* find(std::uint64_t key) const;
  void sort_by_keys();

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Vertices> vertices_of_;  // by triangle
  std::vector<Triangle> triangles_;    // ascending by key, once connected
};

}  // namespace tessera::bullet
