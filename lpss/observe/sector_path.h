// The sectors around a straight line, as far as any server may know something of what is near it.
#pragma once

#include <absl/container/flat_hash_set.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "lpss/grid/world_position.h"

namespace tessera {

// m along a line.
struct Stretch {
  double begin = 0;
  double end = 0;
};

// The points origin + t * direction of which t is from 0 to `length` (m, `direction` of unit length).
struct WorldLine {
  WorldPosition origin;
  Eigen::Vector3d direction;
  double length = 0;
};

// What of a line from `from` is inside `box`; empty where it misses.
std::optional<Stretch> stretch_inside(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from,
                                      const WorldLine& line);

// A sector, and what of a line is near it.
struct LinePlace {
  SectorIndex index;
  Eigen::Vector3d from;  // m, of the line, relative to the sector's centre
  Stretch stretch;
};

// Nothing where the line misses the sector's cube, grown by `reach` (m).
std::optional<LinePlace> place_at(const SectorIndex& sector, const WorldLine& line, double reach,
                                  double sector_size);

// Goes along a line, from each sector that it passes through to the next one.
class SectorPath {
 public:
  // Sectors are around the line as far as their cubes, grown by `reach` (m), meet it. Goes along what of the
  // line is `within`.
  SectorPath(const WorldLine& line, double reach, double sector_size, const Stretch& within);

  // How often it looks at a sector on the way, about.
  double looks() const;

  // Calls visit(place) for the sectors around what of the line is in this sector, each once.
  template <typename Visit>
  void for_each_around(const Visit& visit) {
    const Eigen::Vector3d start = line_.origin.local + line_.direction * begin_;
    const Eigen::Vector3d end = line_.origin.local + line_.direction * end_of_piece();
    // look_at() decides; a border may be on either side of what is rounded.
    const double around = reach_ + kRounding * size_;
    const auto first = [&](int axis) { return cell(std::min(start[axis], end[axis]) - around); };
    const auto last = [&](int axis) { return cell(std::max(start[axis], end[axis]) + around); };
    for (std::int64_t i = first(0); i <= last(0); ++i) {
      for (std::int64_t j = first(1); j <= last(1); ++j) {
        for (std::int64_t k = first(2); k <= last(2); ++k) look_at({i, j, k}, visit);
      }
    }
  }

  // m, where the line enters the sector: what is near the line before has been visited.
  double begin() const { return begin_; }

  // Goes on to the next sector; false at the end of the line.
  bool advance();

 private:
  template <typename Visit>
  void look_at(const SectorOffset& offset, const Visit& visit) {
    const absl::StatusOr<SectorIndex> index = translated(line_.origin.sector, offset);
    if (!index.ok() || seen_.contains(*index)) return;
    const std::optional<LinePlace> place = place_at(*index, line_, reach_, size_);
    if (!place) return;
    seen_.insert(*index);
    visit(*place);
  }

  double end_of_piece() const { return std::min({next_[0], next_[1], next_[2], end_}); }
  std::int64_t cell(double x) const { return static_cast<std::int64_t>(std::floor(x / size_ + 0.5)); }

  static constexpr double kRounding = 1e-6;  // sectors; more than positions along a line are rounded by

  const WorldLine& line_;
  double reach_;
  double size_;
  double begin_;
  double end_;
  double next_[3];   // m, where the line leaves the sector, by axis
  double every_[3];  // m, between two such places
  absl::flat_hash_set<SectorIndex> seen_;
};

}  // namespace tessera
