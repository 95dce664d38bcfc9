// The space-filling curve (Morton) on which a world's sectors are divided among its servers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "lpss/grid/sector_index.h"

namespace tessera {

// Whether `a` comes before `b` on the Morton curve around `anchor`. Each frame has a curve of its own, around
// anchor_for(); they lie one after the other.
bool comes_before_on_curve(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor);

// The index relative to the anchor, shifted so that unsigned order is signed order. Wraps around where the
// difference leaves 64 bits; the order there is odd, but the same for everyone.
std::array<std::uint64_t, 3> curve_coordinates(const SectorIndex& sector, const SectorIndex& anchor);

// The curve fills one cube of 2^level sectors a side after the other, for each level from 0 (single sectors)
// to this one (all sectors).
inline constexpr unsigned kCurveLevelMax = 64;

// The level (<= kCurveLevelMax) of the smallest such cube that has both; of different frames, one more.
unsigned common_level(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor);

// The first sector, on the curve, of the cube of that level (<= kCurveLevelMax) that has `sector`. Its corner
// with the lowest coordinates.
SectorIndex first_of_cube(const SectorIndex& sector, unsigned level, const SectorIndex& anchor);

// The first sector after that cube on the curve, which is the first of a cube of the same level, or of the
// next frame; nullopt where the last curve ends with it.
std::optional<SectorIndex> first_after_cube(const SectorIndex& sector, unsigned level,
                                            const SectorIndex& anchor);

}  // namespace tessera
