// Where frames that move are, as a function of time.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "lpss/model/body.h"
#include "lpss/model/settings.h"

namespace tessera {

// At one time, along the axes of its parent, or of the world frame.
struct FrameMotion {
  Eigen::Vector3d way = Eigen::Vector3d::Zero();                    // m, of the origin from `start`
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  // from the frame's axes
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();               // m/s, of the origin
  // m/s^2, likewise, from that time on; of a frame that falls: 0, since it is that of gravity.
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();                  // rad/s
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  // rad/s^2
};

// In its parent, without a carrier. `time`: s since tick 0, >= 0. An orbit is that of two bodies, in closed
// form for any time (Battin, An Introduction to the Mathematics and Methods of Astrodynamics, 1999,
// section 4.3: Lagrange's coefficients by the change of the eccentric anomaly).
FrameMotion motion_at(const WorldSettings& settings, const MovingFrame& frame, double time);

// The outermost of the frames that one moves in, itself if that is in the world frame.
const MovingFrame& outermost(const WorldSettings& settings, const MovingFrame& frame);

// In the world frame, whose axes all is along: the way is from where the outermost frame starts. Its
// acceleration is without that of gravity, if the outermost frame falls. None of the frames has a carrier.
FrameMotion motion_in_world(const WorldSettings& settings, const MovingFrame& frame, double time);

// The motion `own` in a frame that moves as `outer` does, along the axes of the latter. `from`: m, the place
// that the way of `own` is from, in that frame. The motion of a point in a frame that itself turns and is
// accelerated (Goldstein, Classical Mechanics, section 4.10).
FrameMotion composed(const FrameMotion& outer, const Eigen::Vector3d& from, const FrameMotion& own);

// Where a frame is at one time, in its parent.
struct FramePlace {
  WorldPosition origin;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  // from the frame's axes
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();               // m/s, of the origin
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();                   // rad/s

  friend bool operator==(const FramePlace& a, const FramePlace& b) {
    return a.origin == b.origin && a.orientation.coeffs() == b.orientation.coeffs() &&
           a.velocity == b.velocity && a.spin == b.spin;
  }
};

// What a dynamic carrier is solved with beyond what it is itself; see lpss/tick/burden.h.
struct Ballast {
  double mass = 0;     // kg
  double inertia = 0;  // kg m^2, about each axis

  friend bool operator==(const Ballast&, const Ballast&) = default;
};

// A frame with a carrier at the end of a tick, and how it has moved in that tick: all along the axes of its
// parent, but for what is owed.
struct CarriedFrame {
  FrameNumber frame = kWorldFrame;
  FramePlace place;
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();          // m/s^2, of the origin
  Eigen::Vector3d angular_acceleration = Eigen::Vector3d::Zero();  // rad/s^2
  std::array<std::int64_t, 3> felt = {};  // in the tick that has ended: Felt::steps()
  bool is_borne = true;                   // the carrier is dynamic, as far as is known
  Ballast ballast;
  // Momentum that the carrier is still to get of what is aboard, and angular momentum about its centre of
  // mass.
  Eigen::Vector3d owed = Eigen::Vector3d::Zero();       // kg m/s, world axes
  Eigen::Vector3d owed_spin = Eigen::Vector3d::Zero();  // kg m^2/s

  friend bool operator==(const CarriedFrame&, const CarriedFrame&) = default;
};

// Whether frames are fixed to a body.
bool carries_a_frame(const WorldSettings& settings, BodyId body);

// All frames with carriers as the world begins, ascending.
std::vector<CarriedFrame> carried_at_start(const WorldSettings& settings);

// So many seconds after the end of that tick, as it goes on: the way is from where it was then.
FrameMotion motion_on(const CarriedFrame& carried, double seconds);

// Where the carrier is, a body of its parent, takes its frame by the end of a tick. `is_led`: a
// kinematic body that was taken to a target, whose velocity is that of its way in the tick. OUT_OF_RANGE
// where that is beyond the 64-bit range of sectors.
absl::StatusOr<CarriedFrame> carried_on(const WorldSettings& settings, const CarriedFrame& before,
                                        const BodyRecord& carrier, bool is_led);

// Where the body frames of carriers are, in sectors of the frame that each is in; none where that is not
// known.
using CarrierPoses = std::function<std::optional<WorldPose>(BodyId)>;

// Those that carry frames of a world, of bodies that are shown one by one.
class SeenCarriers {
 public:
  explicit SeenCarriers(const WorldSettings& settings);
  void see(BodyId body, const WorldPose& pose);
  CarrierPoses poses() const;  // while this lives

 private:
  std::vector<std::pair<BodyId, std::optional<WorldPose>>> seen_;
};

// `frame` is one of the world's frames that move. OUT_OF_RANGE where it is beyond the 64-bit range of
// sectors, UNAVAILABLE where `carriers` do not have its carrier. The velocities of a frame with a carrier are
// not told.
absl::StatusOr<FramePlace> frame_place(const WorldSettings& settings, FrameNumber frame, double time,
                                       const CarrierPoses& carriers = {});

// The pose in the world frame of what is at `pose`, in sectors of a frame that moves. Errors as
// frame_place().
absl::StatusOr<WorldPose> pose_in_world(const WorldSettings& settings, double time, const WorldPose& pose,
                                        const CarrierPoses& carriers = {});

// A pose in sectors of any frame, in those of `frame` at that time. Errors as frame_place(), and NOT_FOUND
// for a frame that the world does not have.
absl::StatusOr<WorldPose> pose_in_frame(const WorldSettings& settings, double time, const WorldPose& pose,
                                        FrameNumber frame, const CarrierPoses& carriers = {});

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

// m, from the centre of a planet to a place in the world frame; world axes.
Eigen::Vector3d metres_from(const CentralGravity& planet, const WorldPosition& place, double sector_size);

}  // namespace tessera
