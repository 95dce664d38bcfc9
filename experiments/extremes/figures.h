// What is measured of scenes: figures that several of them share.
#pragma once

#include "experiments/extremes/scene.h"

namespace tessera::extremes {

inline constexpr double kStandardGravity = 9.81;  // m/s^2

// m; of the body that is farthest from its start.
double farthest(const Moment& start, const Moment& now);

// m/s; of the fastest body.
double fastest(const Moment& start, const Moment& now);

// How many numbers of the bodies' states are none any longer.
double numbers_lost(const Moment& start, const Moment& now);

// J; of motion, and of height above the anchor's centre under `gravity` m/s^2 along -z.
double energy(const Moment& moment, double gravity);

// By which share the energy of the start has changed.
Figure energy_change(double gravity);

// By which share it has grown; 0 or less where it has not.
Figure energy_gain(double gravity);

// kg m^2/s, about the body's own centre.
Eigen::Vector3d angular_momentum(const BodyRecord& body);

}  // namespace tessera::extremes
