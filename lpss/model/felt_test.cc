// What is felt in a frame, beside what is known of carousels, lifts and satellites.
#include "lpss/model/felt.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "lpss/base/rotation.h"

namespace tessera {
namespace {

using Eigen::Vector3d;

WorldSettings with(const MovingFrame& frame) {
  WorldSettings settings;
  settings.sector_size = 16;
  settings.frames = {frame};
  return settings;
}

TEST(Felt, IsGravityWhereNothingTurnsOrAccelerates) {
  MovingFrame frame;
  frame.velocity = {3e7, -5, 1};
  const WorldSettings settings = with(frame);
  const Felt felt(settings, 1, 1000);
  EXPECT_EQ(felt.at({5, 6, 7, 1}, {1, 2, 3}, true), Vector3d(0, 0, -9.81));
  EXPECT_EQ(felt.at({5, 6, 7, 1}, {1, 2, 3}, false), Vector3d::Zero());
  EXPECT_FALSE(felt.turns());
}

TEST(Felt, LegsAccelerateOneAfterTheOther) {
  MovingFrame frame;
  frame.legs = {{2, {0, 0, 3}}, {1, {-4, 0, 0}}};
  const WorldSettings settings = with(frame);
  const auto felt_at = [&](double time) { return Felt(settings, 1, time).at({0, 0, 0, 1}, {0, 0, 0}, true); };
  EXPECT_EQ(felt_at(0), Vector3d(0, 0, -9.81 - 3));
  EXPECT_EQ(felt_at(2), Vector3d(4, 0, -9.81)) << "from that moment on";
  EXPECT_EQ(felt_at(3), Vector3d(0, 0, -9.81));
  const FrameMotion end = motion_at(settings, frame, 5);
  EXPECT_EQ(end.velocity, Vector3d(-4, 0, 6));
  EXPECT_EQ(end.way, Vector3d(-2 - 8, 0, 6 + 18));
}

TEST(Felt, ThrowsOutwardWhereTheFrameTurns) {
  MovingFrame frame;
  frame.spin = {0, 0, 2};
  WorldSettings settings = with(frame);
  settings.gravity = UniformGravity{Vector3d::Zero()};
  const Felt felt(settings, 1, 0);
  EXPECT_EQ(felt.at({1, 0, 0, 1}, {4, 0, 1}, true), Vector3d(4 * 20, 0, 0));
  // To the right of whoever goes, seen along the spin.
  const Vector3d coriolis = felt.coriolis({1, 0, 0});
  EXPECT_NEAR(coriolis.y(), -2 * 2 * 1, 0.01);
  const double dt = settings.time_step;
  EXPECT_NEAR((Vector3d(1, 0, 0) + coriolis * dt).norm(), 1, 1e-15) << "its power is 0";
}

// Beside differences of where it is.
TEST(Felt, MotionOfAFrameInAFrameIsWhatItsPlaceDoes) {
  MovingFrame outer;
  outer.velocity = {3, -1, 2};
  outer.spin = {0.1, 0.2, -0.3};
  outer.legs = {{100, {0.5, 0, -0.2}}};
  MovingFrame inner;
  inner.start = {{{2, -1, 0, 1}, {3, 4, 5}}, rotation_by({0.3, -0.2, 1})};
  inner.velocity = {0, 4, 1};
  inner.spin = {0, 0.5, 0.1};
  inner.legs = {{100, {0, 0.3, 0.1}}};
  WorldSettings settings = with(outer);
  settings.frames.push_back(inner);
  constexpr double kStep = 1e-4;  // s
  for (const double time : {1.0, 7.0, 40.0}) {
    const FrameMotion before = motion_in_world(settings, inner, time - kStep);
    const FrameMotion now = motion_in_world(settings, inner, time);
    const FrameMotion after = motion_in_world(settings, inner, time + kStep);
    EXPECT_LT(((after.way - before.way) / (2 * kStep) - now.velocity).norm(), 1e-5);
    EXPECT_LT(((after.velocity - before.velocity) / (2 * kStep) - now.acceleration).norm(), 1e-5);
    const Vector3d turned = rotation_vector(after.orientation * before.orientation.conjugate());
    EXPECT_LT((turned / (2 * kStep) - now.spin).norm(), 1e-7);
    EXPECT_LT(((after.spin - before.spin) / (2 * kStep) - now.angular_acceleration).norm(), 1e-7);
  }
}

TEST(Felt, WakesBySteps) {
  MovingFrame frame;
  frame.legs = {{1, {0, 0, 0.004}}, {1, {0, 0, 0.1}}};
  const WorldSettings settings = with(frame);
  EXPECT_EQ(Felt(settings, 1, 0.5).steps(), Felt(settings, 1, 0.2).steps());
  EXPECT_NE(Felt(settings, 1, 1.5).steps(), Felt(settings, 1, 0.5).steps());
}

// On a planet that turns, in a town that turns with it.
TEST(Felt, APlanetPullsATownThatGoesRoundWithIt) {
  constexpr double kRadius = 6.4e6;
  constexpr double kDay = 7.3e-5;  // rad/s
  MovingFrame frame;
  frame.spin = {0, 0, kDay};
  WorldSettings settings = with(frame);
  settings.gravity = CentralGravity{{}, 9.81, kRadius};
  const std::int64_t sectors = static_cast<std::int64_t>(kRadius) / 16;
  for (const double time : {0.0, 3000.0}) {
    const Vector3d felt = Felt(settings, 1, time).at({sectors, 0, 0, 1}, Vector3d::Zero(), true);
    EXPECT_LT((felt - Vector3d(-9.81 + kDay * kDay * kRadius, 0, 0)).norm(), 1e-9) << time;
  }
}

// A station that falls around a planet, on a circle and on an ellipse.
TEST(Felt, TidesAreAllThatIsFeltInAnOrbit) {
  constexpr double kRadius = 6.4e6;
  constexpr double kHigh = 6.8e6;
  const double pull = 9.81 * kRadius * kRadius;
  const double circular = std::sqrt(pull / kHigh);
  const double rate = circular / kHigh;
  MovingFrame frame;
  frame.start.position = *canonical({}, {kHigh, 0, 0}, 16);
  frame.velocity = {0, circular, 0};
  frame.falls = true;
  WorldSettings settings = with(frame);
  settings.gravity = CentralGravity{{}, 9.81, kRadius};
  const Felt felt(settings, 1, 0);
  EXPECT_EQ(felt.at({0, 0, 0, 1}, Vector3d::Zero(), true), Vector3d::Zero());
  // Outward by 2 w^2 r, and inward by w^2 r across.
  const Vector3d outward = felt.at({0, 0, 0, 1}, {0.01, 0, 0}, true);
  EXPECT_NEAR(outward.x() / (2 * rate * rate * 0.01), 1, 1e-7);
  const Vector3d across = felt.at({0, 0, 0, 1}, {0, 0, 5}, true);
  EXPECT_NEAR(across.z() / (-rate * rate * 5), 1, 1e-6);

  const double round = 2 * std::numbers::pi / rate;
  const FrameMotion quarter = motion_at(settings, frame, round * 1000.25);
  EXPECT_LT((quarter.way - Vector3d(-kHigh, kHigh, 0)).norm(), 0.01) << "after a thousand rounds";
  EXPECT_LT((quarter.velocity - Vector3d(-circular, 0, 0)).norm(), 1e-5);

  settings.frames[0].velocity = {300, 1.1 * circular, 200};
  for (const double time : {1.0, 1000.0, 9876.0, 1e6}) {
    const MovingFrame& ellipse = settings.frames[0];
    const FrameMotion now = motion_at(settings, ellipse, time);
    const FrameMotion later = motion_at(settings, ellipse, time + 0.1);
    const Vector3d place = Vector3d(kHigh, 0, 0) + now.way;
    const auto energy = [&](const Vector3d& velocity, double distance) {
      return velocity.squaredNorm() / 2 - pull / distance;
    };
    EXPECT_NEAR(energy(now.velocity, place.norm()) / energy(ellipse.velocity, kHigh), 1, 1e-9) << time;
    EXPECT_LT((place.cross(now.velocity) - Vector3d(kHigh, 0, 0).cross(ellipse.velocity)).norm(),
              1e-9 * kHigh * circular);
    const Vector3d accelerates = (later.velocity - now.velocity) / 0.1;
    EXPECT_LT((accelerates + pull / std::pow(place.norm(), 3) * place).norm(), 2e-3) << time;
    EXPECT_LT(((later.way - now.way) / 0.1 - (now.velocity + later.velocity) / 2).norm(), 1e-3) << time;
  }
}

TEST(Felt, NothingIsFeltInALiftThatFalls) {
  MovingFrame frame;
  frame.velocity = {1, 0, 2};
  frame.falls = true;
  const WorldSettings settings = with(frame);
  const Felt felt(settings, 1, 3);
  EXPECT_EQ(felt.at({0, 0, 0, 1}, {1, 2, 3}, true), Vector3d::Zero());
  EXPECT_EQ(felt.at({0, 0, 0, 1}, {1, 2, 3}, false), Vector3d(0, 0, 9.81)) << "what has no weight does not";
  EXPECT_LT((motion_at(settings, frame, 3).way - Vector3d(3, 0, 6 - 9.81 * 4.5)).norm(), 1e-12);
}

// The numbers of an asymmetric top that is at rest as seen from where nothing turns.
TEST(Felt, TorqueKeepsWhatDoesNotTurnOutside) {
  MovingFrame frame;
  frame.spin = {0.1, -0.2, 0.3};
  WorldSettings settings = with(frame);
  settings.time_step = 1e-3;
  const Felt felt(settings, 1, 0);
  const Eigen::Matrix3d inertia = Vector3d(1, 2, 4).asDiagonal();
  const Vector3d rate = -frame.spin;
  // Its rate in the frame turns with the axes of the frame; its own turning is part of the engine's.
  const Vector3d own = -rate.cross(Vector3d(inertia * rate));
  const Vector3d right = Vector3d::Zero();  // -spin x rate
  const Vector3d got = inertia.inverse() * (felt.torque(inertia, rate) + own);
  EXPECT_LT((got - right).norm(), 1e-4);
}

}  // namespace
}  // namespace tessera
