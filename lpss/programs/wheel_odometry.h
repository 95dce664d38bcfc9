// Where a robot is by how far its wheels have turned, as seen from where it started.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "lpss/base/portable_math.h"
#include "lpss/programs/driven_joint.h"

namespace tessera {

// Numbers of a program.
struct WheelOdometry {
  double& x;        // m, along where it pointed when it started
  double& y;        // m, to the left of that
  double& heading;  // rad
  double& left;     // rad, where the wheels were
  double& right;
  double& runs;  // 1 once these are known
};

// Takes what two wheels of one radius have rolled since the last tick, `apart` (m) from each other.
inline void roll(const SensedJoint& left, const SensedJoint& right, double radius, double apart,
                 const WheelOdometry& odometry) {
  const auto rolled = [&](const SensedJoint& wheel, double& before) {
    const double now = wheel.state.position[0];
    const double way = odometry.runs == 0 ? 0 : radius * std::remainder(now - before, 2 * std::numbers::pi);
    before = now;
    return way;
  };
  const double left_way = rolled(left, odometry.left);
  const double right_way = rolled(right, odometry.right);
  odometry.runs = 1;
  const double turn = (right_way - left_way) / apart;
  // The chord of an arc, which is so short that the series of sin(h) / h needs no third part.
  const double way = (left_way + right_way) / 2 * (1 - turn * turn / 24);
  const auto [sin, cos] = portable::sincos(odometry.heading + turn / 2);
  odometry.x += way * cos;
  odometry.y += way * sin;
  odometry.heading += turn;
}

}  // namespace tessera
