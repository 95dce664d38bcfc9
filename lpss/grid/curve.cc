#include "lpss/grid/curve.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace tessera {
namespace {

constexpr std::uint64_t kMiddle = std::uint64_t{1} << 63;

SectorIndex at_coordinates(const std::array<std::uint64_t, 3>& x, FrameNumber frame,
                           const SectorIndex& anchor_of_world) {
  const SectorIndex anchor = anchor_for({0, 0, 0, frame}, anchor_of_world);
  const auto index = [](std::uint64_t coordinate, std::int64_t origin) {
    return static_cast<std::int64_t>(coordinate - kMiddle + static_cast<std::uint64_t>(origin));
  };
  return {index(x[0], anchor.i), index(x[1], anchor.j), index(x[2], anchor.k), frame};
}

// Whether the highest set bit of `a` is below that of `b`.
bool shorter(std::uint64_t a, std::uint64_t b) { return a < b && a < (a ^ b); }

std::uint64_t without_low_bits(std::uint64_t x, unsigned bits) { return bits >= 64 ? 0 : x >> bits << bits; }

}  // namespace

std::array<std::uint64_t, 3> curve_coordinates(const SectorIndex& sector,
                                               const SectorIndex& anchor_of_world) {
  const SectorIndex anchor = anchor_for(sector, anchor_of_world);
  const auto shifted = [](std::int64_t value, std::int64_t origin) {
    return (static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(origin)) + kMiddle;
  };
  return {shifted(sector.i, anchor.i), shifted(sector.j, anchor.j), shifted(sector.k, anchor.k)};
}

// The order of two points on the curve is that of the coordinate in which they differ in the highest bit: no
// interleaved key of 192 bits is needed.
bool comes_before_on_curve(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor) {
  if (a.frame != b.frame) return a.frame < b.frame;
  const auto x = curve_coordinates(a, anchor);
  const auto y = curve_coordinates(b, anchor);
  int deciding = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (shorter(x[deciding] ^ y[deciding], x[axis] ^ y[axis])) deciding = axis;
  }
  return x[deciding] < y[deciding];
}

unsigned common_level(const SectorIndex& a, const SectorIndex& b, const SectorIndex& anchor) {
  if (a.frame != b.frame) return kCurveLevelMax + 1;
  const auto x = curve_coordinates(a, anchor);
  const auto y = curve_coordinates(b, anchor);
  return static_cast<unsigned>(std::bit_width((x[0] ^ y[0]) | (x[1] ^ y[1]) | (x[2] ^ y[2])));
}

SectorIndex first_of_cube(const SectorIndex& sector, unsigned level, const SectorIndex& anchor) {
  auto x = curve_coordinates(sector, anchor);
  for (std::uint64_t& coordinate : x) coordinate = without_low_bits(coordinate, level);
  return at_coordinates(x, sector.frame, anchor);
}

// Adds one to the interleaved coordinates, whose last bit is that of the last axis.
std::optional<SectorIndex> first_after_cube(const SectorIndex& sector, unsigned level,
                                            const SectorIndex& anchor) {
  auto x = curve_coordinates(sector, anchor);
  for (std::uint64_t& coordinate : x) coordinate = without_low_bits(coordinate, level);
  for (unsigned bit = level; bit < 64; ++bit) {
    const std::uint64_t one = std::uint64_t{1} << bit;
    for (int axis = 2; axis >= 0; --axis) {
      x[axis] ^= one;
      if ((x[axis] & one) != 0) return at_coordinates(x, sector.frame, anchor);
    }
  }
  if (sector.frame == std::numeric_limits<FrameNumber>::max()) return std::nullopt;
  return at_coordinates({}, sector.frame + 1, anchor);
}

}  // namespace tessera
