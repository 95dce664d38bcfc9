// Measurements that several scenes share.
#pragma once

#include "experiments/extremes/scene.h"

namespace tessera::extremes {

inline constexpr double kStandardGravity = 9.81;  // m/s^2

// m; of the body farthest from its start.
double farthest(const Moment& start, const Moment& now);

// m/s; of the fastest body.
double fastest(const Moment& start, const Moment& now);

// How many numbers of the bodies' states are no longer finite.
double numbers_lost(const Moment& start, const Moment& now);

// J; kinetic, and potential above the anchor's centre under `gravity` m/s^2 along -z.
double energy(const Moment& moment, double gravity);

// Change of the energy, relative to that at the start.
Figure energy_change(double gravity);

// Its increase, relative to that at the start; 0 or less if there is none.
Figure energy_gain(double gravity);

// kg m^2/s, about the body's own centre.
Eigen::Vector3d angular_momentum(const BodyRecord& body);

}  // namespace tessera::extremes
