// Rays in columns: each server tells the first hits in its sectors, and the nearest counts.

#include <optional>
#include <utility>

#include "coordinator/query_checks.h"
#include "coordinator/query_kinds.h"
#include "lpss/observe/queries.h"
#include "proto/convert.h"
#include "proto/ray_columns.h"

namespace tessera {
namespace {

absl::Status check_told(const Parts& parts, int rays) {
  for (const v1::PartialResult& part : parts) {
    const v1::HitColumns& told = part.result().rays();
    if (told.bodies_size() != rays || told.distances_size() != rays || told.normals_size() != 3 * rays)
      return absl::DataLossError("hits of rays in columns of other lengths");
  }
  return absl::OkStatus();
}

std::optional<RayAnswer> first_of(const Parts& parts, int ray) {
  std::optional<RayAnswer> first;
  for (const v1::PartialResult& part : parts) {
    const v1::HitColumns& told = part.result().rays();
    if (told.bodies(ray) == 0) continue;
    const RayAnswer answer{BodyId{told.bodies(ray)}, told.distances(ray),
                           Eigen::Vector3d(&told.normals().Get(3 * ray))};
    if (!first || order_of(answer) < order_of(*first)) first = answer;
  }
  return first;
}

void write(const RayReader& rays, const Parts& parts, double sector_size, v1::HitColumns& result) {
  HitWriter writer(result);
  writer.reserve(rays.size());
  for (int n = 0; n < rays.size(); ++n) {
    HitRow hit;
    if (const std::optional<RayAnswer> first = first_of(parts, n)) {
      const RayRow ray = rays[n];
      const auto position =
          canonical(ray.origin.sector, ray.origin.local + first->distance * ray.direction, sector_size);
      hit = {first->body, first->distance, position.value_or(WorldPosition()), first->normal};
    }
    writer.add(hit);
  }
}

}  // namespace

absl::StatusOr<AskedQuery> ask(const v1::RaysQuery& query, const WorldRegistry& world) {
  absl::StatusOr<v1::RaysQuery> rays = checked(query, world);
  if (!rays.ok()) return rays.status();
  AskedQuery ask;
  *ask.asked.emplace_back().mutable_rays() = *rays;
  ask.finish = [rays = *std::move(rays)](std::span<Parts> parts, const WorldRegistry& world_now,
                                         v1::QueryResult& result) {
    const absl::StatusOr<RayReader> asked = RayReader::of(rays);
    if (!asked.ok()) return asked.status();
    if (absl::Status status = check_told(parts[0], asked->size()); !status.ok()) return status;
    write(*asked, parts[0], world_now.settings().sector_size, *result.mutable_rays());
    return absl::OkStatus();
  };
  return ask;
}

}  // namespace tessera
