#include "lpss/bullet/triangle_edges.h"

#include <absl/container/flat_hash_map.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace tessera::bullet {
namespace {

constexpr double kWeld = 1e-4;      // m
constexpr double kAreaMin = 1e-10;  // m^2, twice the area

// Gives vertices that are close to each other the same number.
class Welder {
 public:
  explicit Welder(std::size_t vertices) {
    cells_.reserve(vertices);
    corners_.reserve(vertices);
  }

  std::uint32_t number_of(const Eigen::Vector3d& vertex) {
    const Cell low = cell_of(vertex.array() - kWeld);
    const Cell high = cell_of(vertex.array() + kWeld);
    for (std::int64_t i = low[0]; i <= high[0]; ++i) {
      for (std::int64_t j = low[1]; j <= high[1]; ++j) {
        for (std::int64_t k = low[2]; k <= high[2]; ++k) {
          const auto first = cells_.find(Cell{i, j, k});
          if (first == cells_.end()) continue;
          for (std::uint32_t number = first->second; number != kNone; number = corners_[number].next) {
            if ((corners_[number].place - vertex).norm() <= kWeld) return number;
          }
        }
      }
    }
    return add(vertex);
  }

  std::size_t count() const { return corners_.size(); }

 private:
  using Cell = std::array<std::int64_t, 3>;
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  struct Corner {
    Eigen::Vector3d place;
    std::uint32_t next;  // in its cell
  };

  static Cell cell_of(const Eigen::Array3d& vertex) {
    const Eigen::Array3d cell = (vertex / (16 * kWeld)).floor();
    return {static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
            static_cast<std::int64_t>(cell.z())};
  }

  std::uint32_t add(const Eigen::Vector3d& vertex) {
    const auto number = static_cast<std::uint32_t>(corners_.size());
    corners_.push_back({vertex, kNone});
    const auto [first, is_new] = cells_.try_emplace(cell_of(vertex), number);
    if (is_new) return number;
    std::uint32_t last = first->second;
    while (corners_[last].next != kNone) last = corners_[last].next;
    corners_[last].next = number;
    return number;
  }

  absl::flat_hash_map<Cell, std::uint32_t> cells_;  // the first corner in each
  std::vector<Corner> corners_;
};

// An edge of a triangle at its corner with the lower number.
struct CornerPair {
  std::uint32_t high;  // the number of its other corner
  std::int32_t triangle;
  std::int8_t n;
  bool is_forward;  // from low to high

  friend bool operator<(const CornerPair& a, const CornerPair& b) {
    return std::tie(a.high, a.triangle, a.n) < std::tie(b.high, b.triangle, b.n);
  }
};

}  // namespace

void TriangleEdges::reserve(std::size_t vertices, std::size_t triangles) {
  vertices_.reserve(vertices);
  vertices_of_.reserve(triangles);
  triangles_.reserve(triangles);
}

std::uint32_t TriangleEdges::add(const Eigen::Vector3d& vertex) {
  vertices_.push_back(vertex);
  return static_cast<std::uint32_t>(vertices_.size() - 1);
}

void TriangleEdges::add(std::uint64_t key, const Vertices& vertices) {
  const Eigen::Vector3d& corner = vertices_[vertices[0]];
  const Eigen::Vector3d area = (vertices_[vertices[1]] - corner).cross(vertices_[vertices[2]] - corner);
  const double size = area.norm();
  const Eigen::Vector3d normal = size > kAreaMin ? Eigen::Vector3d(area / size) : Eigen::Vector3d::Zero();
  triangles_.push_back({key, normal});
  vertices_of_.push_back(vertices);
}

void TriangleEdges::add(std::uint64_t key, const Corners& corners) {
  Vertices vertices;
  for (int n = 0; n < 3; ++n) vertices[n] = add(corners[n]);
  add(key, vertices);
}

void TriangleEdges::sort_by_keys() {
  const auto by_key = [](const Triangle& a, const Triangle& b) { return a.key < b.key; };
  if (std::is_sorted(triangles_.begin(), triangles_.end(), by_key)) return;
  std::vector<std::size_t> order(triangles_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return triangles_[a].key < triangles_[b].key; });
  std::vector<Vertices> vertices;
  vertices.reserve(order.size());
  for (const std::size_t place : order) vertices.push_back(vertices_of_[place]);
  vertices_of_ = std::move(vertices);
  std::stable_sort(triangles_.begin(), triangles_.end(), by_key);
}

void TriangleEdges::connect() {
  sort_by_keys();
  Welder welder(vertices_.size());
  std::vector<std::uint32_t> number;
  number.reserve(vertices_.size());
  for (const Eigen::Vector3d& vertex : vertices_) number.push_back(welder.number_of(vertex));

  // Calls visit(low, pair) for all edges.
  const auto for_each_edge = [&](const auto& visit) {
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if (triangles_[t].normal.isZero(0)) continue;
      for (int n = 0; n < 3; ++n) {
        const std::uint32_t from = number[vertices_of_[t][n]];
        const std::uint32_t to = number[vertices_of_[t][(n + 1) % 3]];
        visit(std::min(from, to), CornerPair{std::max(from, to), static_cast<std::int32_t>(t),
                                             static_cast<std::int8_t>(n), from < to});
      }
    }
  };
  std::vector<std::size_t> end(welder.count() + 1,
                               0);  // by low corner; while they are filled, the next place
  for_each_edge([&](std::uint32_t low, const CornerPair&) { ++end[low + 1]; });
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<CornerPair> edges(end.back());
  for_each_edge([&](std::uint32_t low, const CornerPair& edge) { edges[end[low]++] = edge; });

  auto first = edges.begin();
  for (std::size_t low = 0; low < welder.count(); ++low) {
    const auto last = edges.begin() + static_cast<std::ptrdiff_t>(end[low]);
    std::sort(first, last);
    while (first != last) {
      const auto next =
          std::find_if(first, last, [&](const CornerPair& edge) { return edge.high != first->high; });
      if (next - first == 2) {
        const CornerPair& a = first[0];
        const CornerPair& b = first[1];
        const bool is_reversed = a.is_forward == b.is_forward;
        triangles_[a.triangle].beyond[a.n] = b.triangle;
        triangles_[b.triangle].beyond[b.n] = a.triangle;
        triangles_[a.triangle].is_reversed[a.n] = triangles_[b.triangle].is_reversed[b.n] = is_reversed;
      }
      first = next;
    }
  }
  vertices_ = {};
  vertices_of_ = {};
}

const TriangleEdges::Triangle* TriangleEdges::find(std::uint64_t key) const {
  if (key < triangles_.size() && triangles_[key].key == key) return &triangles_[key];
  const auto place = std::lower_bound(triangles_.begin(), triangles_.end(), key,
                                      [](const Triangle& t, std::uint64_t wanted) { return t.key < wanted; });
  return place != triangles_.end() && place->key == key ? &*place : nullptr;
}

std::optional<TriangleEdges::Neighbour> TriangleEdges::beyond(std::uint64_t key, int n) const {
  const Triangle* triangle = find(key);
  if (triangle == nullptr || triangle->beyond[n] < 0) return std::nullopt;
  return Neighbour{triangles_[triangle->beyond[n]].key, triangle->is_reversed[n]};
}

std::optional<Eigen::Vector3d> TriangleEdges::across(std::uint64_t key, int n) const {
  const Triangle* triangle = find(key);
  if (triangle == nullptr || triangle->beyond[n] < 0) return std::nullopt;
  const Eigen::Vector3d& normal = triangles_[triangle->beyond[n]].normal;
  return triangle->is_reversed[n] ? Eigen::Vector3d(-normal) : normal;
}

}  // namespace tessera::bullet
