#include "lpss/bullet/triangle_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

namespace tessera::bullet {
namespace {

constexpr double kWeld = 1e-4;      // m
constexpr double kAreaMin = 1e-10;  // m^2, twice the area

// Gives corners that are close to each other the same number.
class Welder {
 public:
  std::uint32_t number_of(const Eigen::Vector3d& corner) {
    const Cell low = cell_of(corner.array() - kWeld);
    const Cell high = cell_of(corner.array() + kWeld);
    for (std::int64_t i = low[0]; i <= high[0]; ++i) {
      for (std::int64_t j = low[1]; j <= high[1]; ++j) {
        for (std::int64_t k = low[2]; k <= high[2]; ++k) {
          const auto found = cells_.find(Cell{i, j, k});
          if (found == cells_.end()) continue;
          for (const std::uint32_t number : found->second) {
            if ((corners_[number] - corner).norm() <= kWeld) return number;
          }
        }
      }
    }
    const auto number = static_cast<std::uint32_t>(corners_.size());
    corners_.push_back(corner);
    cells_[cell_of(corner)].push_back(number);
    return number;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;

  static Cell cell_of(const Eigen::Array3d& corner) {
    const Eigen::Array3d cell = (corner / (16 * kWeld)).floor();
    return {static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
            static_cast<std::int64_t>(cell.z())};
  }

  absl::flat_hash_map<Cell, std::vector<std::uint32_t>> cells_;
  std::vector<Eigen::Vector3d> corners_;
};

struct CornerPair {
  std::uint32_t low;  // corner numbers
  std::uint32_t high;
  std::int32_t triangle;
  int n;
  bool is_forward;  // from low to high

  bool joins_as(const CornerPair& other) const { return low == other.low && high == other.high; }
};

}  // namespace

void TriangleEdges::add(std::uint64_t key, const Corners& corners) {
  const Eigen::Vector3d area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  if (!(area.norm() > kAreaMin)) return;
  places_[key] = static_cast<std::int32_t>(triangles_.size());
  triangles_.push_back({key, corners, area.normalized()});
}

void TriangleEdges::connect() {
  Welder welder;
  std::vector<CornerPair> edges;
  edges.reserve(3 * triangles_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    std::array<std::uint32_t, 3> numbers;
    for (int n = 0; n < 3; ++n) numbers[n] = welder.number_of(triangles_[t].corners[n]);
    for (int n = 0; n < 3; ++n) {
      const std::uint32_t from = numbers[n];
      const std::uint32_t to = numbers[(n + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), static_cast<std::int32_t>(t), n, from < to});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const CornerPair& a, const CornerPair& b) {
    return std::tie(a.low, a.high, a.triangle, a.n) < std::tie(b.low, b.high, b.triangle, b.n);
  });
  for (auto first = edges.begin(); first != edges.end();) {
    const auto end =
        std::find_if(first, edges.end(), [&](const CornerPair& edge) { return !edge.joins_as(*first); });
    if (end - first == 2) {
      const CornerPair& a = first[0];
      const CornerPair& b = first[1];
      const bool is_reversed = a.is_forward == b.is_forward;
      triangles_[a.triangle].beyond[a.n] = b.triangle;
      triangles_[b.triangle].beyond[b.n] = a.triangle;
      triangles_[a.triangle].is_reversed[a.n] = triangles_[b.triangle].is_reversed[b.n] = is_reversed;
    }
    first = end;
  }
}

std::optional<TriangleEdges::Neighbour> TriangleEdges::beyond(std::uint64_t key, int n) const {
  const auto place = places_.find(key);
  if (place == places_.end()) return std::nullopt;
  const Triangle& triangle = triangles_[place->second];
  if (triangle.beyond[n] < 0) return std::nullopt;
  return Neighbour{triangles_[triangle.beyond[n]].key, triangle.is_reversed[n]};
}

std::optional<Eigen::Vector3d> TriangleEdges::across(std::uint64_t key, int n) const {
  const std::optional<Neighbour> neighbour = beyond(key, n);
  if (!neighbour) return std::nullopt;
  const Eigen::Vector3d& normal = triangles_[places_.at(neighbour->key)].normal;
  return neighbour->is_reversed ? Eigen::Vector3d(-normal) : normal;
}

}  // namespace tessera::bullet
