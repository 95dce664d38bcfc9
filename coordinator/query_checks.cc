#include "coordinator/query_checks.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "coordinator/limits.h"
#include "lpss/model/checks.h"
#include "lpss/model/limits.h"
#include "lpss/model/validate.h"
#include "proto/convert.h"
#include "proto/ray_columns.h"

namespace tessera {
namespace {

// How errors call what a way is made of.
struct WayNames {
  std::string origin = "origin";
  std::string direction = "direction";
  std::string length = "length";
  std::string end = "the end of the way";
};

absl::StatusOr<Eigen::Vector3d> unit_direction(Eigen::Vector3d direction,
                                               const std::string& name = "direction") {
  if (absl::Status status = finite(name, direction); !status.ok()) return status;
  const double largest = direction.cwiseAbs().maxCoeff();
  if (largest == 0) return refused(name, " = (0, 0, 0) must not be zero");
  direction /= largest;  // so that no square underflows or overflows
  return direction.normalized();
}

// A way from an origin that was checked, which is in bounds with its end; the direction as a unit vector.
absl::StatusOr<Eigen::Vector3d> checked_way(const WorldPosition& origin, const Eigen::Vector3d& along,
                                            double length, double size, const WayNames& names = {}) {
  absl::StatusOr<Eigen::Vector3d> direction = unit_direction(along, names.direction);
  if (!direction.ok()) return direction.status();
  if (!std::isfinite(length) || length <= 0 || length > kRayLengthMax)
    return refused(names.length, " = ", length, " m must be above 0 m and at most ", kRayLengthMax, " m");
  const double length_max = kRaySectorsMax * size / direction->lpNorm<1>();
  if (length > length_max) {
    return refused(names.length, " = ", length, " m must be at most ", length_max,
                   " m: in this direction, the way then passes through ", kRaySectorsMax, " sectors");
  }
  const auto end = canonical(origin.sector, origin.local + length * *direction, size);
  if (!end.ok()) return in(names.end, end.status());
  return direction;
}

absl::StatusOr<RayRow> checked_ray(const RayRow& ray, double size, const WayNames& names = {}) {
  const absl::StatusOr<WorldPosition> origin = canonical(ray.origin.sector, ray.origin.local, size);
  if (!origin.ok()) return in(names.origin, origin.status());
  const absl::StatusOr<Eigen::Vector3d> direction =
      checked_way(*origin, ray.direction, ray.length, size, names);
  if (!direction.ok()) return direction.status();
  return RayRow{*origin, *direction, ray.length, ray.except};
}

WayNames names_in_columns(int ray) {
  return {absl::StrCat("origins[", ray, "]"), absl::StrCat("directions[", ray, "]"),
          absl::StrCat("lengths[", ray, "]"), absl::StrCat("the end of ray ", ray)};
}

// Where a convex probe is: it is checked like a moving body.
absl::StatusOr<WorldPose> checked_probe(const v1::Geometry& geometry, const v1::WorldPose& at,
                                        const WorldRegistry& world) {
  v1::Shape message;
  *message.add_parts()->mutable_geometry() = geometry;
  absl::StatusOr<Shape> shape = from_proto(message);
  if (!shape.ok()) return shape.status();
  if (absl::Status status = validate(*shape, "probe"); !status.ok()) return status;
  BodyDescription probe;
  probe.name = "probe";
  probe.properties.motion = Motion::kKinematic;
  probe.pose = from_proto(at);
  if (absl::Status status = validate(probe, *shape, world.settings()); !status.ok()) return status;
  const absl::StatusOr<WorldPosition> position =
      canonical(probe.pose.position.sector, probe.pose.position.local, world.settings().sector_size);
  if (!position.ok()) return position.status();
  return WorldPose{*position, probe.pose.orientation.normalized()};
}

// What all have in common.
template <typename Query>
void take_filter(const Query& query, const WorldRegistry& world, Query& checked) {
  checked.set_mask(query.mask() == 0 ? 0xffffffff : query.mask());
  std::vector<std::uint64_t> ids;
  for (const v1::BodyRef& body : query.except()) {
    if (const absl::StatusOr<BodyId> id = world.resolve(body); id.ok()) ids.push_back(id->value);
  }
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  for (const std::uint64_t id : ids) checked.add_except()->set_id(id);
}

std::uint64_t ids_of(const v1::Query& query) {
  const int ids = query.ray().except_size() + query.sweep().except_size() + query.near().except_size() +
                  query.states().ids_size() + query.joint_states().ids_size() +
                  query.find_bodies().ids_size() + query.contacts().bodies_size() +
                  query.rays().except_size() + query.rays().except_by_ray_size();
  return static_cast<std::uint64_t>(ids);
}

// Sectors, about; a way that is out of bounds by itself counts for nothing here.
double sectors_of(const Eigen::Vector3d& along, double length, double sector_size) {
  const absl::StatusOr<Eigen::Vector3d> direction = unit_direction(along);
  if (!direction.ok()) return 0;
  const double sectors = length * direction->lpNorm<1>() / sector_size;
  return sectors > 0 && sectors <= kRaySectorsMax ? sectors : 0;
}

double sectors_of(const v1::Query& query, double sector_size) {
  if (query.has_ray())
    return sectors_of(from_proto(query.ray().direction()), query.ray().length(), sector_size);
  if (query.has_sweep())
    return sectors_of(from_proto(query.sweep().direction()), query.sweep().length(), sector_size);
  const absl::StatusOr<RayReader> rays = RayReader::of(query.rays());
  if (!rays.ok()) return 0;
  double sectors = 0;
  for (int n = 0; n < rays->size(); ++n)
    sectors += sectors_of((*rays)[n].direction, (*rays)[n].length, sector_size);
  return sectors;
}

std::uint64_t rays_of(const v1::Query& query) {
  const absl::StatusOr<RayReader> rays = RayReader::of(query.rays());
  return rays.ok() ? static_cast<std::uint64_t>(rays->size()) : 0;
}

}  // namespace

absl::Status check_work(const google::protobuf::RepeatedPtrField<v1::Query>& queries, double sector_size) {
  std::uint64_t ids = 0;
  std::uint64_t rays = 0;
  for (const v1::Query& query : queries) {
    ids += ids_of(query);
    rays += rays_of(query);
  }
  if (ids > kIdsPerRequestMax) return refused("queries: ", ids, " ids must be at most ", kIdsPerRequestMax);
  if (rays > kRaysPerRequestMax)
    return refused("queries: ", rays, " rays in columns must be at most ", kRaysPerRequestMax);
  double sectors = 0;
  for (const v1::Query& query : queries) sectors += sectors_of(query, sector_size);
  if (sectors <= static_cast<double>(kWaySectorsPerRequestMax)) return absl::OkStatus();
  return refused("queries: the ways of rays and sweeps pass through ", static_cast<std::uint64_t>(sectors),
                 " sectors in all, and may pass through ", kWaySectorsPerRequestMax, " in one request");
}

absl::StatusOr<v1::RayQuery> checked(const v1::RayQuery& query, const WorldRegistry& world) {
  if (!query.has_origin()) return refused("origin must be set");
  const absl::StatusOr<RayRow> way =
      checked_ray({from_proto(query.origin()), from_proto(query.direction()), query.length()},
                  world.settings().sector_size);
  if (!way.ok()) return way.status();
  if (!v1::RayQuery::Wanted_IsValid(query.wanted()))
    return refused("wanted = ", static_cast<int>(query.wanted()), " must be FIRST, ALL or ANY");
  v1::RayQuery ray;
  *ray.mutable_origin() = to_proto(way->origin);
  *ray.mutable_direction() = to_proto(way->direction);
  ray.set_length(way->length);
  ray.set_wanted(query.wanted());
  take_filter(query, world, ray);
  return ray;
}

absl::StatusOr<v1::RaysQuery> checked(const v1::RaysQuery& query, const WorldRegistry& world) {
  const absl::StatusOr<RayReader> given = RayReader::of(query);
  if (!given.ok()) return given.status();
  const double size = world.settings().sector_size;
  v1::RaysQuery rays;
  RayWriter writer(rays);
  writer.reserve(given->size());
  const WayNames names;
  for (int n = 0; n < given->size(); ++n) {
    const absl::StatusOr<RayRow> ray = checked_ray((*given)[n], size, names);
    if (!ray.ok()) return checked_ray((*given)[n], size, names_in_columns(n)).status();
    writer.add(*ray);
  }
  take_filter(query, world, rays);
  return rays;
}

absl::StatusOr<v1::SweepQuery> checked(const v1::SweepQuery& query, const WorldRegistry& world) {
  if (!query.has_pose()) return refused("pose must be set");
  if (!query.has_probe()) return refused("probe must be set");
  const absl::StatusOr<WorldPose> pose = checked_probe(query.probe(), query.pose(), world);
  if (!pose.ok()) return pose.status();
  const absl::StatusOr<Eigen::Vector3d> direction = checked_way(pose->position, from_proto(query.direction()),
                                                                query.length(), world.settings().sector_size);
  if (!direction.ok()) return direction.status();
  v1::SweepQuery sweep;
  *sweep.mutable_pose() = to_proto(*pose);
  *sweep.mutable_probe() = query.probe();
  *sweep.mutable_direction() = to_proto(*direction);
  sweep.set_length(query.length());
  take_filter(query, world, sweep);
  return sweep;
}

// A point is a tiny ball.
absl::StatusOr<v1::NearQuery> checked(const v1::NearQuery& query, const WorldRegistry& world) {
  constexpr double kPointRadius = 1e-3;  // m
  if (!query.has_pose()) return refused("pose must be set");
  v1::NearQuery near;
  if (query.has_probe()) {
    *near.mutable_probe() = query.probe();
  } else {
    near.mutable_probe()->mutable_sphere()->set_radius(kPointRadius);
  }
  const absl::StatusOr<WorldPose> pose = checked_probe(near.probe(), query.pose(), world);
  if (!pose.ok()) return pose.status();
  const double size = world.settings().sector_size;
  const double reach = query.reach();
  if (!std::isfinite(reach) || reach < 0 || reach > kReachMax * size) {
    return refused("reach = ", reach, " m must be 0 m to ", kReachMax, " sectors, which are ",
                   kReachMax * size, " m");
  }
  *near.mutable_pose() = to_proto(*pose);
  near.set_reach(reach);
  near.set_limit(std::min(query.limit() == 0 ? kFoundBodiesDefault : query.limit(), kFoundBodiesMax));
  take_filter(query, world, near);
  return near;
}

}  // namespace tessera
