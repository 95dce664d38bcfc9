#include "lpss/partition/contact_patch.h"

#include <limits>
#include <utility>

namespace tessera {
namespace {

// Of points that are about as deep, the first in a direction along which hardly any two are level: rounding
// does not choose.
const TouchingPoint& deepest_of(const std::vector<TouchingPoint>& points) {
  constexpr double kSameDepth = 1e-4;  // m
  const Eigen::Vector3d order(1, 0.618, 0.274);
  double depth = -std::numeric_limits<double>::infinity();
  for (const TouchingPoint& point : points) depth = std::max(depth, point.depth);
  const TouchingPoint* deepest = nullptr;
  for (const TouchingPoint& point : points) {
    if (point.depth < depth - kSameDepth) continue;
    if (deepest == nullptr || order.dot(point.position - deepest->position) > 0) deepest = &point;
  }
  return *deepest;
}

}  // namespace

ContactPatch patch_of(const Partition& partition, const Sector& sector, ContactDetail detail) {
  ContactPatch patch;
  const TouchingPoint deepest = deepest_of(detail.points);
  const absl::StatusOr<WorldPosition> position =
      canonical(sector.index, deepest.position, partition.sector_size());
  if (position.ok()) patch.position = *position;
  patch.depth = deepest.depth;
  Eigen::Map<Eigen::Vector3d>(patch.normal.data()) = detail.normal;
  patch.impulse = detail.impulse;
  Eigen::Map<Eigen::Vector3d>(patch.friction.data()) = detail.friction;
  patch.points = std::move(detail.points);
  for (TouchingPoint& point : patch.points) point.position -= deepest.position;
  return patch;
}

}  // namespace tessera
