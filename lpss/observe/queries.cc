#include "lpss/observe/queries.h"

#include <absl/container/btree_map.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "lpss/partition/packing.h"
#include "lpss/partition/statics.h"

namespace tessera {
namespace {

// m, that a hit found from one sector may be off from the same one found from another.
constexpr double kSameHit = 1e-3;

// Sectors, of rounding, by which large static bodies are looked for beyond a line's reach.
constexpr double kNearLarge = 0.01;

// Keeps the first one.
void take(const RayAnswer& answer, std::optional<RayAnswer>& nearest) {
  if (!nearest || order_of(answer) < order_of(*nearest)) nearest = answer;
}

Queries with_strays(Partition& partition) {
  Queries queries(partition);
  queries.look_for_strays();
  return queries;
}

// Around the stretch of a line, seen from where `from` is relative to, and what is within `radius` of it.
Eigen::AlignedBox3d box_around(const WorldLine& line, const Eigen::Vector3d& from, const Stretch& stretch,
                               double radius) {
  Eigen::AlignedBox3d box(Eigen::Vector3d(from + line.direction * stretch.begin));
  box.extend(Eigen::Vector3d(from + line.direction * stretch.end));
  const Eigen::Vector3d around = Eigen::Vector3d::Constant(radius);
  return {box.min() - around, box.max() + around};
}

}  // namespace

bool Queries::GroundBudget::covers(const Partition& partition, const SectorIndex& index,
                                   const Eigen::AlignedBox3d& region) {
  if (!partition.statics.has_ground() || !partition.statics.may_have_ground(index, region)) return true;
  return ++sectors_ <= max_;
}

void Queries::look_for_strays() {
  strays_.clear();
  const Eigen::AlignedBox3d around = cube(partition_.sector_size() / 2 + partition_.margins.reach);
  std::vector<BodyOutside> outside;
  for (const Sector* sector : partition_.active) {
    if (!sector->world) continue;
    outside.clear();
    sector->world->append_outside(around, 0, outside);
    if (!outside.empty()) strays_.push_back(sector->index);
  }
}

WorldLine Queries::line_from(const WorldPosition& origin, const Eigen::Vector3d& direction,
                             double length) const {
  return {canonical(origin.sector, origin.local, partition_.sector_size()).value_or(origin), direction,
          length};
}

const SectorWorld* Queries::living_world(const SectorIndex& index) {
  bring_back(partition_, index);
  const auto found = partition_.sectors.find(index);
  return found == partition_.sectors.end() ? nullptr : found->second->world.get();
}

// A body that moves is found from the sector in which it lives. A static one is found from the sectors in
// which the line meets it, each for its part of the way, and not from others that know it, too: which of
// these have a world, or are looked at, depends on where bodies were, and on which server.
bool Queries::counts(BodyId body, const WorldLine& line, double radius, const LinePlace& place,
                     double distance) const {
  if (partition_.statics.find(body) == nullptr) return true;
  if (!partition_.statics.is_in(body, place.index)) return false;
  const std::optional<Stretch> own =
      stretch_inside(cube(partition_.sector_size() / 2 + radius), place.from, line);
  return own && distance >= own->begin - kSameHit && distance <= own->end + kSameHit;
}

// The sectors whose bodies may be within `radius` (m) of the line: bodies reach out of their sectors.
LineWalk Queries::past_bodies(const WorldLine& line, double radius) const {
  const double reach = partition_.margins.reach + radius;
  SectorPath path(line, reach, partition_.sector_size(), {0, line.length});
  if (path.looks() <= static_cast<double>(partition_.sectors.size() + partition_.packed.counts().sectors))
    return LineWalk(std::move(path));
  std::vector<LinePlace> places;
  const auto consider = [&](const SectorIndex& index) {
    if (const auto place = place_at(index, line, reach, partition_.sector_size())) places.push_back(*place);
  };
  for (const auto& [index, sector] : partition_.sectors) consider(index);
  partition_.packed.for_each([&](const SectorIndex& index, std::size_t) { consider(index); });
  return LineWalk(std::move(places));
}

// Likewise of static bodies, which are known to the sectors that they are in; each sector is in one walk. All
// servers go the same ways.
absl::InlinedVector<LineWalk, 2> Queries::past_statics(const WorldLine& line, double radius) const {
  const double size = partition_.sector_size();
  const auto& listed = partition_.statics.by_sector();
  absl::InlinedVector<LineWalk, 2> walks;
  SectorPath path(line, radius, size, {0, line.length});
  if (path.looks() <= static_cast<double>(listed.size())) {
    walks.emplace_back(std::move(path));
    return walks;
  }
  const std::optional<std::pair<double, double>> large =
      partition_.statics.near_large(line.origin, line.direction, line.length, radius + kNearLarge * size);
  if (large) walks.emplace_back(SectorPath(line, radius, size, {large->first, large->second}));
  std::vector<LinePlace> places;
  for (const auto& [index, bodies] : listed) {
    const std::optional<LinePlace> place = place_at(index, line, radius, size);
    if (!place) continue;
    const bool is_near_large =
        large && place->stretch.begin <= large->second && place->stretch.end >= large->first;
    if (!is_near_large) places.push_back(*place);
  }
  walks.emplace_back(std::move(places));
  return walks;
}

// Calls ask(world, place) for all that may know what is within `radius` (m) of the line. It returns how far
// (m) along the line answers still matter.
template <typename Ask>
void Queries::ask_along(const WorldLine& line, double radius, GroundBudget budget, const Ask& ask) {
  const Eigen::AlignedBox3d around =
      cube(partition_.sector_size() / 2 + std::max(radius, partition_.margins.reach));
  double matters = line.length;
  for (const SectorIndex& index : strays_) {
    const SectorWorld* const world = living_world(index);
    if (world == nullptr) continue;
    const Eigen::Vector3d from = relative_to(line.origin, index, partition_.sector_size());
    matters = std::min(matters, ask(*world, LinePlace{index, from, {0, line.length}}));
  }
  const auto ask_living = [&](const LinePlace& place) {
    if (place.stretch.begin > matters + kSameHit || !partition_.hosts(place.index)) return;
    if (const SectorWorld* world = living_world(place.index)) matters = std::min(matters, ask(*world, place));
  };
  const auto ask_passing = [&](const LinePlace& inner) {
    LinePlace place = inner;
    place.stretch = *stretch_inside(around, place.from, line);
    const Eigen::AlignedBox3d region = box_around(line, place.from, place.stretch, radius);
    if (!budget.covers(partition_, place.index, region) || inner.stretch.begin > matters + kSameHit) return;
    if (!partition_.hosts(place.index) || living_world(place.index) != nullptr) return;
    if (const SectorWorld* world = passing_.at(partition_, place.index, region))
      matters = std::min(matters, ask(*world, place));
  };
  LineWalk bodies = past_bodies(line, radius);
  absl::InlinedVector<LineWalk, 2> statics = past_statics(line, radius);
  // On with whatever is behind the others: where one is beyond what matters, all are.
  while (true) {
    LineWalk* next = &bodies;
    for (LineWalk& walk : statics) {
      if (walk.begin() < next->begin()) next = &walk;
    }
    if (next->is_done() || next->begin() > matters + kSameHit) return;
    if (next == &bodies) {
      next->visit(ask_living);
    } else {
      next->visit(ask_passing);
    }
  }
}

std::optional<RayAnswer> Queries::raycast(const WorldPosition& origin, const Eigen::Vector3d& direction,
                                          double length, const QueryFilter& filter) {
  const WorldLine line = line_from(origin, direction, length);
  std::optional<RayAnswer> nearest;
  ask_along(line, 0, GroundBudget(kRayGroundSectorsMax),
            [&](const SectorWorld& world, const LinePlace& place) {
              const auto& [begin, end] = place.stretch;
              const std::optional<RayHit> hit =
                  world.raycast(place.from + direction * begin, place.from + direction * end, filter);
              const double distance = hit ? begin + hit->fraction * (end - begin) : 0;
              if (hit && counts(hit->body, line, 0, place, distance))
                take({hit->body, distance, hit->normal}, nearest);
              return nearest ? nearest->distance : length;
            });
  return nearest;
}

std::vector<RayAnswer> Queries::raycast_all(const WorldPosition& origin, const Eigen::Vector3d& direction,
                                            double length, const QueryFilter& filter) {
  const WorldLine line = line_from(origin, direction, length);
  absl::btree_map<BodyId, RayAnswer> by_body;
  ask_along(line, 0, GroundBudget(kRayGroundSectorsMax),
            [&](const SectorWorld& world, const LinePlace& place) {
              const auto& [begin, end] = place.stretch;
              for (const RayHit& hit :
                   world.raycast_all(place.from + direction * begin, place.from + direction * end, filter)) {
                const RayAnswer answer{hit.body, begin + hit.fraction * (end - begin), hit.normal};
                if (!counts(hit.body, line, 0, place, answer.distance)) continue;
                const auto [known, is_new] = by_body.try_emplace(hit.body, answer);
                if (!is_new && answer.distance < known->second.distance) known->second = answer;
              }
              return length;
            });
  std::vector<RayAnswer> answers;
  answers.reserve(by_body.size());
  for (const auto& [body, answer] : by_body) answers.push_back(answer);
  std::ranges::sort(answers, {}, order_of);
  if (answers.size() > kRayHitsMax) answers.resize(kRayHitsMax);
  return answers;
}

std::optional<RayAnswer> Queries::sweep(const Geometry& probe, const WorldPose& pose,
                                        const Eigen::Vector3d& direction, double length,
                                        const QueryFilter& filter) {
  const WorldLine line = line_from(pose.position, direction, length);
  const double radius = bounding_radius(probe);
  std::optional<RayAnswer> first;
  ask_along(line, radius, GroundBudget(kRayGroundSectorsMax),
            [&](const SectorWorld& world, const LinePlace& place) {
              // From its start to its end, so that it is the same way for all sectors and servers.
              const std::optional<ProbeHit> hit =
                  world.sweep(probe, {place.from, pose.orientation}, direction, length, filter);
              // What a sector knows of beyond its part of the way, others say, whether it is asked or not.
              if (hit && hit->distance >= place.stretch.begin - kSameHit &&
                  counts(hit->body, line, radius, place, hit->distance))
                take({hit->body, hit->distance, hit->normal}, first);
              return first ? first->distance : length;
            });
  return first;
}

std::vector<NearBody> Queries::bodies_near(const Geometry& probe, const WorldPose& pose, double reach,
                                           const QueryFilter& filter) {
  const double radius = bounding_radius(probe) + reach;
  const WorldLine line = line_from(pose.position, Eigen::Vector3d::UnitX(), 0);
  absl::btree_map<BodyId, double> distances;
  ask_along(line, radius, GroundBudget(), [&](const SectorWorld& world, const LinePlace& place) {
    for (const NearBody& near : world.near(probe, {place.from, pose.orientation}, reach, filter)) {
      if (!counts(near.body, line, radius, place, 0)) continue;
      const auto [known, is_new] = distances.try_emplace(near.body, near.distance);
      if (!is_new) known->second = std::min(known->second, near.distance);
    }
    return 0.0;
  });
  std::vector<NearBody> found;
  for (const auto& [body, distance] : distances) found.push_back({body, distance});
  std::ranges::stable_sort(found, {}, &NearBody::distance);
  return found;
}

std::optional<RayAnswer> raycast(Partition& partition, const WorldPosition& origin,
                                 const Eigen::Vector3d& direction, double length, std::uint32_t mask,
                                 std::span<const BodyId> except) {
  return with_strays(partition).raycast(origin, direction, length, {mask, except});
}

std::vector<RayAnswer> raycast_all(Partition& partition, const WorldPosition& origin,
                                   const Eigen::Vector3d& direction, double length, std::uint32_t mask,
                                   std::span<const BodyId> except) {
  return with_strays(partition).raycast_all(origin, direction, length, {mask, except});
}

std::optional<RayAnswer> sweep(Partition& partition, const Geometry& probe, const WorldPose& pose,
                               const Eigen::Vector3d& direction, double length, std::uint32_t mask,
                               std::span<const BodyId> except) {
  return with_strays(partition).sweep(probe, pose, direction, length, {mask, except});
}

std::vector<NearBody> bodies_near(Partition& partition, const Geometry& probe, const WorldPose& pose,
                                  double reach, std::uint32_t mask, std::span<const BodyId> except) {
  return with_strays(partition).bodies_near(probe, pose, reach, {mask, except});
}

}  // namespace tessera
