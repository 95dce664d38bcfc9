#include "lpss/collision/convex_hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <queue>
#include <utility>

namespace tessera::collision {
namespace {

__extension__ using Int128 = __int128;

constexpr int kBits = 38;

using GridPoint = std::array<std::int64_t, 3>;
using GridNormal = std::array<Int128, 3>;  // of numbers below 2^79

GridPoint minus(const GridPoint& p, const GridPoint& q) { return {p[0] - q[0], p[1] - q[1], p[2] - q[2]}; }

GridNormal cross(const GridPoint& p, const GridPoint& q) {
  const auto of = [&](std::size_t i, std::size_t j) { return Int128{p[i]} * q[j] - Int128{p[j]} * q[i]; };
  return {of(1, 2), of(2, 0), of(0, 1)};
}

// Below 2^122.
Int128 dot(const GridNormal& n, const GridPoint& p) { return n[0] * p[0] + n[1] * p[1] + n[2] * p[2]; }

double length(const GridNormal& n) {
  return Eigen::Vector3d(static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2]))
      .norm();
}

// A triangle of the hull.
struct GridFacet {
  std::array<int, 3> corner;
  std::array<int, 3> beyond;  // the facets across its edges; edge k goes from corner k to k + 1
  GridNormal normal;
  double scale = 0;          // of heights along the normal to m
  std::vector<int> outside;  // points above it that no other facet has
  int farthest = -1;         // of these
  double distance = 0;       // m, of that one
  bool is_alive = true;
};

Eigen::Vector3d closest_on_triangle(const std::array<Eigen::Vector3d, 3>& corner, const Eigen::Vector3d& p) {
  const Eigen::Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  Eigen::Vector3d best = p - normal * (normal.dot(p - corner[0]) / normal.squaredNorm());
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& tail = corner[k];
    const Eigen::Vector3d along = corner[(k + 1) % 3] - tail;
    if (along.cross(normal).dot(p - tail) <= 0) continue;
    const double share = std::clamp(along.dot(p - tail) / along.squaredNorm(), 0., 1.);
    const Eigen::Vector3d candidate = tail + share * along;
    if (const double square = (p - candidate).squaredNorm(); square < least) {
      least = square;
      best = candidate;
    }
  }
  return best;
}

class HullBuilder {
 public:
  HullBuilder(std::span<const Eigen::Vector3d> points, const HullDetail& detail)
      : points_(points), detail_(detail) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : points) box.extend(p);
    if (box.isEmpty() || !(box.sizes().maxCoeff() > 0)) return;
    int exponent = 0;
    std::frexp(box.sizes().maxCoeff(), &exponent);
    spacing_ = std::ldexp(1., exponent - kBits);
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d at = (p - box.min()) / spacing_;
      grid_.push_back({std::llrint(at.x()), std::llrint(at.y()), std::llrint(at.z())});
    }
    begins_with_.resize(points.size());
  }

  HullTriangles build() {
    if (grid_.empty() || !begin()) return {};
    double error = 0;
    for (std::size_t vertices = 4; !queue_.empty();) {
      const auto [distance, negative] = queue_.top();
      const int f = -negative;
      if (!facet(f).is_alive) {
        queue_.pop();
        continue;
      }
      error = distance;
      if (distance <= detail_.tolerance || vertices == detail_.vertices_max) break;
      queue_.pop();
      add(facet(f).farthest, f);
      error = 0;
      ++vertices;
    }
    return result(error);
  }

 private:
  GridFacet& facet(int n) { return facets_[static_cast<std::size_t>(n)]; }
  const GridPoint& grid(int n) const { return grid_[static_cast<std::size_t>(n)]; }
  const Eigen::Vector3d& point(int n) const { return points_[static_cast<std::size_t>(n)]; }

  Int128 height(const GridFacet& of, int p) const {
    return dot(of.normal, minus(grid(p), grid(of.corner[0])));
  }

  template <typename Measure>
  int farthest_by(const Measure& measure) const {
    int best = 0;
    double most = -1;
    for (int n = 0; n < static_cast<int>(grid_.size()); ++n) {
      const double value = measure(n);
      if (value <= most) continue;
      most = value;
      best = n;
    }
    return best;
  }

  // With four points that are far from each other, and not in a plane.
  bool begin() {
    const int a = static_cast<int>(std::min_element(grid_.begin(), grid_.end()) - grid_.begin());
    int b = farthest_by([&](int n) { return (point(n) - point(a)).squaredNorm(); });
    const GridPoint along = minus(grid(b), grid(a));
    int c = farthest_by([&](int n) { return length(cross(along, minus(grid(n), grid(a)))); });
    const GridNormal normal = cross(along, minus(grid(c), grid(a)));
    const auto above = [&](int n) { return dot(normal, minus(grid(n), grid(a))); };
    const int d = farthest_by([&](int n) { return std::abs(static_cast<double>(above(n))); });
    if (above(d) == 0) return false;
    if (above(d) > 0) std::swap(b, c);
    make_facet({a, b, c}, {1, 2, 3});
    make_facet({a, d, b}, {3, 2, 0});
    make_facet({b, d, c}, {1, 3, 0});
    make_facet({c, d, a}, {2, 1, 0});
    std::vector<int> all;
    for (int n = 0; n < static_cast<int>(grid_.size()); ++n) all.push_back(n);
    give_out(all, 0);
    return true;
  }

  void make_facet(const std::array<int, 3>& corner, const std::array<int, 3>& beyond) {
    GridFacet& made = facets_.emplace_back();
    made.corner = corner;
    made.beyond = beyond;
    made.normal = cross(minus(grid(corner[1]), grid(corner[0])), minus(grid(corner[2]), grid(corner[0])));
    made.scale = spacing_ / length(made.normal);
    seen_.push_back(0);
  }

  // Gives each of the points that are outside to one of the facets from `first` on.
  void give_out(std::span<const int> points, std::size_t first) {
    for (const int p : points) {
      int best = -1;
      double most = kNoise * spacing_;
      for (std::size_t f = first; f < facets_.size(); ++f) {
        const double above = static_cast<double>(height(facets_[f], p)) * facets_[f].scale;
        if (above <= most) continue;
        most = above;
        best = static_cast<int>(f);
      }
      if (best < 0) continue;
      const double distance = detail_.tolerance > 0 ? distance_from(p, best) : most;
      GridFacet& owner = facet(best);
      owner.outside.push_back(p);
      if (distance <= owner.distance) continue;
      owner.distance = distance;
      owner.farthest = p;
    }
    for (std::size_t f = first; f < facets_.size(); ++f) {
      if (facets_[f].farthest >= 0) queue_.emplace(facets_[f].distance, -static_cast<int>(f));
    }
  }

  // The facets that can be seen from a point above one of them.
  const std::vector<int>& seen_from(int p, int from) {
    ++stamp_;
    visible_.assign(1, from);
    seen_[static_cast<std::size_t>(from)] = stamp_;
    for (std::size_t n = 0; n < visible_.size(); ++n) {
      for (const int beyond : std::array(facet(visible_[n]).beyond)) {
        if (is_seen(beyond) || height(facet(beyond), p) <= 0) continue;
        seen_[static_cast<std::size_t>(beyond)] = stamp_;
        visible_.push_back(beyond);
      }
    }
    return visible_;
  }
  bool is_seen(int f) const { return seen_[static_cast<std::size_t>(f)] == stamp_; }

  // m, of a point above a facet from the hull: what is closest can be seen from it.
  double distance_from(int p, int above) {
    double least = std::numeric_limits<double>::infinity();
    for (const int f : seen_from(p, above)) {
      const std::array<int, 3>& corner = facet(f).corner;
      const Eigen::Vector3d on_hull =
          closest_on_triangle({point(corner[0]), point(corner[1]), point(corner[2])}, point(p));
      least = std::min(least, (point(p) - on_hull).squaredNorm());
    }
    return std::sqrt(least);
  }

  // A point above a facet becomes a vertex: facets from it to the horizon replace those that it sees.
  void add(int p, int from) {
    const std::size_t first = facets_.size();
    std::vector<int> points;
    for (const int f : seen_from(p, from)) {
      facet(f).is_alive = false;
      std::vector<int> outside = std::move(facet(f).outside);
      for (const int q : outside) {
        if (q != p) points.push_back(q);
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const int beyond = facet(f).beyond[k];
        if (is_seen(beyond)) continue;
        const int tail = facet(f).corner[k];
        const int head = facet(f).corner[(k + 1) % 3];
        std::array<int, 3>& back = facet(beyond).beyond;
        const int made = static_cast<int>(facets_.size());
        *std::find(back.begin(), back.end(), f) = made;
        begins_with_[static_cast<std::size_t>(tail)] = made;
        make_facet({tail, head, p}, {beyond, -1, -1});
      }
    }
    for (std::size_t f = first; f < facets_.size(); ++f) {
      const int next = begins_with_[static_cast<std::size_t>(facets_[f].corner[1])];
      facets_[f].beyond[1] = next;
      facet(next).beyond[2] = static_cast<int>(f);
    }
    give_out(points, first);
  }

  HullTriangles result(double error) const {
    HullTriangles hull;
    hull.error = error;
    std::vector<int> places(points_.size(), -1);
    for (const GridFacet& f : facets_) {
      if (!f.is_alive) continue;
      for (const int corner : f.corner) places[static_cast<std::size_t>(corner)] = 0;
    }
    for (std::size_t n = 0; n < points_.size(); ++n) {
      if (places[n] < 0) continue;
      places[n] = static_cast<int>(hull.vertices.size());
      hull.vertices.push_back(points_[n]);
    }
    for (const GridFacet& f : facets_) {
      if (!f.is_alive) continue;
      std::vector<int>& triangle = hull.triangles.emplace_back();
      for (const int corner : f.corner) triangle.push_back(places[static_cast<std::size_t>(corner)]);
      hull.is_repeated.push_back(is_repeated(f));
    }
    return hull;
  }

  bool is_repeated(const GridFacet& f) const {
    return std::any_of(f.beyond.begin(), f.beyond.end(), [&](int beyond) {
      const GridFacet& other = facets_[static_cast<std::size_t>(beyond)];
      // The scale is the smaller, the larger the facet.
      if (std::pair(other.scale, &other) >= std::pair(f.scale, &f)) return false;
      return std::all_of(f.corner.begin(), f.corner.end(), [&](int corner) {
        return static_cast<double>(-height(other, corner)) * other.scale <= kNoise * spacing_;
      });
    });
  }

  static constexpr double kNoise = 4;  // of the grid's spacing: points of a plane are so far off it

  std::span<const Eigen::Vector3d> points_;
  HullDetail detail_;
  double spacing_ = 0;  // m, of the grid
  std::vector<GridPoint> grid_;
  std::vector<GridFacet> facets_;                      // also those that are no more
  std::priority_queue<std::pair<double, int>> queue_;  // facets with points outside: distance, -place
  std::vector<std::uint32_t> seen_;                    // by facet: the last look that saw it
  std::uint32_t stamp_ = 0;
  std::vector<int> visible_;
  std::vector<int> begins_with_;  // by vertex of the horizon: the new facet whose edge there begins with it
};

}  // namespace

HullTriangles convex_hull(std::span<const Eigen::Vector3d> points, const HullDetail& detail) {
  return HullBuilder(points, detail).build();
}

std::vector<HalfSpace<double>> planes_of(const HullTriangles& hull) {
  // Of the length of a triangle, its width: narrower ones are rounding, and have no normal of their own ...
  constexpr double kWidthMin = 1e-9;
  // ... and the normals of these are too coarse to say what is level with them.
  constexpr double kNarrow = 1e-4;
  std::vector<HalfSpace<double>> planes;
  for (std::size_t n = 0; n < hull.triangles.size(); ++n) {
    if (hull.is_repeated[n]) continue;
    const auto corner = [&](std::size_t k) {
      return hull.vertices[static_cast<std::size_t>(hull.triangles[n][k % 3])];
    };
    const Eigen::Vector3d area = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (corner(k + 1) - corner(k)).squaredNorm());
    const double size = area.norm();
    if (!(size > kWidthMin * longest)) continue;
    const Eigen::Vector3d normal = area / size;
    double offset = normal.dot(corner(0));
    if (size < kNarrow * longest) {
      for (const Eigen::Vector3d& vertex : hull.vertices) offset = std::max(offset, normal.dot(vertex));
    }
    planes.push_back({normal, offset});
  }
  return planes;
}

}  // namespace tessera::collision
