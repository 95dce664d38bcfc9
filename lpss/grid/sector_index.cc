#include "lpss/grid/sector_index.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>

namespace tessera {
namespace {

__extension__ using Int128 = __int128;

Int128 difference(std::int64_t from, std::int64_t to) { return Int128{to} - Int128{from}; }

absl::Status leaves_range(const SectorIndex& sector, char axis) {
  return absl::OutOfRangeError(absl::StrCat("sector ", to_string(sector), ": component ",
                                            std::string(1, axis),
                                            " would leave the 64-bit range of sector indices"));
}

std::int64_t saturated_abs(Int128 value) {
  const Int128 magnitude = value < 0 ? -value : value;
  return magnitude > std::numeric_limits<std::int64_t>::max() ? std::numeric_limits<std::int64_t>::max()
                                                              : static_cast<std::int64_t>(magnitude);
}

}  // namespace

absl::StatusOr<SectorIndex> translated(const SectorIndex& sector, const SectorOffset& offset) {
  SectorIndex result = sector;
  if (__builtin_add_overflow(sector.i, offset.i, &result.i)) return leaves_range(sector, 'i');
  if (__builtin_add_overflow(sector.j, offset.j, &result.j)) return leaves_range(sector, 'j');
  if (__builtin_add_overflow(sector.k, offset.k, &result.k)) return leaves_range(sector, 'k');
  return result;
}

absl::StatusOr<SectorOffset> offset_between(const SectorIndex& from, const SectorIndex& to) {
  if (from.frame != to.frame)
    return absl::OutOfRangeError(
        absl::StrCat("sectors ", to_string(from), " and ", to_string(to), " are of different frames"));
  SectorOffset result;
  if (__builtin_sub_overflow(to.i, from.i, &result.i)) return leaves_range(to, 'i');
  if (__builtin_sub_overflow(to.j, from.j, &result.j)) return leaves_range(to, 'j');
  if (__builtin_sub_overflow(to.k, from.k, &result.k)) return leaves_range(to, 'k');
  return result;
}

Eigen::Vector3d metres_between(const SectorIndex& from, const SectorIndex& to, double sector_size) {
  if (from.frame != to.frame) return Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  return Eigen::Vector3d(static_cast<double>(difference(from.i, to.i)),
                         static_cast<double>(difference(from.j, to.j)),
                         static_cast<double>(difference(from.k, to.k))) *
         sector_size;
}

std::int64_t chebyshev_distance(const SectorIndex& a, const SectorIndex& b) {
  if (a.frame != b.frame) return std::numeric_limits<std::int64_t>::max();
  return std::max({saturated_abs(difference(a.i, b.i)), saturated_abs(difference(a.j, b.j)),
                   saturated_abs(difference(a.k, b.k))});
}

std::string to_string(const SectorIndex& sector) {
  const std::string index = absl::StrCat("(", sector.i, ", ", sector.j, ", ", sector.k, ")");
  return sector.frame == kWorldFrame ? index : absl::StrCat(index, " of frame ", sector.frame);
}

}  // namespace tessera
