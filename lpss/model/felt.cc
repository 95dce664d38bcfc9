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

// How a frame moves in the tick: the frames that it moves in, one in the other, as their paths or, in the
// tick that comes, their carriers have them.
class Felt::Course {
 public:
  Course(const WorldSettings& settings, FrameNumber frame, double time, std::span<const CarriedFrame> carried)
      : settings_(settings), frame_(frame), time_(time), carried_(carried) {
    const MovingFrame& outer = outermost(settings, settings.frames[frame - 1]);
    outer_ = carried_of(outer);
    for (FrameNumber at = frame; at != kWorldFrame; at = settings.frames[at - 1].parent())
      has_carrier_ = has_carrier_ || carried_of(settings.frames[at - 1]) != nullptr;
    const auto* planet = std::get_if<CentralGravity>(&settings.gravity);
    goes_evenly_ =
        planet == nullptr && outer_ == nullptr && !outer.falls && outer.legs.empty() && outer.keys.empty();
    falls_ = outer_ == nullptr ? outer.falls : planet != nullptr;
    if (planet == nullptr) return;
    const WorldPosition& from = outer_ == nullptr ? outer.start.position : outer_->place.origin;
    from_centre_ = metres_from(*planet, from, settings.sector_size);
    if (outer_ != nullptr)
      pull_ = mean_pull(*planet, from_centre_, outer_->place.velocity, settings.time_step);
  }

  const MovingFrame& moving() const { return settings_.frames[frame_ - 1]; }
  bool has_carrier() const { return has_carrier_; }
  // Whether the outermost frame does.
  bool falls() const { return falls_; }
  // m, of where the ways of the outermost frame are from, from the centre of a planet.
  const Vector3d& from_centre() const { return from_centre_; }

  // In the world, so many seconds after the beginning of the tick; where it falls, the acceleration is what
  // is beyond that.
  FrameMotion after(double seconds) const { return after(moving(), seconds); }

  // What falling alone makes of the outermost frame, if it falls.
  FrameMotion fallen_after(double seconds) const {
    if (!falls_) return {};
    if (outer_ == nullptr) return after(outermost(settings_, moving()), seconds);
    FrameMotion motion;
    motion.way = (outer_->place.velocity + pull_ * (seconds / 2)) * seconds;
    motion.velocity = outer_->place.velocity + pull_ * seconds;
    return motion;
  }

 private:
  const CarriedFrame* carried_of(const MovingFrame& frame) const {
    if (!frame.carrier) return nullptr;
    const auto number = static_cast<FrameNumber>(&frame - settings_.frames.data() + 1);
    const auto found = std::ranges::find(carried_, number, &CarriedFrame::frame);
    return found == carried_.end() ? nullptr : &*found;
  }

  FrameMotion after(const MovingFrame& frame, double seconds) const {
    const CarriedFrame* const carried = carried_of(frame);
    FrameMotion own =
        carried == nullptr ? motion_at(settings_, frame, time_ + seconds) : motion_on(*carried, seconds);
    const FrameNumber parent = frame.parent();
    if (parent == kWorldFrame) {
      if (carried != nullptr) own.acceleration -= pull_;
      // Its speed is not felt, and is not to cost digits.
      if (goes_evenly_) own.way = own.velocity = Vector3d::Zero();
      return own;
    }
    const WorldPosition& from = carried == nullptr ? frame.start.position : carried->place.origin;
    return composed(after(settings_.frames[parent - 1], seconds),
                    relative_to(from, {0, 0, 0, parent}, settings_.sector_size), own);
  }

  const WorldSettings& settings_;
  FrameNumber frame_;
  double time_;
  std::span<const CarriedFrame> carried_;
  const CarriedFrame* outer_ = nullptr;  // the outermost, if that has a carrier
  bool has_carrier_ = false;             // any of them
  bool goes_evenly_ = false;             // the outermost
  bool falls_ = false;
  Vector3d from_centre_ = Vector3d::Zero();
  Vector3d pull_ = Vector3d::Zero();  // m/s^2, of a planet on the outermost carrier
};

Felt::Felt(const WorldSettings& settings, FrameNumber frame, double time,
           std::span<const CarriedFrame> carried)
    : settings_(&settings), frame_(frame) {
  if (frame_ == kWorldFrame) return;
  const MovingFrame& moving = settings_->frames[frame_ - 1];
  const auto found = std::ranges::find(carried, frame, &CarriedFrame::frame);
  if (found != carried.end() && moving.parent() == kWorldFrame) {
    go_on(*found);
    return;
  }
  const Course course(*settings_, frame_, time, carried);
  motion_ = course.after(0);
  falls_ = course.falls();
  const Eigen::Quaterniond back = motion_.orientation.conjugate();
  spin_ = spin_after_ = back * motion_.spin;
  turns_ = !motion_.spin.isZero(0) || course.has_carrier();
  from_centre_ = course.from_centre();
  if (falls_) {
    const Vector3d fallen = course.fallen_after(0).way;
    from_centre_ += fallen;
    from_outer_ = motion_.way - fallen;
  } else {
    from_centre_ += motion_.way;
  }
  felt_back_ = back;
  felt_spin_ = spin_;
  turn_ = rotation_by(spin_after_ * -settings_->time_step);
  const bool has_keys = follows_keys(*settings_, moving);
  if (has_keys || (moving.parent() != kWorldFrame && turns_)) look_ahead(course, has_keys);
  prepare();
}

void Felt::look_ahead(const Course& course, bool has_keys) {
  const double dt = settings_->time_step;
  const FrameMotion next = course.after(dt);
  // Where the outermost frame falls, that is left out of both.
  const FrameMotion fallen = course.fallen_after(0);
  const FrameMotion fallen_next = course.fallen_after(dt);
  const Vector3d velocity = motion_.velocity - fallen.velocity;
  const Vector3d next_velocity = next.velocity - fallen_next.velocity;
  const Eigen::Quaterniond back = felt_back_;
  FrameMotion grows = motion_;
  if (has_keys) {
    turns_ = true;
    grows = course.after(dt / 2);
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

void Felt::go_on(const CarriedFrame& carried) {
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
  for (std::size_t n = 0; n <= settings.frames.size(); ++n)
    felt.emplace_back(settings, static_cast<FrameNumber>(n), time, carried);
  return felt;
}

}  // namespace tessera
