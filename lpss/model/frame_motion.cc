#include "lpss/model/frame_motion.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

#include "lpss/base/portable_math.h"
#include "lpss/base/rotation.h"
#include "lpss/model/frame_keys.h"
#include "lpss/model/gravity.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

// On an ellipse around the centre of a planet, from `place` (m) and `velocity` (m/s) there.
void fall_around(const CentralGravity& planet, const Vector3d& place, double time, FrameMotion& motion) {
  constexpr int kSteps = 50;
  const Vector3d velocity = motion.velocity;
  const double pull = planet.surface * planet.radius * planet.radius;  // m^3/s^2
  const double distance = place.norm();
  const double axis = 1 / (2 / distance - velocity.squaredNorm() / pull);
  const double rate = std::sqrt(pull / axis) / axis;
  const double outward = place.dot(velocity) / std::sqrt(pull);
  const double mean = std::remainder(rate * time, 2 * std::numbers::pi);
  // By Newton's method: the mean anomaly as it grows with the eccentric one.
  double change = mean;
  portable::SinCos at;
  for (int n = 0; n < kSteps; ++n) {
    at = portable::sincos(change);
    const double miss =
        change - (1 - distance / axis) * at.sin + outward / std::sqrt(axis) * (1 - at.cos) - mean;
    const double slope = 1 - (1 - distance / axis) * at.cos + outward / std::sqrt(axis) * at.sin;
    change -= miss / slope;
    if (std::abs(miss) < 1e-16) break;
  }
  at = portable::sincos(change);
  const double now = axis + (distance - axis) * at.cos + outward * std::sqrt(axis) * at.sin;
  const double less = axis / distance * (1 - at.cos);
  const double along = mean / rate - (change - at.sin) / rate;
  motion.way = velocity * along - place * less;
  motion.velocity = velocity * (1 - axis / now * (1 - at.cos)) -
                    place * (std::sqrt(pull * axis) / (now * distance) * at.sin);
}

void fall(const WorldSettings& settings, const MovingFrame& frame, double time, FrameMotion& motion) {
  if (const auto* planet = std::get_if<CentralGravity>(&settings.gravity))
    return fall_around(*planet, metres_from(*planet, frame.start.position, settings.sector_size), time,
                       motion);
  const Vector3d& acceleration = std::get<UniformGravity>(settings.gravity).acceleration;
  motion.way = motion.velocity * time + acceleration * (time * time / 2);
  motion.velocity += acceleration * time;
}

void follow_legs(const MovingFrame& frame, double time, FrameMotion& motion) {
  double left = time;
  for (const FrameLeg& leg : frame.legs) {
    const double span = std::min(left, leg.seconds);
    motion.way += motion.velocity * span + leg.acceleration * (span * span / 2);
    motion.velocity += leg.acceleration * span;
    left -= span;
    if (span < leg.seconds) {
      motion.acceleration = leg.acceleration;
      return;
    }
  }
  motion.way += motion.velocity * left;
}

Vector3d numbers_in(const std::array<double, 3>& numbers) { return Vector3d(numbers.data()); }
Eigen::Map<Vector3d> numbers_in(std::array<double, 3>& numbers) {
  return Eigen::Map<Vector3d>(numbers.data());
}

absl::StatusOr<WorldPose> pose_from(const FramePlace& place, const WorldPose& pose, double sector_size) {
  const SectorIndex middle{0, 0, 0, pose.position.sector.frame};
  const Vector3d from_origin = relative_to(pose.position, middle, sector_size);
  const absl::StatusOr<WorldPosition> position =
      canonical(place.origin.sector, place.origin.local + place.orientation * from_origin, sector_size);
  if (!position.ok()) return position.status();
  return WorldPose{*position, (place.orientation * pose.orientation).normalized()};
}

}  // namespace

Vector3d metres_from(const CentralGravity& planet, const WorldPosition& place, double sector_size) {
  return metres_between(planet.centre.sector, place.sector, sector_size) +
         (place.local - planet.centre.local);
}

FrameMotion motion_at(const WorldSettings& settings, const MovingFrame& frame, double time) {
  if (!frame.keys.empty()) return motion_along_keys(frame, time);
  FrameMotion motion;
  motion.orientation = rotation_by(frame.spin * time) * frame.start.orientation;
  motion.velocity = frame.velocity;
  motion.spin = frame.spin;
  if (frame.falls) {
    fall(settings, frame, time, motion);
  } else {
    follow_legs(frame, time, motion);
  }
  return motion;
}

const MovingFrame& outermost(const WorldSettings& settings, const MovingFrame& frame) {
  const MovingFrame* outer = &frame;
  while (outer->parent() != kWorldFrame) outer = &settings.frames[outer->parent() - 1];
  return *outer;
}

FrameMotion composed(const FrameMotion& outer, const Vector3d& from, const FrameMotion& own) {
  const Vector3d from_origin = outer.orientation * Vector3d(from + own.way);
  const Vector3d velocity = outer.orientation * own.velocity;
  const Vector3d spin = outer.orientation * own.spin;
  FrameMotion motion;
  motion.way = outer.way + from_origin;
  motion.orientation = (outer.orientation * own.orientation).normalized();
  motion.velocity = outer.velocity + outer.spin.cross(from_origin) + velocity;
  motion.spin = outer.spin + spin;
  motion.acceleration = outer.acceleration + outer.spin.cross(outer.spin.cross(from_origin)) +
                        outer.angular_acceleration.cross(from_origin) + 2 * outer.spin.cross(velocity) +
                        outer.orientation * own.acceleration;
  motion.angular_acceleration = outer.angular_acceleration + outer.spin.cross(spin);
  if (!own.angular_acceleration.isZero(0))
    motion.angular_acceleration += outer.orientation * own.angular_acceleration;
  return motion;
}

FrameMotion motion_in_world(const WorldSettings& settings, const MovingFrame& frame, double time) {
  FrameMotion own = motion_at(settings, frame, time);
  if (frame.parent() == kWorldFrame) return own;
  const FrameMotion outer = motion_in_world(settings, settings.frames[frame.parent() - 1], time);
  const SectorIndex middle{0, 0, 0, frame.parent()};
  return composed(outer, relative_to(frame.start.position, middle, settings.sector_size), own);
}

Vector3d place_in_frame(const FramedBody& body, double sector_size) {
  return metres_between({0, 0, 0, body.home.frame}, body.home, sector_size) + numbers_in(body.state.position);
}

SeenCarriers::SeenCarriers(const WorldSettings& settings) {
  for (const MovingFrame& frame : settings.frames) {
    if (frame.carrier) seen_.emplace_back(frame.carrier->body, std::nullopt);
  }
}

void SeenCarriers::see(BodyId body, const WorldPose& pose) {
  for (auto& [carrier, seen] : seen_) {
    if (carrier == body) seen = pose;
  }
}

CarrierPoses SeenCarriers::poses() const {
  return [this](BodyId body) {
    const auto found = std::ranges::find(seen_, body, [](const auto& seen) { return seen.first; });
    return found == seen_.end() ? std::nullopt : found->second;
  };
}

bool carries_a_frame(const WorldSettings& settings, BodyId body) {
  return std::ranges::any_of(settings.frames, [&](const MovingFrame& frame) {
    return frame.carrier && frame.carrier->body == body;
  });
}

std::vector<CarriedFrame> carried_at_start(const WorldSettings& settings) {
  std::vector<CarriedFrame> carried;
  for (std::size_t n = 0; n < settings.frames.size(); ++n) {
    const MovingFrame& frame = settings.frames[n];
    if (!frame.carrier) continue;
    CarriedFrame& start = carried.emplace_back();
    start.frame = static_cast<FrameNumber>(n + 1);
    start.place = {frame.start.position, frame.start.orientation, frame.velocity, frame.spin};
    // Around a planet, it is taken to fall, and in a frame, to rest. If it does not, what is aboard floats,
    // or has its weight, for one tick.
    const auto* planet = std::get_if<CentralGravity>(&settings.gravity);
    if (planet == nullptr || frame.parent() != kWorldFrame) continue;
    const Vector3d from_centre = metres_from(*planet, frame.start.position, settings.sector_size);
    start.acceleration = mean_pull(*planet, from_centre, frame.velocity, settings.time_step);
  }
  return carried;
}

FrameMotion motion_on(const CarriedFrame& carried, double seconds) {
  const FramePlace& place = carried.place;
  const Vector3d turned = (place.spin + carried.angular_acceleration * (seconds / 2)) * seconds;
  FrameMotion motion;
  motion.way = (place.velocity + carried.acceleration * (seconds / 2)) * seconds;
  motion.velocity = place.velocity + carried.acceleration * seconds;
  motion.acceleration = carried.acceleration;
  motion.orientation = (rotation_by(turned) * place.orientation).normalized();
  motion.spin = place.spin + carried.angular_acceleration * seconds;
  motion.angular_acceleration = carried.angular_acceleration;
  return motion;
}

absl::StatusOr<CarriedFrame> carried_on(const WorldSettings& settings, const CarriedFrame& before,
                                        const BodyRecord& carrier, bool is_led) {
  const double dt = settings.time_step;
  const BodyState& state = carrier.state;
  const Pose centre{numbers_in(state.position), quaternion_of(state)};
  const Pose pose =
      centre * centre_frame(carrier.properties).inverse() * settings.frames[before.frame - 1].carrier->pose;
  const absl::StatusOr<WorldPosition> origin = canonical(carrier.home, pose.position, settings.sector_size);
  if (!origin.ok()) return origin.status();
  CarriedFrame now = before;
  FramePlace& place = now.place;
  place.origin = *origin;
  place.orientation = pose.orientation.normalized();
  if (is_led) {
    const Vector3d way = metres_between(before.place.origin.sector, origin->sector, settings.sector_size) +
                         (origin->local - before.place.origin.local);
    place.velocity = way / dt;
    place.spin = rotation_vector(place.orientation * before.place.orientation.conjugate()) / dt;
  } else {
    place.spin = numbers_in(state.angular_velocity);
    place.velocity =
        numbers_in(state.linear_velocity) + place.spin.cross(Vector3d(pose.position - centre.position));
  }
  now.acceleration = (place.velocity - before.place.velocity) / dt;
  now.angular_acceleration = (place.spin - before.place.spin) / dt;
  return now;
}

// Lengths that grow with time are taken into sectors before anything near the origin is added.
absl::StatusOr<FramePlace> frame_place(const WorldSettings& settings, FrameNumber number, double time,
                                       const CarrierPoses& carriers) {
  const MovingFrame& frame = settings.frames[number - 1];
  if (frame.carrier) {
    const std::optional<WorldPose> body = carriers ? carriers(frame.carrier->body) : std::nullopt;
    if (!body) {
      return absl::UnavailableError(absl::StrCat("where frame '", frame.name,
                                                 "' is follows from its carrier, ", "body ",
                                                 frame.carrier->body.value));
    }
    const absl::StatusOr<WorldPose> pose = compose(*body, frame.carrier->pose, settings.sector_size);
    if (!pose.ok()) return pose.status();
    if (pose->position.sector.frame != frame.parent()) {
      return absl::UnavailableError(absl::StrCat("where frame '", frame.name,
                                                 "' is does not follow from its carrier, body ",
                                                 frame.carrier->body.value, ", which is in another frame"));
    }
    FramePlace place;
    place.origin = pose->position;
    place.orientation = pose->orientation;
    return place;
  }
  const FrameMotion motion = motion_at(settings, frame, time);
  const WorldPosition& start = frame.start.position;
  const absl::StatusOr<WorldPosition> origin =
      canonical(start.sector, start.local + motion.way, settings.sector_size);
  if (!origin.ok()) return origin.status();
  return FramePlace{*origin, motion.orientation, motion.velocity, motion.spin};
}

absl::StatusOr<WorldPose> pose_in_world(const WorldSettings& settings, double time, const WorldPose& pose,
                                        const CarrierPoses& carriers) {
  WorldPose outside = pose;
  while (outside.position.sector.frame != kWorldFrame) {
    const absl::StatusOr<FramePlace> place =
        frame_place(settings, outside.position.sector.frame, time, carriers);
    if (!place.ok()) return place.status();
    const absl::StatusOr<WorldPose> next = pose_from(*place, outside, settings.sector_size);
    if (!next.ok()) return next.status();
    outside = *next;
  }
  return outside;
}

absl::StatusOr<WorldPose> pose_in_frame(const WorldSettings& settings, double time, const WorldPose& pose,
                                        FrameNumber frame, const CarrierPoses& carriers) {
  if (pose.position.sector.frame == frame) return pose;
  if (const FrameNumber most = std::max(pose.position.sector.frame, frame); most > settings.frames.size())
    return absl::NotFoundError(absl::StrCat("the world has no frame ", most));
  if (frame == kWorldFrame) return pose_in_world(settings, time, pose, carriers);
  const absl::StatusOr<WorldPose> outside =
      pose_in_frame(settings, time, pose, settings.frames[frame - 1].parent(), carriers);
  if (!outside.ok()) return outside.status();
  FramedBody body{outside->position.sector, {}};
  numbers_in(body.state.position) = outside->position.local;
  body.state.rotation = rotation_of(outside->orientation);
  const absl::StatusOr<FramePlace> place = frame_place(settings, frame, time, carriers);
  if (!place.ok()) return place.status();
  const absl::StatusOr<FramedBody> inside = into_frame(*place, frame, body, settings.sector_size);
  if (!inside.ok()) return inside.status();
  return WorldPose{{inside->home, numbers_in(inside->state.position)}, quaternion_of(inside->state)};
}

absl::StatusOr<FramedBody> out_of_frame(const FramePlace& place, const FramedBody& body, double sector_size) {
  const absl::StatusOr<WorldPose> pose = pose_from(
      place, {{body.home, numbers_in(body.state.position)}, quaternion_of(body.state)}, sector_size);
  if (!pose.ok()) return pose.status();
  const Vector3d from_origin = place.orientation * place_in_frame(body, sector_size);
  FramedBody result{pose->position.sector, body.state};
  BodyState& state = result.state;
  numbers_in(state.position) = pose->position.local;
  state.rotation = rotation_of(pose->orientation);
  numbers_in(state.linear_velocity) = place.velocity + place.spin.cross(from_origin) +
                                      place.orientation * numbers_in(body.state.linear_velocity);
  numbers_in(state.angular_velocity) =
      place.spin + place.orientation * numbers_in(body.state.angular_velocity);
  state.velocities_before.reset();
  return result;
}

absl::StatusOr<FramedBody> into_frame(const FramePlace& place, FrameNumber number, const FramedBody& body,
                                      double sector_size) {
  const Eigen::Quaterniond back = place.orientation.conjugate();
  const Vector3d outside = metres_between(place.origin.sector, body.home, sector_size) +
                           (numbers_in(body.state.position) - place.origin.local);
  const absl::StatusOr<WorldPosition> position = canonical({0, 0, 0, number}, back * outside, sector_size);
  if (!position.ok()) return position.status();
  FramedBody result{position->sector, body.state};
  BodyState& state = result.state;
  numbers_in(state.position) = position->local;
  state.rotation = rotation_of((back * quaternion_of(body.state)).normalized());
  numbers_in(state.linear_velocity) =
      back * Vector3d(numbers_in(body.state.linear_velocity) - place.velocity - place.spin.cross(outside));
  numbers_in(state.angular_velocity) = back * Vector3d(numbers_in(body.state.angular_velocity) - place.spin);
  state.velocities_before.reset();
  return result;
}

}  // namespace tessera
