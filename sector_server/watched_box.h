// The box of the world that a client watches.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>

#include "proto/convert.h"

namespace tessera {

// The whole world if the request has no region.
class WatchedBox {
 public:
  template <typename Request>
  WatchedBox(const Request& request, double sector_size) : sector_size_(sector_size) {
    if (!request.has_region()) return;
    centre_ = from_proto(request.region().centre());
    half_ = from_proto(request.region().half_size());
  }

  bool holds(const WorldPosition& position) const {
    return !centre_ || (away(position).array() <= half_.array()).all();
  }
  // From 1 at its centre down to kFarthest; 1 everywhere if it is the whole world.
  double nearness(const WorldPosition& position) const {
    constexpr double kFarthest = 1.0 / 16;
    if (!centre_) return 1;
    const double distance = 2 * away(position).norm() / std::max(half_.maxCoeff(), 1e-6);
    return std::max(1 / (1 + distance * distance), kFarthest);
  }
  // False only if no body of the sector can be in the box; bodies may be slightly beyond the sector's
  // borders.
  bool may_hold_bodies_of(const SectorIndex& sector) const {
    return !centre_ ||
           (away({sector, Eigen::Vector3d::Zero()}).array() <= half_.array() + sector_size_).all();
  }

 private:
  Eigen::Vector3d away(const WorldPosition& position) const {
    return (relative_to(position, centre_->sector, sector_size_) - centre_->local).cwiseAbs();
  }

  double sector_size_;
  std::optional<WorldPosition> centre_;
  Eigen::Vector3d half_ = Eigen::Vector3d::Zero();
};

}  // namespace tessera
