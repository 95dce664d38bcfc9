// Frames that move: what a world may have of them.
#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "lpss/base/rotation.h"
#include "lpss/model/checks.h"
#include "lpss/model/frame_motion.h"
#include "lpss/model/validate.h"

namespace tessera {
namespace {

constexpr double kLoopGapMax = 1e-6;  // m, rad

// An orbit that comes back, and does not meet the planet.
absl::Status fall_check(const MovingFrame& frame, const Gravity& gravity, double sector_size) {
  const auto* planet = std::get_if<CentralGravity>(&gravity);
  if (planet == nullptr) return absl::OkStatus();
  const Eigen::Vector3d place = metres_from(*planet, frame.start.position, sector_size);
  const double pull = planet->surface * planet->radius * planet->radius;
  const double energy = frame.velocity.squaredNorm() / 2 - pull / place.norm();
  if (!(energy < 0)) return refused("velocity: it falls on no closed orbit: it escapes from the planet");
  const double turning = place.cross(frame.velocity).squaredNorm();
  const double eccentricity = std::sqrt(std::max(1 + 2 * energy * turning / (pull * pull), 0.0));
  const double lowest = -pull / (2 * energy) * (1 - eccentricity);
  if (lowest >= planet->radius) return absl::OkStatus();
  return refused("velocity: it falls on an orbit that comes down to ", lowest,
                 " m from the planet's centre, and must stay above its radius, ", planet->radius, " m");
}

absl::Status key_place_check(const FrameKey& key) {
  if (!(key.time >= 0 && key.time <= kFrameLegMax))
    return refused("time = ", key.time, " s must be at least 0 s and at most ", kFrameLegMax, " s");
  absl::Status status = finite("position", key.pose.position, kFrameKeyReachMax, "m");
  return status.ok() ? unit_quaternion("orientation", key.pose.orientation) : status;
}

absl::Status key_way_check(const FrameKey& before, const FrameKey& key) {
  const double seconds = key.time - before.time;
  if (!(seconds >= kTimeStepMin)) {
    return refused("time = ", key.time, " s must be at least ", kTimeStepMin,
                   " s after that of the key before, ", before.time, " s");
  }
  const double speed = (key.pose.position - before.pose.position).norm() / seconds;
  return bounded("speed from the key before", speed, 0, kFrameSpeedMax, "m/s");
}

absl::Status key_velocity_check(const FrameKey& key) {
  if (!key.velocity || !key.spin)
    return refused("its velocity and its spin are to be found by smooth_keys()");
  absl::Status status = finite("velocity", *key.velocity, kFrameSpeedMax, "m/s");
  return status.ok() ? finite("spin", *key.spin, kFrameSpinMax, "rad/s") : status;
}

// What is at the end of a path that loops is at its beginning.
absl::Status loop_check(const FrameKey& first, const FrameKey& last) {
  const double apart = (last.pose.position - first.pose.position).norm();
  const double turned = rotation_angle(first.pose.orientation.conjugate() * last.pose.orientation);
  if (!(apart <= kLoopGapMax && turned <= kLoopGapMax)) {
    return refused("it loops, and its last key is ", apart, " m and ", turned,
                   " rad from its first, which must be at most ", kLoopGapMax);
  }
  if (*first.velocity != *last.velocity || (*first.spin - *last.spin).norm() > kLoopGapMax)
    return refused("it loops, and its last key must have the velocity and the spin of its first");
  return absl::OkStatus();
}

absl::Status keys_check(const MovingFrame& frame) {
  const std::vector<FrameKey>& keys = frame.keys;
  if (keys.empty()) return frame.loops ? refused("it loops, and must have keys") : absl::OkStatus();
  if (frame.falls || frame.carrier || !frame.legs.empty() || !frame.velocity.isZero(0) ||
      !frame.spin.isZero(0))
    return refused("it has keys, and so no velocity, spin, legs or carrier, nor does it fall");
  if (keys.size() < 2 || keys.size() > kFrameKeysMax)
    return refused("its ", keys.size(), " keys must be at least 2 and at most ", kFrameKeysMax);
  for (std::size_t n = 0; n < keys.size(); ++n) {
    absl::Status status = key_place_check(keys[n]);
    if (status.ok() && n == 0 && keys[n].time != 0)
      status = refused("time = ", keys[n].time, " s must be 0 s");
    if (status.ok() && n > 0) status = key_way_check(keys[n - 1], keys[n]);
    if (!status.ok()) return in(absl::StrCat("key ", n + 1), status);
  }
  for (std::size_t n = 0; n < keys.size(); ++n) {
    if (absl::Status status = key_velocity_check(keys[n]); !status.ok())
      return in(absl::StrCat("key ", n + 1), status);
  }
  return frame.loops ? loop_check(keys.front(), keys.back()) : absl::OkStatus();
}

absl::Status frame_check(const MovingFrame& frame, const Gravity& gravity, double sector_size) {
  if (frame.name.empty()) return refused("its name must not be empty");
  if (absl::Status status = sized("its name", frame.name, kNameBytesMax); !status.ok()) return status;
  const WorldPosition& position = frame.start.position;
  if (absl::Status status = finite("position", position.local); !status.ok()) return status;
  if (auto home = canonical(position.sector, position.local, sector_size); !home.ok()) return home.status();
  if (absl::Status status = unit_quaternion("orientation", frame.start.orientation); !status.ok())
    return status;
  if (absl::Status status = finite("velocity", frame.velocity, kFrameSpeedMax, "m/s"); !status.ok())
    return status;
  if (absl::Status status = finite("spin", frame.spin, kFrameSpinMax, "rad/s"); !status.ok()) return status;
  if (frame.region) {
    if (absl::Status status = finite("region centre", frame.region->centre, kStaticExtentMax, "m");
        !status.ok())
      return status;
    for (int axis = 0; axis < 3; ++axis) {
      absl::Status status = bounded(absl::StrCat("region size ", std::string(1, "xyz"[axis])),
                                    frame.region->size[axis], kRegionSizeMin, kStaticExtentMax, "m");
      if (!status.ok()) return status;
    }
  }
  if (absl::Status status = keys_check(frame); !status.ok()) return status;
  if (frame.carrier) {
    if (frame.falls || !frame.legs.empty())
      return refused("it has a carrier, and so neither falls nor has legs");
    absl::Status status =
        finite("position on its carrier", frame.carrier->pose.position, kFrameReachMax, "m");
    if (status.ok()) status = unit_quaternion("orientation on its carrier", frame.carrier->pose.orientation);
    if (!status.ok()) return status;
  }
  if (frame.falls) {
    if (!frame.legs.empty()) return refused("it falls, and so has no legs");
    if (absl::Status status = fall_check(frame, gravity, sector_size); !status.ok()) return status;
  }
  if (frame.legs.size() > kFrameLegsMax)
    return refused("its ", frame.legs.size(), " legs must be at most ", kFrameLegsMax);
  for (std::size_t n = 0; n < frame.legs.size(); ++n) {
    const FrameLeg& leg = frame.legs[n];
    if (!(leg.seconds > 0 && leg.seconds <= kFrameLegMax)) {
      return refused("leg ", n + 1, ": seconds = ", leg.seconds, " must be above 0 and at most ",
                     kFrameLegMax);
    }
    absl::Status status =
        finite(absl::StrCat("leg ", n + 1, ": acceleration"), leg.acceleration, kAccelerationMax, "m/s^2");
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status parent_check(const MovingFrame& frame, const std::vector<MovingFrame>& frames) {
  const FrameNumber parent = frame.parent();
  if (parent == kWorldFrame) return absl::OkStatus();
  if (parent > frames.size() || &frames[parent - 1] >= &frame)
    return refused("it must start in the world frame, or in a frame that is listed before it");
  if (frame.falls) return refused("it falls, and must start in the world frame");
  return absl::OkStatus();
}

}  // namespace

absl::Status validate_frames(const WorldSettings& settings) {
  const std::vector<MovingFrame>& frames = settings.frames;
  if (frames.size() > kMovingFramesMax)
    return refused("frames: their number ", frames.size(), " must be at most ", kMovingFramesMax);
  if (!frames.empty() && settings.seams == SeamPolicy::kClone)
    return refused("frames that move need the seam policy island; that of the world is clone");
  absl::flat_hash_set<absl::string_view> names;
  for (const MovingFrame& frame : frames) {
    const std::string what = absl::StrCat("frame '", frame.name, "'");
    if (absl::Status status = utf8("frame", frame.name); !status.ok()) return status;
    if (absl::Status status = parent_check(frame, frames); !status.ok()) return in(what, status);
    if (absl::Status status = frame_check(frame, settings.gravity, settings.sector_size); !status.ok())
      return in(what, status);
    if (!names.insert(frame.name).second) return refused(what, ": another frame has this name");
  }
  return absl::OkStatus();
}

}  // namespace tessera
