// What bodies feel in a frame: gravity, less what the frame itself does.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "lpss/model/frame_motion.h"
#include "lpss/model/settings.h"

namespace tessera {

// In one frame at one time. All vectors are along the frame's axes.
class Felt {
 public:
  // `settings` outlives it. `time`: s since tick 0, of the beginning of the tick. `carried`: all frames with
  // a carrier. Each goes on as it has just moved: what a frame feels of a force on its carrier comes a tick
  // late. So does what that feels itself, but for the pull of a planet around which it falls in the world
  // frame.
  Felt(const WorldSettings& settings, FrameNumber frame, double time,
       std::span<const CarriedFrame> carried = {});

  // m/s^2, of a body at rest in the frame at `position` (m, relative to the centre of `home`, a sector of the
  // frame): gravity, less the acceleration of that place. On a path through keys, which changes within a
  // tick, less the mean of that, as seen along the axes in the middle of the tick. Exactly gravity in the
  // world frame, and in one that neither turns nor accelerates. Without gravity for a body that has none.
  Eigen::Vector3d at(const SectorIndex& home, const Eigen::Vector3d& position, bool has_gravity) const;

  // From the frame's axes to the world's.
  Eigen::Quaterniond orientation() const { return motion_.orientation; }

  // Whether bodies feel more by how they move.
  bool turns() const { return turns_; }

  // The mean acceleration (m/s^2) by the Coriolis force in a tick, of a body that keeps this velocity (m/s).
  Eigen::Vector3d coriolis(const Eigen::Vector3d& velocity) const;
  // rad/s, of the frame, as that and torque() have it.
  const Eigen::Vector3d& spin() const { return felt_spin_; }

  // A tick of a body that nothing pushes: straight on, or on a parabola, as seen from where nothing turns.
  struct Flight {
    Eigen::Vector3d way;     // m
    Eigen::Vector3d change;  // m/s, of the velocity
  };
  Flight flight(const SectorIndex& home, const Eigen::Vector3d& position, const Eigen::Vector3d& velocity,
                bool has_gravity) const;

  // The mean torque (N m) in a tick on a body that turns at `rate` (rad/s) in the frame, beyond that of its
  // own turning: `inertia` (kg m^2) along the frame's axes. By the implicit midpoint rule, which keeps
  // energy.
  Eigen::Vector3d torque(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& rate) const;

  // Whether a body at rest feels the same wherever it is.
  bool is_uniform() const { return !turns_ && std::holds_alternative<UniformGravity>(settings_->gravity); }

  // Whether each body at rest feels what it felt before, to the last bit.
  bool is_as(const Felt& before) const;

  // What is felt at the origin, in steps of kFeltStep: where it changes, what rests is to be woken.
  const std::array<std::int64_t, 3>& steps() const { return steps_; }

 private:
  class Course;

  void prepare();
  // In the world frame.
  void go_on(const CarriedFrame& carried);
  // Of a frame that moves in another one, or along keys: what it does in the tick beyond what it goes on to
  // do from its beginning.
  void look_ahead(const Course& course, bool has_keys);
  // m, from the origin of the frame.
  Eigen::Vector3d place_of(const SectorIndex& home, const Eigen::Vector3d& position) const;
  // m/s^2, without what the turning of the frame makes of it; by `back` from the world's axes.
  Eigen::Vector3d falls_at(const Eigen::Vector3d& place, bool has_gravity,
                           const Eigen::Quaterniond& back) const;

  const WorldSettings* settings_;
  FrameNumber frame_;
  bool turns_ = false;
  bool falls_ = false;
  FrameMotion motion_;
  // m, of the origin from that of a planet; world axes. Where the outermost frame falls: of that one's, and
  // the origin from there.
  Eigen::Vector3d from_centre_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d from_outer_ = Eigen::Vector3d::Zero();
  // At the beginning of a tick, and at its end.
  Eigen::Vector3d spin_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d spin_after_ = Eigen::Vector3d::Zero();
  // What bodies feel that something may hold: the turn from the world's axes, the spin, and by how much it
  // grows, rad/s^2. At the beginning of a tick; along keys, in its middle.
  Eigen::Quaterniond felt_back_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d felt_spin_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d spin_growth_ = Eigen::Vector3d::Zero();
  // m/s^2, at the origin: with gravity and without.
  std::array<Eigen::Vector3d, 2> at_origin_ = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  // What its origin does in the tick beyond its velocity at the beginning and its acceleration; m and m/s,
  // along the axes of the beginning.
  Eigen::Vector3d way_beyond_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d change_beyond_ = Eigen::Vector3d::Zero();
  // What a vector that stays as it is does in the frame in a tick, and twice as far.
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond coriolis_turn_ = Eigen::Quaterniond::Identity();
  std::array<std::int64_t, 3> steps_ = {};
};

// In all frames of a world, by FrameNumber, in a tick (the first is 1): as it begins. `carried`: all that
// have a carrier, ascending.
std::vector<Felt> felt_in_frames(const WorldSettings& settings, std::uint64_t tick,
                                 std::span<const CarriedFrame> carried);

inline constexpr double kFeltStep = 0.01;  // m/s^2

}  // namespace tessera
