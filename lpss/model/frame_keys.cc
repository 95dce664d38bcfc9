#include "lpss/model/frame_keys.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"

namespace tessera {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Each round leaves at most half of the error, mostly less than a quarter.
constexpr int kSmoothingRoundsMax = 100;
constexpr double kUnitTolerance = 1e-14;

// A cubic polynomial of time at one time, and its derivatives.
struct Cubic {
  Vector3d value;
  Vector3d rate;
  Vector3d second;
};

// It goes from 0 with `first` to `way` with `last`, in so many seconds.
Cubic cubic_at(double seconds, const Vector3d& way, const Vector3d& first, const Vector3d& last,
               double time) {
  const double share = time / seconds;
  const Vector3d mean = way / seconds;
  const Vector3d square = 3 * mean - 2 * first - last;
  const Vector3d cube = first + last - 2 * mean;
  return {(first + share * (square + share * cube)) * time, first + share * (2 * square + 3 * share * cube),
          (2 * square + 6 * share * cube) / seconds};
}

// Of a rotation vector of the angle x: (1 - cos x) / x^2 and (x - sin x) / x^3, and the derivatives of both
// by x, divided by x.
struct TurnFactors {
  double once = 0;
  double twice = 0;
  double once_changes = 0;
  double twice_changes = 0;
};

TurnFactors turn_factors(double angle_squared) {
  TurnFactors result;
  if (angle_squared >= 1) {
    const double angle = std::sqrt(angle_squared);
    const auto [sin, cos] = portable::sincos(angle);
    const double fourth = angle_squared * angle_squared;
    result.once = (1 - cos) / angle_squared;
    result.twice = (angle - sin) / (angle_squared * angle);
    result.once_changes = (angle * sin - 2 * (1 - cos)) / fourth;
    result.twice_changes = (3 * sin - angle * (2 + cos)) / (fourth * angle);
    return result;
  }
  // The power series, in which nothing cancels. What is left out comes to less than 1e-17.
  constexpr int kTerms = 9;
  double once = 1. / 2;
  double twice = 1. / 6;
  for (int n = 0; n < kTerms; ++n) {
    result.once += once;
    result.twice += twice;
    const double next_once = -once / ((2 * n + 3) * (2 * n + 4));
    const double next_twice = -twice / ((2 * n + 4) * (2 * n + 5));
    result.once_changes += 2 * (n + 1) * next_once;
    result.twice_changes += 2 * (n + 1) * next_twice;
    once = next_once * angle_squared;
    twice = next_twice * angle_squared;
  }
  return result;
}

// How a body turns, along its own axes: rad/s and rad/s^2.
struct BodyTurn {
  Vector3d spin;
  Vector3d growth;
};

// Whose orientation is that rotation vector: the right Jacobian of the exponential map, times its rate.
BodyTurn turn_of(const Cubic& vector) {
  const TurnFactors factors = turn_factors(vector.value.squaredNorm());
  const Vector3d& turn = vector.value;
  const double along = turn.dot(vector.rate);
  const Vector3d across = turn.cross(vector.rate);
  const Vector3d twice_across = turn.cross(across);
  const Vector3d second_across = turn.cross(vector.second);
  BodyTurn result;
  result.spin = vector.rate - factors.once * across + factors.twice * twice_across;
  result.growth = vector.second - factors.once * second_across +
                  factors.twice * (turn.cross(second_across) + vector.rate.cross(across)) +
                  along * (factors.twice_changes * twice_across - factors.once_changes * across);
  return result;
}

// The rate of a rotation vector that makes a body turn at `spin`, along its own axes.
Vector3d rate_for(const Vector3d& turn, const Vector3d& spin) {
  const TurnFactors factors = turn_factors(turn.squaredNorm());
  Matrix3d cross;
  cross << 0, -turn.z(), turn.y(), turn.z(), 0, -turn.x(), -turn.y(), turn.x(), 0;
  const Matrix3d turning = Matrix3d::Identity() - factors.once * cross + factors.twice * cross * cross;
  return turning.inverse() * spin;
}

// From one key to the next.
struct KeyStretch {
  double seconds;
  Vector3d way;
  Vector3d turn;  // a rotation vector: the shorter way round

  KeyStretch(const FrameKey& from, const FrameKey& to)
      : seconds(to.time - from.time),
        way(to.pose.position - from.pose.position),
        turn(rotation_vector(from.pose.orientation.conjugate() * to.pose.orientation)) {}

  // With spins along the axes of the frame, as it is at either end.
  Cubic turned(const Vector3d& first, const Vector3d& last, double time) const {
    return cubic_at(seconds, turn, first, rate_for(turn, last), time);
  }
};

// The keys of a path while what they lack is found, by the method of Gauss and Seidel: each equation says
// that an acceleration does not jump at a key, and rests mostly on the velocity there.
class Smoothing {
 public:
  Smoothing(std::vector<FrameKey>& keys, bool loops) : keys_(keys) {
    for (std::size_t n = 0; n + 1 < keys.size(); ++n) stretches_.emplace_back(keys[n], keys[n + 1]);
    FrameKey& first = keys_.front();
    FrameKey& last = keys_.back();
    if (loops) {
      if (!first.velocity) first.velocity = last.velocity;
      if (!first.spin) first.spin = last.spin;
    }
    for (const FrameKey& key : keys_) {
      velocities_.push_back(key.velocity.value_or(Vector3d::Zero()));
      spins_.push_back(key.pose.orientation.conjugate() * key.spin.value_or(Vector3d::Zero()));
    }
    const std::size_t end = keys.size() - 1;
    for (std::size_t n = loops ? 0 : 1; n < end; ++n) {
      const std::size_t before = n > 0 ? n - 1 : end - 1;
      if (!key(n).velocity) lack_velocity_.push_back({before, n});
      if (!key(n).spin) lack_spin_.push_back({before, n});
    }
    is_round_ = loops;
  }

  void run() {
    for (int round = 0; round < kSmoothingRoundsMax && find_velocities(); ++round) {
    }
    for (int round = 0; round < kSmoothingRoundsMax && find_spins(); ++round) {
    }
    if (is_round_) {
      if (!keys_.back().velocity) velocities_.back() = velocities_.front();
      if (!keys_.back().spin)
        spins_.back() =
            keys_.back().pose.orientation.conjugate() * (keys_.front().pose.orientation * spins_.front());
    }
    for (std::size_t n = 0; n < keys_.size(); ++n) {
      FrameKey& key = keys_[n];
      if (!key.velocity) key.velocity = velocities_[n];
      if (!key.spin) key.spin = key.pose.orientation * spins_[n];
    }
  }

 private:
  // The stretches before and after a key, which is the first of the second.
  struct Place {
    std::size_t before;
    std::size_t after;
  };

  const FrameKey& key(std::size_t n) const { return keys_[n]; }

  // At the end of a stretch: of a path that loops, the last key is the first.
  const Vector3d& at_end(const std::vector<Vector3d>& values, std::size_t stretch, bool is_known) const {
    const std::size_t n = stretch + 1;
    return is_round_ && n + 1 == keys_.size() && !is_known ? values.front() : values[n];
  }
  const Vector3d& velocity_after(std::size_t stretch) const {
    return at_end(velocities_, stretch, keys_[stretch + 1].velocity.has_value());
  }
  const Vector3d& spin_after(std::size_t stretch) const {
    return at_end(spins_, stretch, keys_[stretch + 1].spin.has_value());
  }

  // Whether that changed anything.
  bool find_velocities() {
    bool is_changed = false;
    for (const Place& place : lack_velocity_) {
      const KeyStretch& before = stretches_[place.before];
      const KeyStretch& after = stretches_[place.after];
      const Vector3d found =
          (before.way * (3 / (before.seconds * before.seconds)) +
           after.way * (3 / (after.seconds * after.seconds)) - velocities_[place.before] / before.seconds -
           velocity_after(place.after) / after.seconds) /
          (2 / before.seconds + 2 / after.seconds);
      is_changed = is_changed || found != velocities_[place.after];
      velocities_[place.after] = found;
    }
    return is_changed;
  }

  bool find_spins() {
    bool is_changed = false;
    for (const Place& place : lack_spin_) {
      const KeyStretch& before = stretches_[place.before];
      const KeyStretch& after = stretches_[place.after];
      Vector3d& spin = spins_[place.after];
      const Vector3d ends = turn_of(before.turned(spins_[place.before], spin, before.seconds)).growth;
      const Vector3d begins = turn_of(after.turned(spin, spin_after(place.after), 0)).growth;
      const Vector3d found = spin + (begins - ends) / (4 / before.seconds + 4 / after.seconds);
      is_changed = is_changed || found != spin;
      spin = found;
    }
    return is_changed;
  }

  std::vector<FrameKey>& keys_;
  bool is_round_ = false;
  std::vector<KeyStretch> stretches_;
  std::vector<Vector3d> velocities_;  // by key
  std::vector<Vector3d> spins_;       // by key, along the axes of the frame there
  std::vector<Place> lack_velocity_;
  std::vector<Place> lack_spin_;
};

// In the axes that the frame starts with; its way is a place.
FrameMotion motion_from_key(const std::vector<FrameKey>& keys, std::size_t at, double time) {
  const FrameKey& from = keys[at];
  FrameMotion motion;
  const double past = time - from.time;
  if (at + 1 == keys.size()) {
    motion.way = from.pose.position + *from.velocity * past;
    motion.velocity = *from.velocity;
    motion.orientation = rotation_by(*from.spin * past) * from.pose.orientation;
    motion.spin = *from.spin;
    return motion;
  }
  const FrameKey& to = keys[at + 1];
  const KeyStretch stretch(from, to);
  const Cubic way = cubic_at(stretch.seconds, stretch.way, *from.velocity, *to.velocity, past);
  motion.way = from.pose.position + way.value;
  motion.velocity = way.rate;
  motion.acceleration = way.second;
  const Cubic vector = stretch.turned(from.pose.orientation.conjugate() * *from.spin,
                                      to.pose.orientation.conjugate() * *to.spin, past);
  const BodyTurn turn = turn_of(vector);
  motion.orientation = from.pose.orientation * rotation_by(vector.value);
  motion.spin = motion.orientation * turn.spin;
  motion.angular_acceleration = motion.orientation * turn.growth;
  return motion;
}

}  // namespace

void smooth_keys(std::vector<FrameKey>& keys, bool loops) {
  const auto not_before = [](const FrameKey& a, const FrameKey& b) { return !(a.time < b.time); };
  if (keys.size() < 2 || std::ranges::adjacent_find(keys, not_before) != keys.end()) return;
  // What is known keeps its bits, however often it is read.
  for (FrameKey& key : keys) {
    Eigen::Quaterniond& orientation = key.pose.orientation;
    if (std::abs(orientation.squaredNorm() - 1) > kUnitTolerance) orientation.normalize();
  }
  if (std::ranges::all_of(keys, [](const FrameKey& key) { return key.velocity && key.spin; })) return;
  Smoothing(keys, loops).run();
}

FrameMotion motion_along_keys(const MovingFrame& frame, double time) {
  const std::vector<FrameKey>& keys = frame.keys;
  if (frame.loops) time = std::fmod(time, keys.back().time);
  const auto after = std::ranges::upper_bound(keys, time, {}, &FrameKey::time);
  const auto at = static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - keys.begin(), 1) - 1);
  FrameMotion motion = motion_from_key(keys, at, time);
  const Eigen::Quaterniond& axes = frame.start.orientation;
  motion.way = axes * motion.way;
  motion.velocity = axes * motion.velocity;
  motion.acceleration = axes * motion.acceleration;
  motion.orientation = (axes * motion.orientation).normalized();
  motion.spin = axes * motion.spin;
  motion.angular_acceleration = axes * motion.angular_acceleration;
  return motion;
}

bool follows_keys(const WorldSettings& settings, const MovingFrame& frame) {
  const MovingFrame* at = &frame;
  while (at->keys.empty() && at->parent() != kWorldFrame) at = &settings.frames[at->parent() - 1];
  return !at->keys.empty();
}

}  // namespace tessera
