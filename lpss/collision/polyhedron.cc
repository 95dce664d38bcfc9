#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "lpss/collision/shapes.h"

namespace tessera::collision {
namespace {

using Loop = std::vector<int>;
using DirectedEdges = std::map<std::pair<int, int>, int>;  // (tail, head) -> loop

// Twice the area, along the normal (Newell).
Eigen::Vector3d area_of(const Loop& loop, const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const Eigen::Vector3d& origin = points[loop[0]];
  for (std::size_t n = 1; n + 1 < loop.size(); ++n)
    sum += (points[loop[n]] - origin).cross(points[loop[n + 1]] - origin);
  return sum;
}

// Empty if an edge occurs twice in one direction.
DirectedEdges edges_of(const std::vector<Loop>& loops) {
  DirectedEdges edges;
  for (std::size_t f = 0; f < loops.size(); ++f) {
    for (std::size_t n = 0; n < loops[f].size(); ++n) {
      const std::pair edge(loops[f][n], loops[f][(n + 1) % loops[f].size()]);
      if (!edges.emplace(edge, static_cast<int>(f)).second) return {};
    }
  }
  return edges;
}

// The boundary of a set of loops, as one loop; empty if it is not one.
Loop boundary(const std::vector<Loop>& loops, const std::vector<int>& set) {
  std::map<std::pair<int, int>, bool> directed;
  for (int f : set) {
    for (std::size_t n = 0; n < loops[f].size(); ++n)
      directed[{loops[f][n], loops[f][(n + 1) % loops[f].size()]}] = true;
  }
  std::map<int, int> next;
  std::size_t length = 0;
  for (const auto& [edge, is_in] : directed) {
    if (directed.contains({edge.second, edge.first})) continue;
    if (!next.emplace(edge).second) return {};
    ++length;
  }
  Loop loop;
  if (next.empty()) return loop;
  for (int v = next.begin()->first; loop.size() < length; v = next[v]) {
    loop.push_back(v);
    if (!next.contains(next[v])) return {};
  }
  return next[loop.back()] == loop.front() ? loop : Loop{};
}

// Grows each face, the largest first, over neighbours that are within `tolerance` (m) of its plane.
std::vector<Loop> merge_coplanar(const std::vector<Loop>& loops, const std::vector<Eigen::Vector3d>& points,
                                 double tolerance) {
  const DirectedEdges edges = edges_of(loops);
  std::vector<std::pair<double, int>> order;
  for (std::size_t f = 0; f < loops.size(); ++f)
    order.emplace_back(-area_of(loops[f], points).norm(), static_cast<int>(f));
  std::sort(order.begin(), order.end());

  std::vector<bool> is_taken(loops.size(), false);
  std::vector<Loop> merged;
  for (const auto& [area, seed] : order) {
    if (is_taken[seed]) continue;
    if (area == 0) return {};
    const Eigen::Vector3d normal = area_of(loops[seed], points) / -area;
    const double offset = normal.dot(points[loops[seed][0]]);
    const auto is_in_plane = [&](int v) { return std::abs(normal.dot(points[v]) - offset) <= tolerance; };
    std::vector<int> set{seed};
    is_taken[seed] = true;
    for (std::size_t k = 0; k < set.size(); ++k) {
      const Loop& loop = loops[set[k]];
      for (std::size_t n = 0; n < loop.size(); ++n) {
        const auto across = edges.find({loop[(n + 1) % loop.size()], loop[n]});
        if (across == edges.end() || is_taken[across->second]) continue;
        const Loop& other = loops[across->second];
        if (!std::all_of(other.begin(), other.end(), is_in_plane)) continue;
        is_taken[across->second] = true;
        set.push_back(across->second);
      }
    }
    merged.push_back(boundary(loops, set));
    if (merged.back().size() < 3) return {};
  }
  return merged;
}

// A vertex where fewer than three faces meet is no corner.
void drop_idle_vertices(std::vector<Loop>& loops, std::size_t vertices) {
  std::vector<int> uses(vertices, 0);
  for (const Loop& loop : loops) {
    for (int v : loop) ++uses[v];
  }
  for (Loop& loop : loops) std::erase_if(loop, [&](int v) { return uses[v] < 3; });
}

}  // namespace

template <typename Scalar>
std::optional<Polyhedron<Scalar>> make_polyhedron(std::span<const Vector3<Scalar>> vertices,
                                                  std::span<const std::vector<int>> loops, double tolerance) {
  std::vector<Eigen::Vector3d> points;
  for (const Vector3<Scalar>& v : vertices) points.push_back(v.template cast<double>());
  std::vector<Loop> faces(loops.begin(), loops.end());
  if (points.empty() || faces.size() < 4) return std::nullopt;
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3d& p : points) bounds.extend(p);
  tolerance *= bounds.sizes().maxCoeff();
  for (const Loop& loop : faces) {
    if (loop.size() < 3) return std::nullopt;
    for (int v : loop) {
      if (v < 0 || v >= static_cast<int>(points.size())) return std::nullopt;
    }
  }

  faces = merge_coplanar(faces, points, tolerance);
  drop_idle_vertices(faces, points.size());
  const DirectedEdges edges = edges_of(faces);
  if (faces.size() < 4 || edges.empty()) return std::nullopt;

  Polyhedron<Scalar> result;
  std::vector<int> place(points.size(), -1);
  for (const Loop& loop : faces) {
    if (loop.size() < 3 || loop.size() > kFaceVerticesMax) return std::nullopt;
    for (int v : loop) place[v] = 0;
  }
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (place[v] < 0) continue;
    place[v] = static_cast<int>(result.vertices.size());
    result.vertices.push_back(vertices[v]);
  }
  if (result.vertices.size() > kHullVerticesMax) return std::nullopt;

  double width_min = std::numeric_limits<double>::infinity();
  for (const Loop& loop : faces) {
    const Eigen::Vector3d normal = area_of(loop, points).normalized();
    double offset = -std::numeric_limits<double>::infinity();
    for (int v : loop) offset = std::max(offset, normal.dot(points[v]));
    double lowest = offset;
    for (std::size_t v = 0; v < points.size(); ++v) {
      if (place[v] < 0) continue;
      const double height = normal.dot(points[v]);
      if (height > offset + 4 * tolerance) return std::nullopt;  // not convex
      lowest = std::min(lowest, height);
    }
    width_min = std::min(width_min, offset - lowest);
    result.planes.push_back({normal.cast<Scalar>(), static_cast<Scalar>(offset)});
    result.faces.push_back(
        {static_cast<std::uint16_t>(result.corners.size()), static_cast<std::uint16_t>(loop.size())});
    for (int v : loop) result.corners.push_back(static_cast<std::uint16_t>(place[v]));
  }
  for (const auto& [edge, left] : edges) {
    const auto right = edges.find({edge.second, edge.first});
    if (right == edges.end()) return std::nullopt;  // not closed
    if (edge.first > edge.second) continue;
    result.edges.push_back({static_cast<std::uint16_t>(place[edge.first]),
                            static_cast<std::uint16_t>(place[edge.second]), static_cast<std::uint16_t>(left),
                            static_cast<std::uint16_t>(right->second)});
  }
  if (result.vertices.size() + result.faces.size() != result.edges.size() + 2) return std::nullopt;
  result.thickness = static_cast<Scalar>(width_min / 2);
  return result;
}

template <typename Scalar>
MeshTriangle<Scalar> make_triangle(const Vector3<Scalar>& v0, const Vector3<Scalar>& v1,
                                   const Vector3<Scalar>& v2) {
  MeshTriangle<Scalar> triangle;
  triangle.vertex[0] = v0;
  triangle.vertex[1] = v1;
  triangle.vertex[2] = v2;
  triangle.normal = (v1 - v0).cross(v2 - v0).normalized();
  for (int k = 0; k < 3; ++k) {
    triangle.neighbour_normal[k] = triangle.normal;
    triangle.has_neighbour[k] = false;
  }
  return triangle;
}

template <typename Scalar>
void set_neighbour(MeshTriangle<Scalar>& triangle, int edge, const Vector3<Scalar>& opposite) {
  const Vector3<Scalar>& tail = triangle.vertex[edge];
  const Vector3<Scalar>& head = triangle.vertex[(edge + 1) % 3];
  triangle.neighbour_normal[edge] = (opposite - tail).cross(head - tail).normalized();
  triangle.has_neighbour[edge] = true;
}

template std::optional<Polyhedron<float>> make_polyhedron(std::span<const Vector3<float>>,
                                                          std::span<const std::vector<int>>, double);
template std::optional<Polyhedron<double>> make_polyhedron(std::span<const Vector3<double>>,
                                                           std::span<const std::vector<int>>, double);
template MeshTriangle<float> make_triangle(const Vector3<float>&, const Vector3<float>&,
                                           const Vector3<float>&);
template MeshTriangle<double> make_triangle(const Vector3<double>&, const Vector3<double>&,
                                            const Vector3<double>&);
template void set_neighbour(MeshTriangle<float>&, int, const Vector3<float>&);
template void set_neighbour(MeshTriangle<double>&, int, const Vector3<double>&);

}  // namespace tessera::collision
