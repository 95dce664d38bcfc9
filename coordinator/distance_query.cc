// The distance of two bodies, computed here: servers tell where they are.

#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "coordinator/asked_states.h"
#include "coordinator/limits.h"
#include "coordinator/query_kinds.h"
#include "lpss/model/checks.h"
#include "lpss/observe/shape_distance.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// One of the two.
struct AskedBody {
  BodyId id;
  ShapeRef shape;
};

absl::StatusOr<AskedBody> asked_body(const char* field, bool is_set, const v1::BodyRef& body,
                                     const WorldRegistry& world) {
  if (!is_set) return refused(field, " must be set");
  const absl::StatusOr<BodyId> id = world.resolve(body);
  if (!id.ok()) return in(field, id.status());
  return AskedBody{*id, world.shapes().ref(world.find(*id)->properties.shape)};
}

// Relative to the sector of the first body, however far the other one is.
v1::Distance distance_of(const AskedBody& a, const AskedBody& b, double reach, std::span<const BodyRow> rows,
                         double sector_size) {
  v1::Distance result;
  result.set_beyond(true);
  const BodyRow* const at_a = row_of(rows, a.id);
  const BodyRow* const at_b = row_of(rows, b.id);
  if (at_a == nullptr || at_b == nullptr) return result;
  const SectorIndex& sector = at_a->pose.position.sector;
  const auto posed = [&](const BodyRow& row) {
    return Pose{relative_to(row.pose.position, sector, sector_size), row.pose.orientation};
  };
  const Pose pose_a = posed(*at_a);
  const Pose pose_b = posed(*at_b);
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const double apart = (pose_b.position - pose_a.position).norm() - bounding_radius(*a.shape, origin) -
                       bounding_radius(*b.shape, origin);
  if (apart > reach) return result;
  const std::optional<ShapeDistance> found =
      distance_of(PosedShape{*a.shape, pose_a}, {*b.shape, pose_b}, reach);
  if (!found) return result;
  const auto on_a = canonical(sector, found->on_a, sector_size);
  const auto on_b = canonical(sector, found->on_b, sector_size);
  if (!on_a.ok() || !on_b.ok()) return result;  // beyond the last sector
  result.set_beyond(false);
  result.set_distance(found->gap);
  *result.mutable_on_a() = to_proto(*on_a);
  *result.mutable_on_b() = to_proto(*on_b);
  *result.mutable_normal() = to_proto(found->normal);
  return result;
}

}  // namespace

absl::StatusOr<AskedQuery> ask(const v1::DistanceQuery& query, const WorldRegistry& world) {
  absl::StatusOr<AskedBody> a = asked_body("a", query.has_a(), query.a(), world);
  if (!a.ok()) return a.status();
  absl::StatusOr<AskedBody> b = asked_body("b", query.has_b(), query.b(), world);
  if (!b.ok()) return b.status();
  if (a->id == b->id) return refused("a and b must be two bodies");
  const double size = world.settings().sector_size;
  const double reach = query.reach();
  if (!std::isfinite(reach) || reach < 0 || reach > kReachMax * size) {
    return refused("reach = ", reach, " m must be 0 m to ", kReachMax, " sectors, which are ",
                   kReachMax * size, " m");
  }
  if (absl::Status status = check_distance(*a->shape, *b->shape); !status.ok()) return status;
  AskedQuery ask;
  ask.asked.push_back(ask_states_of({a->id.value, b->id.value}));
  ask.finish = [a = *std::move(a), b = *std::move(b), reach, size](
                   std::span<Parts> parts, const WorldRegistry&, v1::QueryResult& result) {
    const absl::StatusOr<std::vector<BodyRow>> rows = states_of(parts[0]);
    if (rows.ok()) *result.mutable_distance() = distance_of(a, b, reach, *rows, size);
    return rows.status();
  };
  return ask;
}

}  // namespace tessera
