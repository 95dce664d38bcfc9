// Frames that move: trains, ships, habitats. Each has sectors of its own, in which all that detects and
// solves works as in the world's, whatever the frame's speed: what rests in it has no velocity, and sleeps.
//
// What is in a frame meets what is in the same frame alone, and feels what felt.h says. Its place in the
// world follows from the path of the frame, a function of time; or from where its carrier is, a body.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "lpss/grid/world_position.h"
#include "lpss/model/body.h"

namespace tessera {

inline constexpr std::size_t kMovingFramesMax = 256;
inline constexpr std::size_t kFrameLegsMax = 4096;  // of one frame
inline constexpr std::size_t kFrameKeysMax = 4096;  // likewise

// A stretch of a path with one acceleration.
struct FrameLeg {
  double seconds = 0;                                      // > 0
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  // m/s^2, of the origin, axes of the parent
};

// Where a frame is at one time, in the axes that its `start` makes: that places the path as a whole.
struct FrameKey {
  double time = 0;                          // s since tick 0
  Pose pose;                                // m; of the frame
  std::optional<Eigen::Vector3d> velocity;  // m/s, of its origin; none: smooth_keys() finds it
  std::optional<Eigen::Vector3d> spin;      // rad/s, about its origin; likewise
};

// A box along the axes of the frame, m from its origin.
struct FrameRegion {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d size = Eigen::Vector3d::Ones();
};

// What flies freely comes into a frame this far inside of its region, and leaves it this far outside: m.
inline constexpr double kRegionHysteresis = 0.1;

// A body of the parent, dynamic or kinematic, that a frame is fixed to. It stays in that frame.
struct FrameCarrier {
  BodyId body;
  Pose pose;  // of the frame, in the body frame
};

// It moves in the world frame or in one before it, its parent: all is along the axes of that one.
struct MovingFrame {
  std::string name;                                    // unique among them
  WorldPose start;                                     // at tick 0, in sectors of its parent
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s, of the origin at tick 0
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();      // rad/s, about the origin; it stays
  std::optional<FrameRegion> region;                   // none: nothing comes or goes
  // Its origin falls as a body would: on a parabola, or on an orbit around a planet. It has no legs then, and
  // the world frame as its parent.
  bool falls = false;
  std::vector<FrameLeg> legs;  // one after the other, from tick 0 on
  // It goes smoothly through all of these, ascending from time 0 on; see frame_keys.h. It has no velocity and
  // no spin above then, nor legs, and does not fall. After the last, it goes on as it goes there.
  std::vector<FrameKey> keys;
  bool loops = false;  // after the last key, which has the pose of the first, it begins anew
  // It goes where this body goes, and neither falls by itself nor has legs or keys. What is above holds until
  // the end of the first tick.
  std::optional<FrameCarrier> carrier;

  FrameNumber parent() const { return start.position.sector.frame; }
};

}  // namespace tessera
