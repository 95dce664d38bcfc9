#include "lpss/observe/queries.h"

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "lpss/partition/packing.h"
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
  // Where the ray enters it, m from the origin.
  double begin() const { return begin_; }

  // Goes on to the next sector; false at the end of the ray.
  bool advance() {
    int axis = 0;
    for (int other = 1; other < 3; ++other) {
      if (next_[other] < next_[axis]) axis = other;
    }
    if (next_[axis] > length_) return false;
    begin_ = next_[axis];
    at_[axis] += step_[axis];
    next_[axis] += every_[axis];
    return true;
  }

 private:
  double length_;
  double begin_ = 0;
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

// What a sector's engine world knows of, relative to the sector's centre.
Eigen::AlignedBox3d surroundings(const Partition& partition) {
  return cube(partition.sector_size() / 2 + partition.margins.reach);
}

// A sector in which nothing moves has no engine world. Makes one in `passing`, for the moment, with the
// statics around it, if any of them meets `region` (m, relative to the sector's centre); otherwise nullptr.
SectorWorld* passing_world(const Partition& partition, const SectorIndex& index,
                           const Eigen::AlignedBox3d& region, Sector& passing) {
  const std::vector<BodyId> statics = partition.statics.overlapping(index, region);
  const bool any = std::any_of(statics.begin(), statics.end(), [&](BodyId id) {
    const StaticIndex::Cut cut = partition.statics.cut(id, index, region);
    return cut.whole || !cut.shape.parts.empty();
  });
  if (!any) return nullptr;
  passing.index = index;
  passing.world = partition.engine.make_world();
  add_statics(partition, passing, surroundings(partition));
  return passing.world.get();
}

SectorWorld* living_world(Partition& partition, const SectorIndex& index) {
  bring_back(partition, index);
  const auto found = partition.sectors.find(index);
  return found == partition.sectors.end() ? nullptr : found->second->world.get();
}

class Raycast {
 public:
  Raycast(Partition& partition, const WorldPosition& origin, const Eigen::Vector3d& direction, double length,
          std::uint32_t mask)
      : partition_(partition), origin_(origin), direction_(direction), length_(length), mask_(mask) {}

  std::optional<RayAnswer> nearest() {
    const double size = partition_.sector_size();
    const int around = partition_.margins.reach + partition_.radius_max > size / 2 ? OffsetSet::kReach : 1;
    // What is found around a sector is at most so much nearer than where the ray enters the sector.
    const double back = 2 * size * (around + 1);
    SectorWalk walk(origin_.local, direction_, length_, size);
    do {
      if (nearest_ && nearest_->distance < walk.begin() - back) break;
      ask_sector(walk.sector());
      ask_around(walk.sector(), around);
    } while (walk.advance());
    return nearest_;
  }

 private:
  struct Stretch {
    Eigen::Vector3d from;  // of the ray, relative to the sector's centre
    double begin;
    double end;
  };

  // Of the ray in the surroundings of a sector.
  std::optional<Stretch> stretch_in(const SectorIndex& index) const {
    const Eigen::Vector3d from = relative_to(origin_, index, partition_.sector_size());
    const auto stretch = stretch_inside(surroundings(partition_), from, direction_, length_);
    if (!stretch) return std::nullopt;
    return Stretch{from, stretch->first, stretch->second};
  }

  // Whether the ground of this sector is still to be looked at. All servers count alike, so that the answer
  // does not depend on who hosts what.
  bool may_look_at_ground(const SectorIndex& index, const Eigen::AlignedBox3d& region) {
    if (!partition_.statics.has_ground() || !partition_.statics.may_have_ground(index, region)) return true;
    return ++sectors_of_ground_ <= kRayGroundSectorsMax;
  }

  // The sector that the ray passes through, where nothing lives.
  void ask_sector(const SectorOffset& at) {
    const absl::StatusOr<SectorIndex> index = translated(origin_.sector, at);
    if (!index.ok()) return;
    const std::optional<Stretch> stretch = stretch_in(*index);
    if (!stretch) return;
    Eigen::AlignedBox3d region(Eigen::Vector3d(stretch->from + direction_ * stretch->begin));
    region.extend(Eigen::Vector3d(stretch->from + direction_ * stretch->end));
    if (!may_look_at_ground(*index, region)) return;
    if (!partition_.hosts(*index) || living_world(partition_, *index) != nullptr) return;
    Sector passing;
    if (SectorWorld* world = passing_world(partition_, *index, region, passing)) ask(*world, *stretch);
  }

  // Bodies of neighbouring sectors may reach into the one that the ray passes through.
  void ask_around(const SectorOffset& at, int around) {
    for (int i = -around; i <= around; ++i) {
      for (int j = -around; j <= around; ++j) {
        for (int k = -around; k <= around; ++k) {
          const absl::StatusOr<SectorIndex> index =
              translated(origin_.sector, {at.i + i, at.j + j, at.k + k});
          if (!index.ok()) continue;
          SectorWorld* world = living_world(partition_, *index);
          if (world == nullptr || !done_.insert(*index).second) continue;
          if (const std::optional<Stretch> stretch = stretch_in(*index)) ask(*world, *stretch);
        }
      }
    }
  }

  void ask(SectorWorld& world, const Stretch& stretch) {
    const auto& [from, begin, end] = stretch;
    const std::optional<RayHit> hit =
        world.raycast(from + direction_ * begin, from + direction_ * end, mask_);
    if (!hit) return;
    const double distance = begin + hit->fraction * (end - begin);
    if (nearest_ && std::pair(nearest_->distance, nearest_->body) <= std::pair(distance, hit->body)) return;
    nearest_ = RayAnswer{hit->body, distance, hit->normal};
  }

  Partition& partition_;
  const WorldPosition& origin_;
  const Eigen::Vector3d& direction_;
  const double length_;
  const std::uint32_t mask_;
  absl::flat_hash_set<SectorIndex> done_;  // of those where something lives
  std::size_t sectors_of_ground_ = 0;
  std::optional<RayAnswer> nearest_;
};

}  // namespace

std::optional<RayAnswer> raycast(Partition& partition, const WorldPosition& origin,
                                 const Eigen::Vector3d& direction, double length, std::uint32_t mask) {
  return Raycast(partition, origin, direction, length, mask).nearest();
}

std::vector<NearBody> bodies_near(Partition& partition, const Geometry& probe, const WorldPose& pose,
                                  double reach, std::uint32_t mask) {
  const double radius = bounding_radius(probe) + reach;
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
        SectorWorld* world = living_world(partition, *sector);
        if (world == nullptr) world = passing_world(partition, *sector, surroundings(partition), passing);
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
