// What mechanics says of the bodies and joints of a world at one moment.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <span>
#include <vector>

#include "lpss/model/joint.h"
#include "lpss/model/world_description.h"

namespace tessera {

struct Mechanics {
  double kinetic = 0;                                  // J, with that of the armature of joints
  double potential = 0;                                // J, of weight alone; 0 around a planet
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();  // kg m/s
  Eigen::Vector3d angular_momentum =
      Eigen::Vector3d::Zero();     // kg m^2/s, about the centre of the anchor's sector
  double gap = 0;                  // m, the largest of a joint; infinite if one is no number
  double twist = 0;                // rad, likewise
  std::vector<JointState> joints;  // in the order of the world

  double energy() const { return kinetic + potential; }
};

// Looks at the bodies of one world, whatever simulates it. No body or joint may come or go.
class MechanicsOfWorld {
 public:
  // Errors as records_of() and joint_records_of().
  static absl::StatusOr<MechanicsOfWorld> create(const WorldDescription& world);

  // `bodies`: all that can move. Solvers take velocities in the middle of their last step: `lag` is half of
  // it (s), by which heights are taken back.
  Mechanics at(std::span<const BodyRecord> bodies, double lag = 0);

 private:
  JointSide side(BodyId id) const;

  WorldSettings settings_;
  SectorIndex anchor_;
  std::vector<BodyRecord> bodies_;  // all of the world, as last seen; by id
  std::vector<JointRecord> joints_;
};

}  // namespace tessera
