// Rays, sweeps, and what is near: each server finds what it hosts, and the nearest counts.

#include <absl/container/btree_map.h>

#include <algorithm>
#include <set>
#include <utility>

#include "coordinator/query_checks.h"
#include "coordinator/query_kinds.h"
#include "lpss/model/limits.h"
#include "lpss/observe/queries.h"
#include "proto/convert.h"

namespace tessera {
namespace {

RayAnswer answer_of(const v1::RayHits::Hit& hit) {
  return {BodyId{hit.body()}, hit.distance(), from_proto(hit.normal())};
}

// The nearest of all hits, or all of them, along a way from `origin`.
v1::RayHits merged(std::vector<v1::RayHits::Hit> hits, bool all, const WorldPosition& origin,
                   const Eigen::Vector3d& direction, const WorldRegistry& world) {
  std::sort(hits.begin(), hits.end(),
            [](const auto& x, const auto& y) { return order_of(answer_of(x)) < order_of(answer_of(y)); });
  v1::RayHits result;
  result.set_hit(!hits.empty());
  std::set<std::uint64_t> bodies;  // servers may have the same static one
  for (v1::RayHits::Hit& hit : hits) {
    if (!bodies.insert(hit.body()).second) continue;
    if (const auto* entry = world.find(BodyId{hit.body()})) hit.set_name(entry->name);
    const Eigen::Vector3d way = hit.distance() * direction;
    const auto position = canonical(origin.sector, origin.local + way, world.settings().sector_size);
    if (position.ok()) *hit.mutable_position() = to_proto(*position);
    *result.add_hits() = std::move(hit);
    if (!all || result.hits_size() == kRayHitsMax) break;
  }
  return result;
}

std::vector<v1::RayHits::Hit> hits_of(Parts& parts, v1::RayHits* (v1::QueryResult::*field)()) {
  std::vector<v1::RayHits::Hit> hits;
  for (v1::PartialResult& part : parts) {
    for (v1::RayHits::Hit& hit : *(part.mutable_result()->*field)()->mutable_hits())
      hits.push_back(std::move(hit));
  }
  return hits;
}

v1::RayHits result_of(const v1::RayQuery& ray, Parts& parts, const WorldRegistry& world) {
  v1::RayHits result =
      merged(hits_of(parts, &v1::QueryResult::mutable_ray), ray.wanted() == v1::RayQuery::ALL,
             from_proto(ray.origin()), from_proto(ray.direction()), world);
  if (ray.wanted() == v1::RayQuery::ANY) result.clear_hits();
  return result;
}

v1::RayHits result_of(const v1::SweepQuery& sweep, Parts& parts, const WorldRegistry& world) {
  return merged(hits_of(parts, &v1::QueryResult::mutable_sweep), /*all=*/false,
                from_proto(sweep.pose().position()), from_proto(sweep.direction()), world);
}

v1::NearBodies result_of(const v1::NearQuery& near, const Parts& parts, const WorldRegistry& world) {
  absl::btree_map<std::uint64_t, double> distances;  // several servers may find the same static body
  for (const v1::PartialResult& part : parts) {
    for (const v1::NearBodies::Found& found : part.result().near().bodies()) {
      const auto [place, is_new] = distances.try_emplace(found.id(), found.distance());
      if (!is_new) place->second = std::min(place->second, found.distance());
    }
  }
  std::vector<std::pair<double, std::uint64_t>> nearest;
  for (const auto& [body, distance] : distances) nearest.emplace_back(distance, body);
  std::sort(nearest.begin(), nearest.end());
  v1::NearBodies result;
  result.set_truncated(nearest.size() > near.limit());
  if (nearest.size() > near.limit()) nearest.resize(near.limit());
  for (const auto& [distance, body] : nearest) {
    v1::NearBodies::Found& found = *result.add_bodies();
    found.set_id(body);
    found.set_distance(distance);
    if (const auto* entry = world.find(BodyId{body})) found.set_name(entry->name);
  }
  return result;
}

// A query that servers are asked as it was checked.
template <typename Checked, typename Result>
absl::StatusOr<AskedQuery> as_checked(absl::StatusOr<Checked> query, Checked* (v1::Query::*field)(),
                                      Result* (v1::QueryResult::*result_field)()) {
  if (!query.ok()) return query.status();
  AskedQuery ask;
  *(ask.asked.emplace_back().*field)() = *query;
  ask.finish = [query = *std::move(query), result_field](std::span<Parts> parts, const WorldRegistry& world,
                                                         v1::QueryResult& result) {
    *(result.*result_field)() = result_of(query, parts[0], world);
    return absl::OkStatus();
  };
  return ask;
}

}  // namespace

absl::StatusOr<AskedQuery> ask(const v1::RayQuery& query, const WorldRegistry& world) {
  return as_checked(checked(query, world), &v1::Query::mutable_ray, &v1::QueryResult::mutable_ray);
}

absl::StatusOr<AskedQuery> ask(const v1::SweepQuery& query, const WorldRegistry& world) {
  return as_checked(checked(query, world), &v1::Query::mutable_sweep, &v1::QueryResult::mutable_sweep);
}

absl::StatusOr<AskedQuery> ask(const v1::NearQuery& query, const WorldRegistry& world) {
  return as_checked(checked(query, world), &v1::Query::mutable_near, &v1::QueryResult::mutable_near);
}

}  // namespace tessera
