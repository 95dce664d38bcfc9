// The index of a sector: which cube of the world, in 64-bit integers.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <compare>
#include <cstdint>
#include <string>
#include <utility>

namespace tessera {

// A difference of two sector indices, in whole sectors.
struct SectorOffset {
  std::int64_t i = 0;
  std::int64_t j = 0;
  std::int64_t k = 0;

  friend auto operator<=>(const SectorOffset&, const SectorOffset&) = default;
};

// The frame that a sector belongs to: kWorldFrame, or one that moves (lpss/model/moving_frame.h), whose place
// in WorldSettings::frames is one less.
using FrameNumber = std::uint32_t;
inline constexpr FrameNumber kWorldFrame = 0;

// The sector whose centre lies at (i, j, k) * L metres from the origin of its frame, L being the edge of
// every sector of that world. Any 64-bit value is a valid index; arithmetic that would leave the range is
// refused. Sectors of different frames are nowhere near each other.
//
// The order is lexicographic, by frame first. As long as nothing overflows it does not change when a world is
// moved by whole sectors, so it may decide which sector detects and which server solves.
struct SectorIndex {
  std::int64_t i = 0;
  std::int64_t j = 0;
  std::int64_t k = 0;
  FrameNumber frame = kWorldFrame;

  friend bool operator==(const SectorIndex&, const SectorIndex&) = default;
  friend std::strong_ordering operator<=>(const SectorIndex& a, const SectorIndex& b) {
    if (a.frame != b.frame) return a.frame <=> b.frame;
    if (a.i != b.i) return a.i <=> b.i;
    return a.j != b.j ? a.j <=> b.j : a.k <=> b.k;
  }

  template <typename H>
  friend H AbslHashValue(H h, const SectorIndex& s) {
    return H::combine(std::move(h), s.i, s.j, s.k, s.frame);
  }
};

// What a sector's index is relative to where it must not matter where the world is: `anchor`, which moves
// with the world, or the origin of another frame.
inline SectorIndex anchor_for(const SectorIndex& sector, const SectorIndex& anchor) {
  return sector.frame == anchor.frame ? anchor : SectorIndex{0, 0, 0, sector.frame};
}

// `sector` moved by `offset`, in its frame. OUT_OF_RANGE, naming the axis, if a component leaves the 64-bit
// range.
absl::StatusOr<SectorIndex> translated(const SectorIndex& sector, const SectorOffset& offset);

// What must be added to `from` to reach `to`. OUT_OF_RANGE if a component does not fit in 64 bits, or they
// belong to different frames.
absl::StatusOr<SectorOffset> offset_between(const SectorIndex& from, const SectorIndex& to);

// The vector in metres from the centre of `from` to the centre of `to`, for sectors of edge `sector_size`
// metres. The integers are subtracted exactly (in 128 bits) before anything is rounded, so the result depends
// on the offset alone and not on where in the world the two sectors are. Infinite, of different frames.
Eigen::Vector3d metres_between(const SectorIndex& from, const SectorIndex& to, double sector_size);

// The largest component of the offset between two sectors, by absolute value, saturated at 2^63 - 1:
// 0 for the same sector, 1 for its 26 neighbours; of different frames: 2^63 - 1.
std::int64_t chebyshev_distance(const SectorIndex& a, const SectorIndex& b);

// "(i, j, k)", for messages; "(i, j, k) of frame n".
std::string to_string(const SectorIndex& sector);

}  // namespace tessera
