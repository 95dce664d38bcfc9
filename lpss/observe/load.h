// What a partition has to do, and where: by which servers share a world. Between ticks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lpss/partition/partition.h"

namespace tessera {

// By so many pieces a server describes its load.
inline constexpr std::size_t kLoadPiecesMax = 1024;

// Sectors of one server in a cube of the curve (lpss/grid/curve.h): what is in one piece is near.
struct LoadPiece {
  SectorIndex first;          // of them, on the curve
  unsigned level = 0;         // of the cube
  double work = 0;            // the cost of a tick, in units of one awake body's
  std::uint64_t sectors = 0;  // with all that lives in them: what a move of the piece moves
  std::uint64_t bodies = 0;
};

// The partition's sectors in at most `pieces_max` (>= 1) pieces, in the order of the curve: single sectors,
// or where these are more, cubes of about the same work, and first of all such as have one owner. Work is
// that of the present sectors, or, for `ahead` > 0 s, of those where the bodies will be by then if they go on
// as they do, which may be others' sectors: *projected* load, after Brown's aura projection.
std::vector<LoadPiece> load_along_curve(const Partition& partition, double ahead, std::size_t pieces_max);

}  // namespace tessera
