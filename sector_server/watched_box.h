// The box of the world that a client watches.
#pragma once

#include <Eigen/Core>
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
