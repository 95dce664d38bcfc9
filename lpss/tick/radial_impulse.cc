#include "lpss/tick/radial_impulse.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "lpss/partition/packing.h"

namespace tessera {
namespace {

// In sectors, how far outside of its home a body is looked for.
constexpr double kOutsideMax = 1;

class Burst {
 public:
  Burst(const Partition& partition, const ApplyRadialImpulse& command)
      : command_(command), centre_(command.centre.data()), size_(partition.sector_size()) {}

  // Calls visit(index) for the sectors whose bodies it may reach.
  template <typename Visit>
  void for_each_sector(const Visit& visit) const {
    const double half = (0.5 + kOutsideMax) * size_;
    const auto first = [&](double x) { return static_cast<std::int64_t>(std::ceil((x - half) / size_)); };
    const auto last = [&](double x) { return static_cast<std::int64_t>(std::floor((x + half) / size_)); };
    const Eigen::Vector3d low = centre_.array() - command_.radius;
    const Eigen::Vector3d high = centre_.array() + command_.radius;
    for (std::int64_t i = first(low.x()); i <= last(high.x()); ++i) {
      for (std::int64_t j = first(low.y()); j <= last(high.y()); ++j) {
        for (std::int64_t k = first(low.z()); k <= last(high.z()); ++k) {
          const absl::StatusOr<SectorIndex> index = translated(command_.sector, {i, j, k});
          if (index.ok()) visit(*index);
        }
      }
    }
  }

  // On a body at `position` (m, from the centre of `home`). Nothing where it does not reach it.
  std::optional<Eigen::Vector3d> push(const BodyProperties& properties, const SectorIndex& home,
                                      const Eigen::Vector3d& position) const {
    if (properties.motion != Motion::kDynamic || (properties.category & command_.mask) == 0)
      return std::nullopt;
    const Eigen::Vector3d arm = metres_between(command_.sector, home, size_) + (position - centre_);
    const double distance = arm.norm();
    if (!(distance < command_.radius) || distance == 0) return std::nullopt;
    return arm / distance * (command_.impulse * (1 - distance / command_.radius));
  }

 private:
  const ApplyRadialImpulse& command_;
  const Eigen::Vector3d centre_;
  const double size_;
};

bool reaches_packed(const Partition& partition, const SectorIndex& index, const Burst& burst) {
  bool any = false;
  partition.packed.for_each_body(index, [&](const BodyRecord& record) {
    const Eigen::Vector3d position(record.state.position.data());
    any = any || burst.push(record.properties, index, position).has_value();
  });
  return any;
}

}  // namespace

std::vector<RadialPush> pushes_of(Partition& partition, const ApplyRadialImpulse& command,
                                  const Landings& landings) {
  const Burst burst(partition, command);
  std::vector<RadialPush> pushes;
  burst.for_each_sector([&](const SectorIndex& index) {
    if (partition.packed.contains(index) && reaches_packed(partition, index, burst))
      bring_back(partition, index);
    const auto found = partition.sectors.find(index);
    if (found == partition.sectors.end()) return;
    for (HomeBody* const body : found->second->homes) {
      if (landings.contains(body->id)) continue;
      const Eigen::Vector3d position = found->second->world->position(body->slot);
      if (const auto impulse = burst.push(body->properties, index, position))
        pushes.push_back({body, *impulse});
    }
  });
  landings.for_each([&](BodyId id) {
    const auto found = partition.bodies.find(id);
    if (found == partition.bodies.end()) return;
    const BodyRecord landed = landings.record(partition, *found->second);
    const Eigen::Vector3d position(landed.state.position.data());
    if (const auto impulse = burst.push(landed.properties, landed.home, position))
      pushes.push_back({found->second.get(), *impulse});
  });
  return pushes;
}

}  // namespace tessera
