// Rays through any number of sectors: in each, a short segment near that sector's centre.
#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "lpss/world/share.h"

namespace tessera {
namespace {

// The sectors that a ray passes through, in order, relative to the sector of its origin.
class SectorWalk {
 public:
  SectorWalk(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double length, double size)
      : length_(length) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const double d = direction[axis];
      step_[axis] = d > 0 ? 1 : -1;
      next_[axis] = d == 0 ? kNever : (step_[axis] * size / 2 - from[axis]) / d;
      every_[axis] = d == 0 ? kNever : size / std::abs(d);
    }
  }

  SectorOffset sector() const { return {at_[0], at_[1], at_[2]}; }

  // Goes on to the next sector; false at the end of the ray.
  bool advance() {
    int axis = 0;
    for (int other = 1; other < 3; ++other) {
      if (next_[other] < next_[axis]) axis = other;
    }
    if (next_[axis] > length_) return false;
    at_[axis] += step_[axis];
    next_[axis] += every_[axis];
    return true;
  }

 private:
  double length_;
  std::int64_t at_[3] = {0, 0, 0};
  std::int64_t step_[3];
  double next_[3];
  double every_[3];
};

// The stretch of the ray inside `box`; empty where it misses.
std::optional<std::pair<double, double>> stretch_inside(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from,
                                                        const Eigen::Vector3d& direction, double length) {
  double begin = 0;
  double end = length;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) {
      if (from[axis] < box.min()[axis] || from[axis] > box.max()[axis]) return std::nullopt;
      continue;
    }
    double t0 = (box.min()[axis] - from[axis]) / direction[axis];
    double t1 = (box.max()[axis] - from[axis]) / direction[axis];
    if (t0 > t1) std::swap(t0, t1);
    begin = std::max(begin, t0);
    end = std::min(end, t1);
  }
  if (begin > end) return std::nullopt;
  return std::pair(begin, end);
}

}  // namespace

std::optional<Share::RayAnswer> Share::raycast(const WorldPosition& origin, const Eigen::Vector3d& direction,
                                               double length, std::uint32_t mask) {
  std::optional<RayAnswer> nearest;
  absl::flat_hash_set<SectorIndex> done;
  SectorWalk walk(origin.local, direction, length, size());
  const int around = margins_.reach + radius_max_ > size() / 2 ? OffsetSet::kReach : 1;
  do {
    // Bodies of neighbouring sectors may reach into this one.
    for (int i = -around; i <= around; ++i) {
      for (int j = -around; j <= around; ++j) {
        for (int k = -around; k <= around; ++k) {
          const SectorOffset at = walk.sector();
          const absl::StatusOr<SectorIndex> sector =
              translated(origin.sector, {at.i + i, at.j + j, at.k + k});
          if (!sector.ok() || !mine(*sector) || !done.insert(*sector).second) continue;
          raycast_sector(*sector, origin, direction, length, mask, nearest);
        }
      }
    }
  } while (walk.advance());
  return nearest;
}

void Share::raycast_sector(const SectorIndex& index, const WorldPosition& origin, const Eigen::Vector3d& direction,
                           double length, std::uint32_t mask, std::optional<RayAnswer>& nearest) {
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(size() / 2 + margins_.reach);
  const Eigen::AlignedBox3d surroundings(-half, half);
  const Eigen::Vector3d from = relative_to(origin, index, size());
  const auto stretch = stretch_inside(surroundings, from, direction, length);
  if (!stretch) return;

  // A sector in which nothing moves has no engine world; one is made for the moment where statics are there.
  Sector passing;
  const auto found = sectors_.find(index);
  Sector* sector = found == sectors_.end() ? nullptr : found->second.get();
  if (sector == nullptr || !sector->world) {
    if (statics_.overlapping(index, surroundings).empty()) return;
    passing.index = index;
    passing.world = engine_.make_world();
    add_statics(passing, surroundings);
    sector = &passing;
  }
  const auto [begin, end] = *stretch;
  const std::optional<RayHit> hit =
      sector->world->raycast(from + direction * begin, from + direction * end, mask);
  if (!hit) return;
  const double distance = begin + hit->fraction * (end - begin);
  if (nearest && std::pair(nearest->distance, nearest->body) <= std::pair(distance, hit->body)) return;
  nearest = RayAnswer{hit->body, distance, hit->normal};
}

}  // namespace tessera
