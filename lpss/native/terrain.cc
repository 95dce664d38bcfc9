#include "lpss/native/terrain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "lpss/bullet/triangle_edges.h"

namespace tessera::native {
namespace {

// The front is where the corners are seen counter-clockwise.
Vector normal_of(const Vector& p, const Vector& q, const Vector& r) {
  const Vector normal = (q - p).cross(r - p);
  const Scalar length = normal.norm();
  return length > 0 ? Vector(normal / length) : Vector(Vector::UnitZ());
}

class Mesh final : public Terrain {
 public:
  Mesh(const TriangleMesh& mesh, const btQuantizedBvh& tree) : tree_(tree), names_(mesh.names) {
    vertices_.reserve(mesh.vertices.size());
    edges_.reserve(mesh.vertices.size(), mesh.indices.size() / 3);
    for (const Eigen::Vector3d& vertex : mesh.vertices) {
      vertices_.push_back(vertex.cast<Scalar>());
      edges_.add(vertices_.back().cast<double>());
    }
    triangles_.reserve(mesh.indices.size() / 3);
    for (std::size_t n = 0; n + 2 < mesh.indices.size(); n += 3) {
      triangles_.push_back({mesh.indices[n], mesh.indices[n + 1], mesh.indices[n + 2]});
    }
    normals_.reserve(triangles_.size());
    for (std::uint32_t n = 0; n < triangles_.size(); ++n) {
      edges_.add(n, triangles_[n]);
      const std::array<Vector, 3> corners = corners_of(n);
      normals_.push_back(normal_of(corners[0], corners[1], corners[2]));
    }
    edges_.connect();
  }

  void near(const Bounds& bounds, List& found) const override {
    struct Collector final : btNodeOverlapCallback {
      void processNode(int, int triangle) override {
        indices.push_back(static_cast<std::uint32_t>(triangle));
      }
      absl::InlinedVector<std::uint32_t, 32> indices;
    } collector;
    tree_.reportAabbOverlappingNodex(&collector, bt(bounds.low), bt(bounds.high));
    std::sort(collector.indices.begin(), collector.indices.end());
    for (const std::uint32_t index : collector.indices) {
      const std::array<Vector, 3> corners = corners_of(index);
      const Bounds its{corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]),
                       corners[0].cwiseMax(corners[1]).cwiseMax(corners[2])};
      if (its.overlaps(bounds)) found.push_back({names_.empty() ? index : names_[index], triangle(index)});
    }
  }

 private:
  std::array<Vector, 3> corners_of(std::uint32_t index) const {
    const bullet::TriangleEdges::Vertices& t = triangles_[index];
    return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
  }

  MeshTriangle<Scalar> triangle(std::uint32_t index) const {
    MeshTriangle<Scalar> result;
    if (!names_.empty()) result.kept_on = collision::KeptOn::kFront;  // ground is solid
    const std::array<Vector, 3> corners = corners_of(index);
    result.normal = normals_[index];
    for (std::size_t n = 0; n < 3; ++n) {
      result.vertex[n] = corners[n];
      const auto neighbour = edges_.beyond(index, static_cast<int>(n));
      result.has_neighbour[n] = neighbour.has_value();
      if (!neighbour) continue;
      const Vector& normal = normals_[neighbour->key];
      result.neighbour_normal[n] = neighbour->is_reversed ? Vector(-normal) : normal;
    }
    return result;
  }

  const btQuantizedBvh& tree_;
  std::vector<Vector> vertices_;
  std::vector<bullet::TriangleEdges::Vertices> triangles_;
  std::vector<Vector> normals_;
  std::vector<std::uint32_t> names_;  // of ground
  bullet::TriangleEdges edges_;
};

// Each cell of the grid has two triangles, parted by the diagonal from its high-x to its high-y corner.
class Heights final : public Terrain {
 public:
  explicit Heights(const HeightField& field)
      : columns_(static_cast<std::int64_t>(field.columns)),
        rows_(static_cast<std::int64_t>(field.rows)),
        spacing_x_(Scalar(field.spacing.x())),
        spacing_y_(Scalar(field.spacing.y())),
        heights_(field.heights.begin(), field.heights.end()) {}

  void near(const Bounds& bounds, List& found) const override {
    const auto first = [](Scalar low, Scalar spacing, std::int64_t count) {
      const Scalar cell = std::floor(low / spacing + Scalar(count - 1) / 2);
      return static_cast<std::int64_t>(std::clamp(cell, Scalar(0), Scalar(count - 1)));
    };
    const std::int64_t column_end = first(bounds.high.x(), spacing_x_, columns_);
    const std::int64_t row_end = first(bounds.high.y(), spacing_y_, rows_);
    for (std::int64_t row = first(bounds.low.y(), spacing_y_, rows_); row <= row_end; ++row) {
      for (std::int64_t column = first(bounds.low.x(), spacing_x_, columns_); column <= column_end;
           ++column) {
        if (column + 1 >= columns_ || row + 1 >= rows_) continue;
        for (int half = 0; half < 2; ++half) {
          const std::array<Vector, 3> corners = corners_of(column, row, half);
          const Scalar low = std::min({corners[0].z(), corners[1].z(), corners[2].z()});
          const Scalar high = std::max({corners[0].z(), corners[1].z(), corners[2].z()});
          if (low > bounds.high.z() || high < bounds.low.z()) continue;
          found.push_back({static_cast<std::uint32_t>(2 * (row * (columns_ - 1) + column) + half),
                           triangle(column, row, half)});
        }
      }
    }
  }

 private:
  Vector at(std::int64_t column, std::int64_t row) const {
    return {(Scalar(column) - Scalar(columns_ - 1) / 2) * spacing_x_,
            (Scalar(row) - Scalar(rows_ - 1) / 2) * spacing_y_,
            heights_[static_cast<std::size_t>(row * columns_ + column)]};
  }

  std::array<Vector, 3> corners_of(std::int64_t column, std::int64_t row, int half) const {
    if (half == 0) return {at(column, row), at(column + 1, row), at(column, row + 1)};
    return {at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)};
  }

  MeshTriangle<Scalar> triangle(std::int64_t column, std::int64_t row, int half) const {
    MeshTriangle<Scalar> result;
    result.kept_on = collision::KeptOn::kFront;  // the ground is solid
    const std::array<Vector, 3> corners = corners_of(column, row, half);
    result.normal = normal_of(corners[0], corners[1], corners[2]);
    const auto set = [&](std::size_t side, std::int64_t c, std::int64_t r, int h) {
      result.has_neighbour[side] = c >= 0 && r >= 0 && c + 1 < columns_ && r + 1 < rows_;
      if (!result.has_neighbour[side]) return;
      const std::array<Vector, 3> others = corners_of(c, r, h);
      result.neighbour_normal[side] = normal_of(others[0], others[1], others[2]);
    };
    for (std::size_t n = 0; n < 3; ++n) result.vertex[n] = corners[n];
    if (half == 0) {
      set(0, column, row - 1, 1);
      set(1, column, row, 1);
      set(2, column - 1, row, 1);
    } else {
      set(0, column + 1, row, 0);
      set(1, column, row + 1, 0);
      set(2, column, row, 0);
    }
    return result;
  }

  std::int64_t columns_;
  std::int64_t rows_;
  Scalar spacing_x_;
  Scalar spacing_y_;
  std::vector<Scalar> heights_;
};

}  // namespace

std::unique_ptr<Terrain> make_terrain(const TriangleMesh& mesh, const btQuantizedBvh& tree) {
  return std::make_unique<Mesh>(mesh, tree);
}

std::unique_ptr<Terrain> make_terrain(const HeightField& field) { return std::make_unique<Heights>(field); }

}  // namespace tessera::native
