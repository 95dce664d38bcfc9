#include "lpss/model/felt.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "lpss/base/rotation.h"
#include "lpss/model/frame_keys.h"
#include "lpss/model/gravity.h"

namespace tessera {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Applied to w: the torque that a spin asks for of a body that turns at w in the frame. Its power is 0.
Matrix3d gyroscopic(const Matrix3d& inertia, const Vector3d& spin) {
  const auto cross = [](const Vector3d& v) {
    Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
  };
  return cross(spin) * inertia - cross(inertia * spin) + inertia * cross(spin);
}

}  // namespace

// The motion of the outermost of the frames that one moves in: as the path or, in the tick that comes, the
// carrier has it.
class Felt::Outermost {
 public:
  Outermost(const WorldSettings& settings, const MovingFrame& moving, double time,
            const CarriedFrame* carried)
      : settings_(settings), frame_(outermost(settings, moving)), time_(time), carried_(carried) {
    const auto* planet = std::get_if<CentralGravity>(&settings.gravity);
    falls_ = carried == nullptr ? frame_.falls : planet != nullptr;
    if (planet == nullptr) return;
    const WorldPosition& from = carried == nullptr ? frame_.start.position : carried->place.origin;
    from_centre_ = metres_from(*planet, from, settings.sector_size);
    if (carried != nullptr)
      pull_ = mean_pull(*planet, from_centre_, carried->place.velocity, settings.time_step);
  }

  bool falls() const { return falls_; }
  // m, of where its ways are from, from the centre of a planet.
  const Vector3d& from_centre() const { return from_centre_; }

  // So many seconds after the beginning of the tick; where it falls, the acceleration is what is beyond that.
  FrameMotion after(double seconds) const {
    if (carried_ == nullptr) return motion_at(settings_, frame_, time_ + seconds);
    const FramePlace& place = carried_->place;
    const Vector3d turned = (place.spin + carried_->angular_acceleration * (seconds / 2)) * seconds;
    FrameMotion motion;
    motion.way = (place.velocity + carried_->acceleration * (seconds / 2)) * seconds;
    motion.velocity = place.velocity + carried_->acceleration * seconds;
    motion.acceleration = carried_->acceleration - pull_;
    motion.orientation = (rotation_by(turned) * place.orientation).normalized();
    motion.spin = place.spin + carried_->angular_acceleration * seconds;
    motion.angular_acceleration = carried_->angular_acceleration;
    return motion;
  }

  // What falling alone makes of it, if it falls.
  FrameMotion fallen_after(double seconds) const {
    if (!falls_) return {};
    if (carried_ == nullptr) return after(seconds);
    FrameMotion motion;
    motion.way = (carried_->place.velocity + pull_ * (seconds / 2)) * seconds;
    motion.velocity = carried_->place.velocity + pull_ * seconds;
    return motion;
  }

 private:
  const WorldSettings& settings_;
  const MovingFrame& frame_;
  double time_;
  const CarriedFrame* carried_;
  bool falls_ = false;
  Vector3d from_centre_ = Vector3d::Zero();
  Vector3d pull_ = Vector3d::Zero();  // m/s^2, of a planet on the carrier
};

Felt::Felt(const WorldSettings& settings, FrameNumber frame, double time, const CarriedFrame* carried)
    : settings_(&settings), frame_(frame) {
  if (frame_ == kWorldFrame) return;
  const MovingFrame& moving = settings_->frames[frame_ - 1];
  const Outermost outer(*settings_, moving, time, carried);
  motion_ = motion_in_world(*settings_, moving, time, outer.after(0));
  falls_ = outer.falls();
  const Eigen::Quaterniond back = motion_.orientation.conjugate();
  spin_ = spin_after_ = back * motion_.spin;
  turns_ = !motion_.spin.isZero(0) || carried != nullptr;
  from_centre_ = outer.from_centre();
  if (falls_) {
    const Vector3d fallen = outer.fallen_after(0).way;
    from_centre_ += fallen;
    from_outer_ = motion_.way - fallen;
  } else {
    from_centre_ += motion_.way;
  }
  felt_back_ = back;
  felt_spin_ = spin_;
  turn_ = rotation_by(spin_after_ * -settings_->time_step);
  const bool has_keys = follows_keys(*settings_, moving);
  if (has_keys || (moving.parent() != kWorldFrame && turns_)) look_ahead(moving, outer, time, has_keys);
  prepare();
}

void Felt::look_ahead(const MovingFrame& moving, const Outermost& outer, double time, bool has_keys) {
  const double dt = settings_->time_step;
  const FrameMotion next = motion_in_world(*settings_, moving, time + dt, outer.after(dt));
  // Where the outermost frame falls, that is left out of both.
  const FrameMotion fallen = outer.fallen_after(0);
  const FrameMotion fallen_next = outer.fallen_after(dt);
  const Vector3d velocity = motion_.velocity - fallen.velocity;
  const Vector3d next_velocity = next.velocity - fallen_next.velocity;
  const Eigen::Quaterniond back = felt_back_;
  FrameMotion grows = motion_;
  if (has_keys) {
    turns_ = true;
    grows = motion_in_world(*settings_, moving, time + dt / 2, outer.after(dt / 2));
    felt_back_ = grows.orientation.conjugate();
    felt_spin_ = felt_back_ * grows.spin;
    motion_.acceleration = (next_velocity - velocity) / dt;
  }
  // It turns about an axis that turns.
  spin_growth_ = felt_back_ * grows.angular_acceleration;
  turn_ = next.orientation.conjugate() * motion_.orientation;
  spin_after_ = next.orientation.conjugate() * next.spin;
  const Vector3d way = next.way - fallen_next.way - (motion_.way - fallen.way);
  way_beyond_ = back * Vector3d(way - velocity * dt - motion_.acceleration * (dt * dt / 2));
  change_beyond_ = back * Vector3d(next_velocity - velocity - motion_.acceleration * dt);
}

Felt::Felt(const WorldSettings& settings, const CarriedFrame& carried)
    : settings_(&settings), frame_(carried.frame) {
  const FramePlace& place = carried.place;
  motion_.orientation = place.orientation;
  motion_.velocity = place.velocity;
  motion_.acceleration = carried.acceleration;
  motion_.spin = place.spin;
  const Eigen::Quaterniond back = place.orientation.conjugate();
  spin_ = spin_after_ = back * place.spin;
  turns_ = !place.spin.isZero(0) || !carried.angular_acceleration.isZero(0);
  if (!carried.angular_acceleration.isZero(0)) {
    spin_growth_ = back * carried.angular_acceleration;
    spin_after_ += spin_growth_ * settings_->time_step;
  }
  // The pull of a planet is that of this tick; what else accelerates the carrier is felt a tick late.
  if (const auto* planet = std::get_if<CentralGravity>(&settings_->gravity)) {
    falls_ = true;
    from_centre_ = metres_from(*planet, place.origin, settings_->sector_size);
    motion_.acceleration -= mean_pull(*planet, from_centre_, place.velocity, settings_->time_step);
  }
  felt_back_ = back;
  felt_spin_ = spin_;
  turn_ = rotation_by(spin_after_ * -settings_->time_step);
  prepare();
}

void Felt::prepare() {
  coriolis_turn_ = rotation_by(felt_spin_ * (-2 * settings_->time_step));
  for (const bool has_gravity : {true, false})
    at_origin_[has_gravity ? 0 : 1] = falls_at(Vector3d::Zero(), has_gravity, felt_back_);
  const Vector3d& felt = at_origin_[0];
  for (int n = 0; n < 3; ++n)
    steps_[static_cast<std::size_t>(n)] = static_cast<std::int64_t>(std::floor(felt[n] / kFeltStep + 0.5));
}

Vector3d Felt::place_of(const SectorIndex& home, const Vector3d& position) const {
  return metres_between({0, 0, 0, frame_}, home, settings_->sector_size) + position;
}

Vector3d Felt::falls_at(const Vector3d& place, bool has_gravity, const Eigen::Quaterniond& back) const {
  if (falls_ && has_gravity) {
    const Vector3d differs =
        difference_from(settings_->gravity, from_centre_, from_outer_ + motion_.orientation * place);
    return back * Vector3d(differs - motion_.acceleration);
  }
  Vector3d pull = falls_ ? Vector3d(-acceleration_from(settings_->gravity, from_centre_)) : Vector3d::Zero();
  if (has_gravity)
    pull = acceleration_from(settings_->gravity, Vector3d(from_centre_ + motion_.orientation * place));
  return back * Vector3d(pull - motion_.acceleration);
}

Vector3d Felt::at(const SectorIndex& home, const Vector3d& position, bool has_gravity) const {
  if (frame_ == kWorldFrame) {
    if (!has_gravity) return Vector3d::Zero();
    return acceleration_at(settings_->gravity, home, position, settings_->sector_size);
  }
  const Vector3d place = place_of(home, position);
  const Vector3d felt = falls_at(place, has_gravity, felt_back_);
  return turns_ ? Vector3d(felt - felt_spin_.cross(felt_spin_.cross(place)) - spin_growth_.cross(place))
                : felt;
}

bool Felt::is_as(const Felt& before) const {
  if (at_origin_ != before.at_origin_ || felt_spin_ != before.felt_spin_ ||
      spin_growth_ != before.spin_growth_)
    return false;
  if (std::holds_alternative<UniformGravity>(settings_->gravity)) return true;
  return from_centre_ == before.from_centre_ &&
         motion_.orientation.coeffs() == before.motion_.orientation.coeffs();
}

Vector3d Felt::coriolis(const Vector3d& velocity) const {
  return (coriolis_turn_ * velocity - velocity) / settings_->time_step;
}

Felt::Flight Felt::flight(const SectorIndex& home, const Vector3d& position, const Vector3d& velocity,
                          bool has_gravity) const {
  const double dt = settings_->time_step;
  const Vector3d place = place_of(home, position);
  const Vector3d outside = velocity + spin_.cross(place);
  const Vector3d falls = falls_at(place, has_gravity, motion_.orientation.conjugate());
  const Vector3d next = turn_ * Vector3d(place + outside * dt + falls * (dt * dt / 2) - way_beyond_);
  const Vector3d next_velocity =
      turn_ * Vector3d(outside + falls * dt - change_beyond_) - spin_after_.cross(next);
  return {next - place, next_velocity - velocity};
}

Vector3d Felt::torque(const Matrix3d& inertia, const Vector3d& rate) const {
  const double dt = settings_->time_step;
  const Matrix3d turning = gyroscopic(inertia, felt_spin_) * (dt / 2);
  const Vector3d still = -felt_spin_.cross(Vector3d(inertia * felt_spin_)) - inertia * spin_growth_;
  const Vector3d after = (inertia + turning).inverse() * ((inertia - turning) * rate + still * dt);
  return inertia * (after - rate) / dt;
}

std::vector<Felt> felt_in_frames(const WorldSettings& settings, std::uint64_t tick,
                                 std::span<const CarriedFrame> carried) {
  const double time = static_cast<double>(tick - std::min<std::uint64_t>(tick, 1)) * settings.time_step;
  std::vector<Felt> felt = {Felt(settings, kWorldFrame, time)};
  for (const MovingFrame& frame : settings.frames) {
    const MovingFrame& outer = outermost(settings, frame);
    const auto number = static_cast<FrameNumber>(felt.size());
    const auto outer_number = static_cast<FrameNumber>(&outer - settings.frames.data() + 1);
    const auto at = std::ranges::find(carried, outer_number, &CarriedFrame::frame);
    if (at == carried.end()) {
      felt.emplace_back(settings, number, time);
    } else if (number == outer_number) {
      felt.emplace_back(settings, *at);
    } else {
      felt.emplace_back(settings, number, time, &*at);
    }
  }
  return felt;
}

}  // namespace tessera
