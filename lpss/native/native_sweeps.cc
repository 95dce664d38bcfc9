// Probes of clients, which go along a line until they touch something.

#include <algorithm>

#include "lpss/native/moving_probe.h"
#include "lpss/native/native_world.h"

namespace tessera::native {

std::vector<BodySlot> NativeWorld::bodies_along(const BoxOnWay& way, const QueryFilter& filter) const {
  refresh_bounds();
  std::vector<BodySlot> near;
  broad_phase_.for_each_along(way, [&](BodySlot slot) {
    const Body& other = body(slot);
    if (other.role != Role::kClone && filter.wants(other.id, other.category)) near.push_back(slot);
  });
  std::sort(near.begin(), near.end(), [&](BodySlot a, BodySlot b) { return body(a).id < body(b).id; });
  return near;
}

std::optional<ProbeHit> NativeWorld::sweep(const Geometry& geometry, const Pose& pose,
                                           const Eigen::Vector3d& direction, double length,
                                           const QueryFilter& filter) const {
  MovingProbe probe(geometry, pose, {direction, length});
  if (!probe.is_sensible()) return std::nullopt;
  for (const BodySlot slot : bodies_along(probe.box(), filter)) probe.look_at(body(slot));
  return probe.hit();
}

}  // namespace tessera::native
