// A convex shape that goes along a line until it touches something. In double precision, as rays.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "lpss/collision/sweep.h"
#include "lpss/native/broad_phase.h"
#include "lpss/native/exact_frame.h"
#include "lpss/native/exact_shape.h"

namespace tessera::native {

class MovingProbe {
 public:
  MovingProbe(const Geometry& geometry, const Pose& pose, const collision::SweepWay& way);
  // A convex part of a body, where it is.
  MovingProbe(const Part& part, const ExactFrame& at, const collision::SweepWay& way);

  bool is_sensible() const;
  BoxOnWay box() const;  // its own

  // Notes where it touches the body, if that is before all that it has been noted to touch.
  void look_at(const Body& body);
  const std::optional<ProbeHit>& hit() const { return hit_; }

  // Whether it touches a part of a body somewhere on its way.
  bool meets(const Part& part, const ExactFrame& at);

 private:
  void measure();
  // The box around its way from `first` to `last` (m), as seen from a frame.
  Bounds bounds_from(const ExactFrame& frame, double first, double last) const;
  void meet(const Part& part, const ExactFrame& frame);
  void meet(const ExactShape& shape, const ExactFrame& frame, const collision::SweepWay& way);
  void meet_terrain(const Part& part, const ExactFrame& frame);
  // Of the way, what may still matter.
  collision::SweepWay limited() const;
  void take(const std::optional<collision::SweepContact>& contact);

  ExactShape shape_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d from_;
  collision::SweepWay way_;
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero();  // m, of its box, from its origin
  Eigen::Vector3d high_ = Eigen::Vector3d::Zero();
  std::vector<std::uint32_t> parts_;
  std::optional<collision::SweepContact> contact_;  // of the body that is looked at
  std::optional<ProbeHit> hit_;
};

}  // namespace tessera::native
