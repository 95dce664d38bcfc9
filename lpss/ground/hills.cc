// Hills over a plain and over a planet, by arithmetic that has the same bits everywhere.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "lpss/base/portable_math.h"
#include "lpss/grid/sector_map.h"
#include "lpss/ground/tile.h"
#include "lpss/model/limits.h"

namespace tessera {
namespace {

constexpr std::int64_t kTileCells = 16;  // along an edge

std::uint64_t mixed(std::uint64_t seed, std::int64_t i, std::int64_t j, std::int64_t k) {
  std::uint64_t x = seed;
  for (const std::int64_t part : {i, j, k}) x = scrambled(x + static_cast<std::uint64_t>(part));
  return x;
}

// Value noise: random numbers of -1 to 1 at whole coordinates, smoothly joined.
double noise(const Eigen::Vector3d& at, std::uint64_t seed) {
  std::array<std::int64_t, 3> low{};
  std::array<double, 3> weight{};
  for (int axis = 0; axis < 3; ++axis) {
    const double floor = std::floor(at[axis]);
    const double f = at[axis] - floor;
    low[axis] = static_cast<std::int64_t>(floor);
    weight[axis] = f * f * (3 - 2 * f);
  }
  const auto value = [&](int i, int j, int k) {
    const std::uint64_t bits = mixed(seed, low[0] + i, low[1] + j, low[2] + k);
    return static_cast<double>(bits >> 11) * 0x1p-52 - 1;
  };
  const auto join = [](double a, double b, double w) { return a + (b - a) * w; };
  const auto along_x = [&](int j, int k) { return join(value(0, j, k), value(1, j, k), weight[0]); };
  const auto along_y = [&](int k) { return join(along_x(0, k), along_x(1, k), weight[1]); };
  // On a plain, all is at z = 0.
  return weight[2] == 0 ? along_y(0) : join(along_y(0), along_y(1), weight[2]);
}

class Hills : public TileSource {
 public:
  explicit Hills(const Ground& ground) : ground_(ground) {}

 protected:
  // m, above 0, at a point of the surface without hills.
  double height_at(const Eigen::Vector3d& at) const {
    double sum = 0;
    double height = ground_.height / 2;
    double wavelength = ground_.wavelength / 2;  // of the lattice: a hill and a valley are a wave
    for (std::uint32_t octave = 0; octave < ground_.octaves; ++octave) {
      sum += height * noise(at / wavelength, ground_.seed + octave);
      height /= 2;
      wavelength /= 2;
    }
    return ground_.has_sea ? std::max(sum, 0.0) : sum;
  }

  double low() const { return ground_.has_sea ? 0 : -ground_.height; }
  double high() const { return ground_.height; }
  const Ground& ground() const { return ground_; }

  // A grid of vertices, each of which `vertex(column, row)` makes.
  template <typename Vertex>
  static Tile grid(const TileKey& key, bool is_mirrored, const Vertex& vertex) {
    Tile tile;
    constexpr std::uint32_t kSide = kTileCells + 1;
    tile.vertices.reserve(std::size_t{kSide} * kSide);
    for (std::int64_t row = 0; row <= kTileCells; ++row) {
      for (std::int64_t column = 0; column <= kTileCells; ++column)
        tile.vertices.push_back(vertex(key.i * kTileCells + column, key.j * kTileCells + row));
    }
    tile.triangles.reserve(std::size_t{2} * kTileCells * kTileCells);
    for (std::uint32_t row = 0; row < kTileCells; ++row) {
      for (std::uint32_t column = 0; column < kTileCells; ++column) {
        const std::uint32_t corner = row * kSide + column;
        std::array<std::uint32_t, 3> first{corner, corner + 1, corner + kSide};
        std::array<std::uint32_t, 3> second{corner + 1, corner + kSide + 1, corner + kSide};
        for (std::array<std::uint32_t, 3>* triangle : {&first, &second}) {
          if (is_mirrored) std::swap((*triangle)[1], (*triangle)[2]);
          tile.triangles.push_back(*triangle);
        }
      }
    }
    tile.name = static_cast<std::uint32_t>(mixed(0, key.face, key.i, key.j));
    return tile;
  }

 private:
  Ground ground_;
};

class Plain final : public Hills {
 public:
  explicit Plain(const Ground& ground) : Hills(ground) {}

  std::vector<TileKey> overlapping(const Eigen::AlignedBox3d& box) const override {
    if (box.min().z() > high() || box.max().z() < low()) return {};
    const double edge = kTileCells * ground().spacing;
    const double last = std::floor(kGroundReach / edge) - 1;
    const auto tile_at = [&](double x) {
      return static_cast<std::int64_t>(std::clamp(std::floor(x / edge), -last, last));
    };
    std::vector<TileKey> keys;
    if (box.min().head<2>().maxCoeff() > kGroundReach || box.max().head<2>().minCoeff() < -kGroundReach)
      return keys;
    for (std::int64_t i = tile_at(box.min().x()); i <= tile_at(box.max().x()); ++i) {
      for (std::int64_t j = tile_at(box.min().y()); j <= tile_at(box.max().y()); ++j)
        keys.push_back({0, i, j});
    }
    return keys;
  }

  absl::StatusOr<Tile> make(const TileKey& key) const override {
    return grid(key, /*is_mirrored=*/false, [&](std::int64_t i, std::int64_t j) {
      Eigen::Vector3d at(static_cast<double>(i) * ground().spacing, static_cast<double>(j) * ground().spacing,
                         0);
      at.z() = height_at(at);
      return at;
    });
  }
};

// A cube around the ball, each of its faces a grid of lines at equal angles. Face 2 n looks along axis n,
// face 2 n + 1 against it; i and j count along the next two axes.
class Planet final : public Hills {
 public:
  explicit Planet(const Ground& ground) : Hills(ground) {
    const double cells = std::numbers::pi / 2 * ground.radius / ground.spacing;
    tiles_ = std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(cells / kTileCells)));
  }

  std::vector<TileKey> overlapping(const Eigen::AlignedBox3d& box) const override {
    std::vector<TileKey> keys;
    const Eigen::Vector3d centre = box.center();
    const double reach = box.sizes().norm() / 2;
    const double nearest = box.exteriorDistance(Eigen::Vector3d::Zero().eval());
    const double farthest = box.max().cwiseAbs().cwiseMax(box.min().cwiseAbs()).norm();
    if (nearest > ground().radius + high() || farthest < lowest()) return keys;
    for (std::int32_t face = 0; face < 6; ++face) {
      // A point of the face is at least so much of its distance from the centre along the face's axis.
      constexpr double kLeast = 0.577;
      const Axes axes(face);
      const double along = axes.sign * centre[axes.normal];
      if (along + reach < nearest * kLeast) continue;
      Range i{0, tiles_ - 1};
      Range j = i;
      if (along > reach) {
        i = range(box, axes, axes.i);
        j = range(box, axes, axes.j);
      }
      for (std::int64_t tile_i = i.first; tile_i <= i.last; ++tile_i) {
        for (std::int64_t tile_j = j.first; tile_j <= j.last; ++tile_j)
          keys.push_back({face, tile_i, tile_j});
      }
    }
    return keys;
  }

  absl::StatusOr<Tile> make(const TileKey& key) const override {
    const Axes axes(key.face);
    std::array<double, kTileCells + 1> across{};
    std::array<double, kTileCells + 1> along{};
    for (std::int64_t n = 0; n <= kTileCells; ++n) {
      across[n] = line(key.i * kTileCells + n);
      along[n] = line(key.j * kTileCells + n);
    }
    return grid(key, axes.sign < 0, [&](std::int64_t i, std::int64_t j) {
      Eigen::Vector3d on_cube;
      on_cube[axes.normal] = axes.sign;
      on_cube[axes.i] = across[i - key.i * kTileCells];
      on_cube[axes.j] = along[j - key.j * kTileCells];
      // In the order of the axes, so that a vertex that faces share is the same bits on all of them.
      const double norm =
          std::sqrt(on_cube.x() * on_cube.x() + on_cube.y() * on_cube.y() + on_cube.z() * on_cube.z());
      const Eigen::Vector3d up = on_cube / norm;
      return Eigen::Vector3d(up * (ground().radius + height_at(up * ground().radius)));
    });
  }

 private:
  struct Axes {
    explicit Axes(std::int32_t face)
        : normal(face / 2), i((normal + 1) % 3), j((normal + 2) % 3), sign(face % 2 == 0 ? 1 : -1) {}
    int normal;
    int i;
    int j;
    double sign;
  };
  struct Range {
    std::int64_t first;
    std::int64_t last;
  };

  // m, from the centre; triangles are a little nearer than their corners.
  double lowest() const { return (ground().radius + low()) * 0.9; }

  // Of the cube's face, the coordinate of line n of all: -1 to 1, the same but for the sign on both sides.
  double line(std::int64_t n) const {
    const std::int64_t cells = tiles_ * kTileCells;
    const std::int64_t from_middle = 2 * n - cells;
    const std::int64_t size = std::abs(from_middle);
    if (size == cells) return from_middle < 0 ? -1 : 1;
    const portable::SinCos angle =
        portable::sincos(std::numbers::pi / 4 * static_cast<double>(size) / static_cast<double>(cells));
    const double tangent = angle.sin / angle.cos;
    return from_middle < 0 ? -tangent : tangent;
  }

  // Of the tiles of a face along an axis, those that a box before the face reaches. Seen from the centre, a
  // box is widest at its corners.
  Range range(const Eigen::AlignedBox3d& box, const Axes& axes, int axis) const {
    double least = 1;
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d at = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
      const double angle = portable::atan2(at[axis], axes.sign * at[axes.normal]);
      const double place = angle / (std::numbers::pi / 2) + 0.5;  // 0 to 1 on the face
      least = corner == 0 ? place : std::min(least, place);
      most = corner == 0 ? place : std::max(most, place);
    }
    if (most < 0 || least > 1) return {0, -1};
    const auto tile_at = [&](double place) {
      const auto tile = static_cast<std::int64_t>(std::floor(place * static_cast<double>(tiles_)));
      return std::clamp<std::int64_t>(tile, 0, tiles_ - 1);
    };
    return {tile_at(least), tile_at(most)};
  }

  std::int64_t tiles_;  // along an edge of the cube
};

}  // namespace

std::size_t Tile::bytes() const {
  return sizeof *this + vertices.capacity() * sizeof vertices.front() +
         triangles.capacity() * sizeof triangles.front();
}

std::unique_ptr<TileSource> make_hills(const Ground& ground) {
  if (ground.source == Ground::Source::kPlanet) return std::make_unique<Planet>(ground);
  return std::make_unique<Plain>(ground);
}

}  // namespace tessera
