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

std::optional<LinePlace> place_at(const SectorIndex& sector, const WorldLine& line, double reach,
                                  double sector_size) {
  const Eigen::Vector3d from = relative_to(line.origin, sector, sector_size);
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(sector_size / 2 + reach);
  const std::optional<Stretch> stretch = stretch_inside({-half, half}, from, line);
  if (!stretch) return std::nullopt;
  return LinePlace{sector, from, *stretch};
}

SectorPath::SectorPath(const WorldLine& line, double reach, double sector_size, const Stretch& within)
    : line_(line), reach_(reach), size_(sector_size), begin_(within.begin), end_(within.end) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double step = line.direction[axis];
    next_[axis] = kNever;
    every_[axis] = sector_size / std::abs(step);
    if (every_[axis] == kNever) continue;
    const double first = (std::copysign(sector_size / 2, step) - line.origin.local[axis]) / step;
    const double passed = std::ceil((begin_ - first) / every_[axis]);
    next_[axis] = first + std::max(0.0, passed) * every_[axis];
  }
}

double SectorPath::looks() const {
  const double around = 2 * reach_ / size_ + 2;
  double pieces = 1;
  for (const double every : every_) pieces += (end_ - begin_) / every;
  return pieces * around * around * around;
}

bool SectorPath::advance() {
  int axis = 0;
  for (int other = 1; other < 3; ++other) {
    if (next_[other] < next_[axis]) axis = other;
  }
  if (next_[axis] > end_) return false;
  begin_ = next_[axis];
  next_[axis] += every_[axis];
  return true;
}

}  // namespace tessera
