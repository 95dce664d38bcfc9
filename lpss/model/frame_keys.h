// Paths of frames through keys: times at which a frame is at given places, turned in given ways.
//
// Between two keys, the place is a cubic polynomial of time, and so is the rotation vector from the first of
// the two orientations (Kang and Park, Cubic spline algorithms for orientation interpolation, 1999).
// Velocities, spins and accelerations are the derivatives of these, in closed form.
#pragma once

#include <vector>

#include "lpss/model/frame_motion.h"

namespace tessera {

// Gives keys the velocities and spins that they lack: those with which accelerations, and angular ones, do
// not jump at these keys. Without `loops`, the first key and the last are at rest unless they say otherwise;
// with it, both have the same. Of keys that are not valid, it makes something that is not valid either.
void smooth_keys(std::vector<FrameKey>& keys, bool loops);

// The motion at `time`, s since tick 0, of a frame with keys, which have all velocities; along the axes of
// its parent.
FrameMotion motion_along_keys(const MovingFrame& frame, double time);

// Whether a frame, or one of those that it moves in, has keys: what is felt in it changes within a tick.
bool follows_keys(const WorldSettings& settings, const MovingFrame& frame);

}  // namespace tessera
