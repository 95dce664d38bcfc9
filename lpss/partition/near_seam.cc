#include "lpss/partition/near_seam.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

namespace tessera {
namespace {

// Of L: wide enough that a resting body's jitter does not cross it, narrow against the precision margin.
constexpr double kHysteresisShare = 1.0 / 512;

// How many sectors, along one axis, `place` (m) is beyond that around 0; the nearest ones without a division.
std::int64_t cells_beyond(double place, double size) {
  constexpr double kCellsMax = 1 << 30;  // also of what is not a number
  if (std::abs(place) < 0.5 * size) return 0;
  if (place >= 0.5 * size && place < 1.5 * size) return 1;
  const double cells = std::floor(place / size + 0.5);
  return static_cast<std::int64_t>(std::max(-kCellsMax, std::min(cells, kCellsMax)));
}

// The sectors that a box comes near to.
struct Cells {
  Cells(const Eigen::AlignedBox3d& box, const SeamMargins& margins) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = -cells_beyond(margins.reach - box.min()[axis], margins.sector_size);
      high[axis] = cells_beyond(box.max()[axis] + margins.reach, margins.sector_size);
    }
  }

  bool has(const SectorOffset& offset) const {
    return offset.i >= low[0] && offset.i <= high[0] && offset.j >= low[1] && offset.j <= high[1] &&
           offset.k >= low[2] && offset.k <= high[2];
  }
  // Calls visit(offset) for each but the home.
  template <typename Visit>
  void for_each(const Visit& visit) const {
    for (std::int64_t i = low[0]; i <= high[0]; ++i) {
      for (std::int64_t j = low[1]; j <= high[1]; ++j) {
        for (std::int64_t k = low[2]; k <= high[2]; ++k) {
          if (i != 0 || j != 0 || k != 0) visit(SectorOffset{i, j, k});
        }
      }
    }
  }

  std::int64_t low[3];
  std::int64_t high[3];
};

// Those near a body's way, piece by piece. No axis turns back: what a piece shares with any before, it shares
// with the last one.
std::vector<SectorOffset> sectors_along(const Eigen::AlignedBox3d& start, const Eigen::Vector3d& way,
                                        const SeamMargins& margins) {
  std::vector<SectorOffset> all;
  const double pieces = std::ceil(way.cwiseAbs().maxCoeff() / margins.sector_size);
  std::optional<Cells> last;
  for (int n = 0; n < std::min<double>(pieces, kWayPiecesMax); ++n) {
    Eigen::AlignedBox3d piece = start.translated(way * (n / pieces));
    piece.extend(start.translated(way * ((n + 1) / pieces)));
    const Cells cells(piece, margins);
    cells.for_each([&](const SectorOffset& offset) {
      if (!last || !last->has(offset)) all.push_back(offset);
    });
    last = cells;
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

SeamMargins seam_margins(double sector_size, double time_step, double radius_max) {
  SeamMargins margins;
  margins.sector_size = sector_size;
  margins.hysteresis = sector_size * kHysteresisShare;
  // Two ticks pass between the tick that carries a body over its border and the one that changes its home.
  margins.usual_way = std::min(time_step * kSeamSpeed, sector_size / 8);
  const double late = 2 * margins.usual_way;
  margins.reach = std::min(radius_max, sector_size / 2) + margins.hysteresis + late;
  return margins;
}

OffsetSet sectors_within_reach(const Eigen::AlignedBox3d& swept, const Eigen::Vector3d& way,
                               const SeamMargins& margins) {
  OffsetSet result;
  if (way.cwiseAbs().maxCoeff() > margins.sector_size) {
    const Eigen::AlignedBox3d start(swept.min() - way.cwiseMin(0), swept.max() - way.cwiseMax(0));
    return OffsetSet(sectors_along(start, way, margins));
  }
  Cells(swept, margins).for_each([&](const SectorOffset& offset) { result.insert(offset); });
  return result;
}

OffsetSet homes_of_slower(const Eigen::AlignedBox3d& swept, const Eigen::Vector3d& way,
                          const SeamMargins& margins, double surge) {
  OffsetSet result;
  const double length = way.norm() + surge;
  if (!(length <= kChaseMax * margins.sector_size)) return result;
  const Eigen::AlignedBox3d end(swept.min() + way.cwiseMax(0), swept.max() + way.cwiseMin(0));
  const Eigen::Vector3d around = Eigen::Vector3d::Constant(length);
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(margins.sector_size / 2 + margins.reach);
  const Cells near({end.min() - around, end.max() + around}, margins);
  near.for_each([&](const SectorOffset& offset) {
    const Eigen::Vector3d centre =
        margins.sector_size * Eigen::Vector3d(static_cast<double>(offset.i), static_cast<double>(offset.j),
                                              static_cast<double>(offset.k));
    const Eigen::AlignedBox3d reached(centre - half, centre + half);
    if (reached.squaredExteriorDistance(end) <= length * length) result.insert(offset);
  });
  return result;
}

OffsetSet clone_targets(const OffsetSet& within_reach, Motion motion, bool is_fast) {
  const bool everywhere = motion == Motion::kKinematic || is_fast;
  return everywhere ? within_reach : within_reach.lower();
}

const SectorIndex& detecting_sector(Motion motion_a, const SectorIndex& home_a, Motion motion_b,
                                    const SectorIndex& home_b) {
  if (motion_a != Motion::kDynamic) return home_b;
  if (motion_b != Motion::kDynamic) return home_a;
  return std::min(home_a, home_b);
}

const SectorIndex& sensing_sector(Motion motion_a, const SectorIndex& home_a, Motion motion_b,
                                  const SectorIndex& home_b) {
  if (motion_a == Motion::kStatic) return home_b;
  if (motion_b == Motion::kStatic) return home_a;
  if (motion_a == motion_b) return std::min(home_a, home_b);
  return motion_a == Motion::kDynamic ? home_a : home_b;
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

std::optional<SectorOffset> leaves_home(const Eigen::Vector3d& position, const Eigen::Vector3d& way,
                                        Motion motion, const SeamMargins& margins) {
  const bool is_foreseen = motion == Motion::kDynamic && is_fast(way, margins);
  return leaves_home(is_foreseen ? Eigen::Vector3d(position + way) : position, margins);
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
