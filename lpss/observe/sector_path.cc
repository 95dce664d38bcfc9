#include "lpss/observe/sector_path.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {

std::optional<Stretch> stretch_inside(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from,
                                      const WorldLine& line) {
  Stretch stretch{0, line.length};
  for (int axis = 0; axis < 3; ++axis) {
    const double step = line.direction[axis];
    if (step == 0) {
      if (from[axis] < box.min()[axis] || from[axis] > box.max()[axis]) return std::nullopt;
      continue;
    }
    double t0 = (box.min()[axis] - from[axis]) / step;
    double t1 = (box.max()[axis] - from[axis]) / step;
    if (t0 > t1) std::swap(t0, t1);
    stretch.begin = std::max(stretch.begin, t0);
    stretch.end = std::min(stretch.end, t1);
  }
  if (stretch.begin > stretch.end) return std::nullopt;
  return stretch;
}

SectorPath::SectorPath(const WorldLine& line, double reach, double sector_size)
    : line_(line), reach_(reach), size_(sector_size) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double step = line.direction[axis];
    const double border = std::copysign(sector_size / 2, step);
    next_[axis] = step == 0 ? kNever : (border - line.origin.local[axis]) / step;
    every_[axis] = step == 0 ? kNever : sector_size / std::abs(step);
  }
}

bool SectorPath::advance() {
  int axis = 0;
  for (int other = 1; other < 3; ++other) {
    if (next_[other] < next_[axis]) axis = other;
  }
  if (next_[axis] > line_.length) return false;
  begin_ = next_[axis];
  next_[axis] += every_[axis];
  return true;
}

}  // namespace tessera
