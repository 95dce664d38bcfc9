#include "lpss/partition/near_seam.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

// Of L: wide enough that a resting body's jitter does not cross it, narrow against the precision margin.
constexpr double kHysteresisShare = 1.0 / 512;

// How many sectors, along one axis, `place` (m) is beyond that around 0; the nearest ones without a division.
int cells_beyond(double place, double size) {
  if (std::abs(place) < 0.5 * size) return 0;
  if (place >= 0.5 * size && place < 1.5 * size) return 1;
  const double cells = std::floor(place / size + 0.5);
  return static_cast<int>(std::clamp(cells, -double{OffsetSet::kReach}, double{OffsetSet::kReach}));
}

}  // namespace

SeamMargins seam_margins(double sector_size, double time_step, double radius_max) {
  SeamMargins margins;
  margins.sector_size = sector_size;
  margins.hysteresis = sector_size * kHysteresisShare;
  // Two ticks pass between the tick that carries a body over its border and the one that changes its home.
  const double late = std::min(2 * time_step * kSeamSpeed, sector_size / 4);
  margins.reach = std::min(radius_max, sector_size / 2) + margins.hysteresis + late;
  return margins;
}

OffsetSet sectors_within_reach(const Eigen::AlignedBox3d& swept, const SeamMargins& margins) {
  int low[3];
  int high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = -cells_beyond(margins.reach - swept.min()[axis], margins.sector_size);
    high[axis] = cells_beyond(swept.max()[axis] + margins.reach, margins.sector_size);
  }
  OffsetSet result;
  for (int i = low[0]; i <= high[0]; ++i) {
    for (int j = low[1]; j <= high[1]; ++j) {
      for (int k = low[2]; k <= high[2]; ++k) {
        if (i != 0 || j != 0 || k != 0) result.insert(i, j, k);
      }
    }
  }
  return result;
}

OffsetSet clone_targets(const OffsetSet& within_reach, SeamPolicy policy, Motion motion) {
  const bool everywhere = policy == SeamPolicy::kClone || motion == Motion::kKinematic;
  return everywhere ? within_reach : within_reach.lower();
}

const SectorIndex& detecting_sector(Motion motion_a, const SectorIndex& home_a, Motion motion_b,
                                    const SectorIndex& home_b) {
  if (motion_a != Motion::kDynamic) return home_b;
  if (motion_b != Motion::kDynamic) return home_a;
  return std::min(home_a, home_b);
}

std::optional<SectorOffset> leaves_home(const Eigen::Vector3d& position, const SeamMargins& margins) {
  const double limit = margins.sector_size / 2 + margins.hysteresis;
  // Written so that a position that is not a number counts as outside and meets the check in sectors_from().
  const bool inside = position.cwiseAbs().maxCoeff() <= limit;
  if (inside) return std::nullopt;
  const absl::StatusOr<SectorOffset> offset = sectors_from(position, margins.sector_size);
  if (!offset.ok() || *offset == SectorOffset{}) return std::nullopt;
  return *offset;
}

BodyState seen_from(const BodyState& state, const SectorOffset& offset, double sector_size) {
  BodyState moved = state;
  moved.position[0] -= static_cast<double>(offset.i) * sector_size;
  moved.position[1] -= static_cast<double>(offset.j) * sector_size;
  moved.position[2] -= static_cast<double>(offset.k) * sector_size;
  return moved;
}

Eigen::AlignedBox3d swept_ball(const BodyState& state, double radius, double dt) {
  return swept_ball(Eigen::Vector3d(state.position.data()), Eigen::Vector3d(state.linear_velocity.data()),
                    radius, dt);
}

Eigen::AlignedBox3d swept_ball(const Eigen::Vector3d& centre, const Eigen::Vector3d& velocity, double radius,
                               double dt) {
  const Eigen::Vector3d way = velocity * dt;
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(radius);
  Eigen::AlignedBox3d box(centre - margin, centre + margin);
  box.extend(centre + way - margin);
  box.extend(centre + way + margin);
  return box;
}

}  // namespace tessera
