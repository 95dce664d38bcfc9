// Paths through keys, beside closed forms and differences.
#include "lpss/model/frame_keys.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "lpss/base/rotation.h"
#include "lpss/model/felt.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

constexpr double kInstant = 1e-5;  // s

MovingFrame along(std::vector<FrameKey> keys, bool loops = false) {
  MovingFrame frame;
  frame.name = "tram";
  frame.keys = std::move(keys);
  frame.loops = loops;
  smooth_keys(frame.keys, loops);
  return frame;
}

// Up to nearly half a turn from one to the next, about any axis, at uneven times.
MovingFrame winding(bool loops) {
  std::mt19937 seed(7);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vector3d(normal(seed), normal(seed), normal(seed)); };
  std::vector<FrameKey> keys(8);
  for (std::size_t n = 1; n < keys.size(); ++n) {
    keys[n].time = keys[n - 1].time + 0.5 + std::abs(normal(seed));
    keys[n].pose = {10 * vector(), keys[n - 1].pose.orientation * rotation_by(2.5 * vector().normalized())};
  }
  if (loops) keys.back().pose = keys.front().pose;
  MovingFrame frame = along(std::move(keys), loops);
  frame.start = {{{1, 2, 3}, {4, 5, 6}}, rotation_by({0.3, -1, 2})};
  return frame;
}

TEST(FrameKeys, AreWherePathsLead) {
  const MovingFrame frame = winding(false);
  for (const FrameKey& key : frame.keys) {
    const FrameMotion motion = motion_along_keys(frame, key.time);
    EXPECT_LT((motion.way - frame.start.orientation * key.pose.position).norm(), 1e-13);
    EXPECT_LT(rotation_angle(motion.orientation.conjugate() * frame.start.orientation * key.pose.orientation),
              1e-14);
    EXPECT_LT((motion.velocity - frame.start.orientation * *key.velocity).norm(), 1e-13);
    EXPECT_LT((motion.spin - frame.start.orientation * *key.spin).norm(), 1e-13);
  }
}

TEST(FrameKeys, VelocitiesAndAccelerationsAreDerivatives) {
  for (const bool loops : {false, true}) {
    const MovingFrame frame = winding(loops);
    for (double time = 0.1; time < 3 * frame.keys.back().time; time += 0.237) {
      const FrameMotion before = motion_along_keys(frame, time - kInstant);
      const FrameMotion now = motion_along_keys(frame, time);
      const FrameMotion after = motion_along_keys(frame, time + kInstant);
      EXPECT_LT(((after.way - before.way) / (2 * kInstant) - now.velocity).norm(), 1e-6) << time;
      const Vector3d turned = rotation_vector(after.orientation * before.orientation.conjugate());
      EXPECT_LT((turned / (2 * kInstant) - now.spin).norm(), 1e-7) << time;
      // Where they jump, at both ends of a path that does not loop, differences say nothing.
      if (!loops && std::abs(time - frame.keys.back().time) < 2 * kInstant) continue;
      EXPECT_LT(((after.velocity - before.velocity) / (2 * kInstant) - now.acceleration).norm(), 1e-3)
          << time;
      EXPECT_LT(((after.spin - before.spin) / (2 * kInstant) - now.angular_acceleration).norm(), 1e-3)
          << time;
    }
  }
}

TEST(FrameKeys, AccelerationsDoNotJump) {
  for (const bool loops : {false, true}) {
    const MovingFrame frame = winding(loops);
    for (std::size_t n = 1; n + (loops ? 0 : 1) < frame.keys.size(); ++n) {
      const double time = frame.keys[n].time;
      const FrameMotion before = motion_along_keys(frame, time - 1e-10);
      const FrameMotion after = motion_along_keys(frame, time);
      EXPECT_LT((after.velocity - before.velocity).norm(), 1e-7) << n;
      EXPECT_LT((after.acceleration - before.acceleration).norm(), 1e-6) << n;
      EXPECT_LT((after.spin - before.spin).norm(), 1e-7) << n;
      EXPECT_LT((after.angular_acceleration - before.angular_acceleration).norm(), 1e-6) << n;
    }
  }
}

// From rest to rest, about one axis: 3 s^2 - 2 s^3.
TEST(FrameKeys, TwoAreACubic) {
  constexpr double kSeconds = 4;
  constexpr double kTurn = 3;  // rad
  const MovingFrame frame =
      along({{0, {}, {}, {}}, {kSeconds, {{20, 0, -8}, rotation_by({0, 0, kTurn})}, {}, {}}});
  for (double time = 0; time < kSeconds; time += 0.3) {
    const double s = time / kSeconds;
    const double share = s * s * (3 - 2 * s);
    const double second = (6 - 12 * s) / (kSeconds * kSeconds);
    const FrameMotion motion = motion_along_keys(frame, time);
    EXPECT_LT((motion.way - Vector3d(20, 0, -8) * share).norm(), 1e-14);
    EXPECT_LT((motion.acceleration - Vector3d(20, 0, -8) * second).norm(), 1e-14);
    EXPECT_LT(rotation_angle(motion.orientation.conjugate() * rotation_by({0, 0, kTurn * share})), 1e-14);
    EXPECT_LT((motion.angular_acceleration - Vector3d(0, 0, kTurn * second)).norm(), 1e-14);
  }
  const FrameMotion end = motion_along_keys(frame, 1e6);
  EXPECT_EQ(end.way, Vector3d(20, 0, -8)) << "it stays there";
  EXPECT_EQ(end.velocity, Vector3d::Zero());
  EXPECT_EQ(end.angular_acceleration, Vector3d::Zero());
}

TEST(FrameKeys, VelocitiesThatAreGivenHold) {
  const Vector3d velocity(1, 2, 3);
  const Vector3d spin(0, 0.5, 0);
  const MovingFrame frame = along({{0, {}, {}, {}},
                                   {1, {{1, 0, 0}, Eigen::Quaterniond::Identity()}, velocity, spin},
                                   {2, {}, velocity, spin}});
  EXPECT_EQ(motion_along_keys(frame, 1).velocity, velocity);
  EXPECT_LT((motion_along_keys(frame, 1).spin - spin).norm(), 1e-15);
  const FrameMotion later = motion_along_keys(frame, 6);
  EXPECT_EQ(later.way, 4 * velocity) << "it goes on";
  EXPECT_LT(rotation_angle(later.orientation.conjugate() * rotation_by(4 * spin)), 1e-15);
}

// A place far away is as exact as the way from there; one in a loop of a thousand years as in its first
// round.
TEST(FrameKeys, NoDistanceAndNoTimeCostsPrecision) {
  WorldSettings settings;
  settings.frames = {
      along({{0, {}, {}, {}}, {2, {{3, 4, 0}, Eigen::Quaterniond::Identity()}, {}, {}}, {8, {}, {}, {}}},
            /*loops=*/true)};
  WorldPosition& start = settings.frames[0].start.position;
  const FramePlace near = *frame_place(settings, 1, 1.5);
  start.sector = {std::int64_t{1} << 62, -(std::int64_t{1} << 61), 0};
  const FramePlace far = *frame_place(settings, 1, 1.5 + 8. * (std::int64_t{1} << 32));
  EXPECT_EQ(far.origin.local, near.origin.local);
  EXPECT_EQ(far.origin.sector.i, near.origin.sector.i + start.sector.i);
  EXPECT_EQ(far.velocity, near.velocity);
}

// What flies freely goes where a straight way leads, as seen from outside.
TEST(FrameKeys, FreeFlightIsStraightOutside) {
  WorldSettings settings;
  settings.gravity = UniformGravity{{0, 0, -9.81}};
  settings.frames = {winding(true)};
  const Vector3d place(2, -3, 1);
  const Vector3d velocity(4, 5, -6);
  Vector3d at = place;
  Vector3d speed = velocity;
  const auto outside = [&](double time, const Vector3d& inside) {
    const FrameMotion motion = motion_at(settings, settings.frames[0], time);
    return Vector3d(motion.way + motion.orientation * inside);
  };
  const FrameMotion first = motion_at(settings, settings.frames[0], 0);
  const Vector3d start = outside(0, place);
  const Vector3d thrown =
      first.velocity + first.spin.cross(Vector3d(first.orientation * place)) + first.orientation * velocity;
  constexpr int kTicks = 600;
  for (int tick = 0; tick < kTicks; ++tick) {
    const Felt felt(settings, 1, tick * settings.time_step);
    const Felt::Flight flight = felt.flight({0, 0, 0, 1}, at, speed, true);
    at += flight.way;
    speed += flight.change;
  }
  const double time = kTicks * settings.time_step;
  EXPECT_LT((outside(time, at) - (start + thrown * time - Vector3d(0, 0, 9.81 / 2 * time * time))).norm(),
            1e-8);
}

// Whose mean over a tick is its change of velocity, with what turning makes of it.
TEST(FrameKeys, WhatIsFeltIsTheAccelerationOfThePlace) {
  WorldSettings settings;
  settings.time_step = 1e-3;
  settings.gravity = UniformGravity{{0, 0, -9.81}};
  settings.frames = {winding(false)};
  const Vector3d place(2, -3, 1);
  const auto outside = [&](double time) {
    const FrameMotion motion = motion_at(settings, settings.frames[0], time);
    return Vector3d(motion.way + motion.orientation * place);
  };
  for (const double time : {0.1, 1.3, 2.7}) {
    const double middle = time + settings.time_step / 2;
    constexpr double kApart = 1e-4;
    const Vector3d acceleration =
        (outside(middle + kApart) + outside(middle - kApart) - 2 * outside(middle)) / (kApart * kApart);
    const Vector3d right = motion_at(settings, settings.frames[0], middle).orientation.conjugate() *
                           Vector3d(Vector3d(0, 0, -9.81) - acceleration);
    EXPECT_LT((Felt(settings, 1, time).at({0, 0, 0, 1}, place, true) - right).norm(), 1e-4) << time;
  }
}

}  // namespace
}  // namespace tessera
