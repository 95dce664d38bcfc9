// Tiles of ground, and what they come from.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "lpss/model/ground.h"

namespace tessera {

// Which tile of a ground. What the numbers mean is up to its source.
struct TileKey {
  std::int32_t face = 0;
  std::int64_t i = 0;
  std::int64_t j = 0;

  friend auto operator<=>(const TileKey&, const TileKey&) = default;

  template <typename H>
  friend H AbslHashValue(H h, const TileKey& key) {
    return H::combine(std::move(h), key.face, key.i, key.j);
  }
};

// Triangles, counter-clockwise from above, in the frame of the ground. Vertices that tiles share are the same
// bits in all of them. Numbers are far from 0 on a planet: doubles of 1e7 m are 2e-9 m apart.
struct Tile {
  std::vector<Eigen::Vector3d> vertices;  // m
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::uint32_t name = 0;  // of the first triangle; the others count from it

  std::size_t bytes() const;
};

// Where the tiles of a ground come from. Safe to call from any thread.
class TileSource {
 public:
  virtual ~TileSource() = default;

  // The tiles that may have triangles in `box` (m, frame of the ground), ascending.
  virtual std::vector<TileKey> overlapping(const Eigen::AlignedBox3d& box) const = 0;

  // Reads or makes a tile: the same bits whenever and wherever it is asked for. Errors: those of files.
  virtual absl::StatusOr<Tile> make(const TileKey& key) const = 0;
};

// The source of a ground that is made by arithmetic alone (not kFolder).
std::unique_ptr<TileSource> make_hills(const Ground& ground);

}  // namespace tessera
