// Where frames that move are, as a function of time.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "lpss/model/body.h"
#include "lpss/model/settings.h"

namespace tessera {

// At one time, along the world's axes.
struct FrameMotion {
  Eigen::Vector3d way = Eigen::Vector3d::Zero();                    // m, of the origin since tick 0
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  // from the frame's axes
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();               // m/s, of the origin
  // m/s^2, likewise, from that time on; of a frame that falls: 0, since it is that of gravity.
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

// `time`: s since tick 0, >= 0. An orbit is that of two bodies, in closed form for any time (Battin, An
// Introduction to the Mathematics and Methods of Astrodynamics, 1999, section 4.3: Lagrange's coefficients by
// the change of the eccentric anomaly).
FrameMotion motion_at(const WorldSettings& settings, const MovingFrame& frame, double time);

// Where a frame that moves is at one time, in the world frame.
struct FramePlace {
  WorldPosition origin;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  // from the frame's axes
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();               // m/s, of the origin
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();                   // rad/s
};

// `frame` is one of the world's frames that move. OUT_OF_RANGE where it is beyond the 64-bit range of
// sectors.
absl::StatusOr<FramePlace> frame_place(const WorldSettings& settings, FrameNumber frame, double time);

// The pose in the world frame of what is at `pose`, in sectors of a frame that moves. Errors as
// frame_place().
absl::StatusOr<WorldPose> pose_in_world(const WorldSettings& settings, double time, const WorldPose& pose);

// A pose in sectors of any frame, in those of `frame` at that time. Errors as frame_place(), and NOT_FOUND
// for a frame that the world does not have.
absl::StatusOr<WorldPose> pose_in_frame(const WorldSettings& settings, double time, const WorldPose& pose,
                                        FrameNumber frame);

// A body in sectors of one frame.
struct FramedBody {
  SectorIndex home;
  BodyState state;
};

// A body of the frame that is at `place`, in sectors of the world frame; and one of the world frame, in
// sectors of that frame, which is `number`. OUT_OF_RANGE beyond the 64-bit range of sectors.
absl::StatusOr<FramedBody> out_of_frame(const FramePlace& place, const FramedBody& body, double sector_size);
absl::StatusOr<FramedBody> into_frame(const FramePlace& place, FrameNumber number, const FramedBody& body,
                                      double sector_size);

// m, of a body from the origin of its frame.
Eigen::Vector3d place_in_frame(const FramedBody& body, double sector_size);

// m, from the centre of a planet to where the frame starts; world axes.
Eigen::Vector3d start_from(const CentralGravity& planet, const MovingFrame& frame, double sector_size);

}  // namespace tessera
