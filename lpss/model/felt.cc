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

Felt::Felt(const WorldSettings& settings, FrameNumber frame, double time)
    : settings_(&settings), frame_(frame) {
  if (frame_ == kWorldFrame) return;
  const MovingFrame& moving = settings_->frames[frame_ - 1];
  const MovingFrame& outer = outermost(*settings_, moving);
  motion_ = motion_in_world(*settings_, moving, time);
  falls_ = outer.falls;
  const Eigen::Quaterniond back = motion_.orientation.conjugate();
  spin_ = spin_after_ = back * motion_.spin;
  turns_ = !motion_.spin.isZero(0);
  if (const auto* planet = std::get_if<CentralGravity>(&settings_->gravity))
    from_centre_ = metres_from(*planet, outer.start.position, settings_->sector_size);
  if (falls_) {
    const Vector3d fallen = motion_at(*settings_, outer, time).way;
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

void Felt::look_ahead(const MovingFrame& moving, const MovingFrame& outer, double time, bool has_keys) {
  const double dt = settings_->time_step;
  const FrameMotion next = motion_in_world(*settings_, moving, time + dt);
  // Where the outermost frame falls, that is left out of both.
  FrameMotion fallen;
  FrameMotion fallen_next;
  if (falls_) {
    fallen = motion_at(*settings_, outer, time);
    fallen_next = motion_at(*settings_, outer, time + dt);
  }
  const Vector3d velocity = motion_.velocity - fallen.velocity;
  const Vector3d next_velocity = next.velocity - fallen_next.velocity;
  const Eigen::Quaterniond back = felt_back_;
  FrameMotion grows = motion_;
  if (has_keys) {
    turns_ = true;
    grows = motion_in_world(*settings_, moving, time + dt / 2);
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
  std::vector<Felt> felt;
  auto next = carried.begin();
  for (FrameNumber frame = kWorldFrame; frame <= settings.frames.size(); ++frame) {
    if (next != carried.end() && next->frame == frame) {
      felt.emplace_back(settings, *next++);
    } else {
      felt.emplace_back(settings, frame, time);
    }
  }
  return felt;
}

}  // namespace tessera
