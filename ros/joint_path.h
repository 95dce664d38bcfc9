// A trajectory of joints: where each should be at a time.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstddef>
#include <string>
#include <vector>

#include "trajectories.h"

namespace tessera::ros {

inline constexpr std::size_t kPathPointsMax = 10'000;

class JointPath {
 public:
  // Of a message. INVALID_ARGUMENT, with the field, for a name that comes twice, points that are not after
  // each other in time or are more than kPathPointsMax, and numbers that are not finite or not one for each
  // joint.
  static absl::StatusOr<JointPath> from(const trajectory_msgs_msg_dds__JointTrajectory_& message);

  const std::vector<std::string>& joints() const { return joints_; }
  double seconds() const { return points_.back().time; }  // until its last point
  const std::vector<double>& goal() const { return points_.back().positions; }

  // Where the joints are at its beginning (rad or m, by joints()), if its first point is later.
  void begin_at(const std::vector<double>& positions);
  // Where they should be `seconds` after its beginning: on cubic curves between points that both have
  // velocities, and straight otherwise. Beyond the last point, there.
  std::vector<double> at(double seconds) const;

 private:
  struct Point {
    double time = 0;
    std::vector<double> positions;
    std::vector<double> velocities;  // none, or as many
  };

  std::vector<std::string> joints_;
  std::vector<Point> points_;  // at least one
};

}  // namespace tessera::ros
