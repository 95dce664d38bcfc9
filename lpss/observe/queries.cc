#include "lpss/observe/queries.h"

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "lpss/partition/statics.h"

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
std::optional<std::pair<double, double>> stretch_inside(const Eigen::AlignedBox3d& box,
                                                        const Eigen::Vector3d& from,
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

// A sector in which nothing moves has no engine world; one is made in `passing` for the moment where statics
// are there. nullptr where nothing is.
SectorWorld* world_to_ask(const Partition& partition, const SectorIndex& index,
                          const Eigen::AlignedBox3d& surroundings, Sector& passing) {
  const auto found = partition.sectors.find(index);
  if (found != partition.sectors.end() && found->second->world) return found->second->world.get();
  if (partition.statics.overlapping(index, surroundings).empty()) return nullptr;
  passing.index = index;
  passing.world = partition.engine.make_world();
  add_statics(partition, passing, surroundings);
  return passing.world.get();
}

void raycast_sector(const Partition& partition, const SectorIndex& index, const WorldPosition& origin,
                    const Eigen::Vector3d& direction, double length, std::uint32_t mask,
                    std::optional<RayAnswer>& nearest) {
  const Eigen::Vector3d half =
      Eigen::Vector3d::Constant(partition.sector_size() / 2 + partition.margins.reach);
  const Eigen::AlignedBox3d surroundings(-half, half);
  const Eigen::Vector3d from = relative_to(origin, index, partition.sector_size());
  const auto stretch = stretch_inside(surroundings, from, direction, length);
  if (!stretch) return;

  Sector passing;
  SectorWorld* world = world_to_ask(partition, index, surroundings, passing);
  if (world == nullptr) return;
  const auto [begin, end] = *stretch;
  const std::optional<RayHit> hit = world->raycast(from + direction * begin, from + direction * end, mask);
  if (!hit) return;
  const double distance = begin + hit->fraction * (end - begin);
  if (nearest && std::pair(nearest->distance, nearest->body) <= std::pair(distance, hit->body)) return;
  nearest = RayAnswer{hit->body, distance, hit->normal};
}

}  // namespace

std::optional<RayAnswer> raycast(const Partition& partition, const WorldPosition& origin,
                                 const Eigen::Vector3d& direction, double length, std::uint32_t mask) {
  std::optional<RayAnswer> nearest;
  absl::flat_hash_set<SectorIndex> done;
  SectorWalk walk(origin.local, direction, length, partition.sector_size());
  const int around =
      partition.margins.reach + partition.radius_max > partition.sector_size() / 2 ? OffsetSet::kReach : 1;
  do {
    // Bodies of neighbouring sectors may reach into this one.
    for (int i = -around; i <= around; ++i) {
      for (int j = -around; j <= around; ++j) {
        for (int k = -around; k <= around; ++k) {
          const SectorOffset at = walk.sector();
          const absl::StatusOr<SectorIndex> sector =
              translated(origin.sector, {at.i + i, at.j + j, at.k + k});
          if (!sector.ok() || !partition.hosts(*sector) || !done.insert(*sector).second) continue;
          raycast_sector(partition, *sector, origin, direction, length, mask, nearest);
        }
      }
    }
  } while (walk.advance());
  return nearest;
}

std::vector<NearBody> bodies_near(const Partition& partition, const Geometry& probe, const WorldPose& pose,
                                  double reach, std::uint32_t mask) {
  const double radius = bounding_radius(probe) + reach;
  const Eigen::Vector3d half =
      Eigen::Vector3d::Constant(partition.sector_size() / 2 + partition.margins.reach);
  const Eigen::AlignedBox3d surroundings(-half, half);
  const auto cell = [&](double x) {
    return static_cast<std::int64_t>(std::floor(x / partition.sector_size() + 0.5));
  };
  const Eigen::Vector3d low =
      pose.position.local - Eigen::Vector3d::Constant(radius + partition.margins.reach);
  const Eigen::Vector3d high =
      pose.position.local + Eigen::Vector3d::Constant(radius + partition.margins.reach);
  absl::btree_map<BodyId, double> distances;
  for (std::int64_t i = cell(low.x()); i <= cell(high.x()); ++i) {
    for (std::int64_t j = cell(low.y()); j <= cell(high.y()); ++j) {
      for (std::int64_t k = cell(low.z()); k <= cell(high.z()); ++k) {
        const absl::StatusOr<SectorIndex> sector = translated(pose.position.sector, {i, j, k});
        if (!sector.ok() || !partition.hosts(*sector)) continue;
        Sector passing;
        SectorWorld* world = world_to_ask(partition, *sector, surroundings, passing);
        if (world == nullptr) continue;
        const Pose local{relative_to(pose.position, *sector, partition.sector_size()), pose.orientation};
        for (const NearBody& near : world->near(probe, local, reach, mask)) {
          const auto [place, is_new] = distances.try_emplace(near.body, near.distance);
          if (!is_new) place->second = std::min(place->second, near.distance);
        }
      }
    }
  }
  std::vector<NearBody> found;
  for (const auto& [body, distance] : distances) found.push_back({body, distance});
  std::stable_sort(found.begin(), found.end(),
                   [](const NearBody& a, const NearBody& b) { return a.distance < b.distance; });
  return found;
}

}  // namespace tessera
