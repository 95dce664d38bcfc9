// Lossless positions of any size: a sector index and a small displacement.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "lpss/base/pose.h"
#include "lpss/grid/sector_index.h"

namespace tessera {

// A point of the world: `local` metres from the centre of `sector`, along the world's axes.
// In canonical form every component of `local` lies in [-L/2, L/2).
//
// Paper, Eq. (1) and (2), with the rounding that makes the two agree: s = floor(x / L + 1/2), x = d + s * L.
struct WorldPosition {
  SectorIndex sector;
  Eigen::Vector3d local = Eigen::Vector3d::Zero();

  friend bool operator==(const WorldPosition&, const WorldPosition&) = default;
};

// A frame of the world: a position and the rotation from the frame to the world's axes.
struct WorldPose {
  WorldPosition position;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

// The number of whole sectors that a displacement `x` (metres, from some sector's centre) lies away from that
// sector, per axis: Eq. (1). OUT_OF_RANGE if it is not finite or the result does not fit in 64 bits.
absl::StatusOr<SectorOffset> sectors_from(const Eigen::Vector3d& x, double sector_size);

// The canonical form of the point `local` metres from the centre of `sector`; `local` may have any finite
// size. The displacement of a point in canonical form is returned bit for bit.
// INVALID_ARGUMENT for a component that is not finite, OUT_OF_RANGE if the index exceeds 64 bits.
absl::StatusOr<WorldPosition> canonical(const SectorIndex& sector, const Eigen::Vector3d& local,
                                        double sector_size);

// The displacement of `point` from the centre of `sector`, in metres: exact up to one rounding if the two
// are close, which is the only case in which precision matters.
Eigen::Vector3d relative_to(const WorldPosition& point, const SectorIndex& sector, double sector_size);

// `frame` followed by `child`: the world pose of a frame given relative to another. Errors as canonical().
absl::StatusOr<WorldPose> compose(const WorldPose& frame, const Pose& child, double sector_size);

}  // namespace tessera
