#include "lpss/base/torque_free.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "lpss/base/rotation.h"

namespace tessera {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kTick = 1.0 / 60;
const Vector3d kBrick(0.4, 1.04, 1.36);

Vector3d momentum_of(const Spin& spin, const Vector3d& moments) {
  return spin.axes * moments.cwiseProduct(spin.axes.transpose() * spin.rate);
}

double energy_of(const Spin& spin, const Vector3d& moments) {
  return spin.rate.dot(momentum_of(spin, moments)) / 2;
}

Spin tumbling(double rate) {
  return {rotation_by({0.3, -1.2, 0.4}).toRotationMatrix(), Vector3d(0.1, 1, 0.4).normalized() * rate};
}

TEST(TorqueFree, KeepsMomentumAndEnergyAtAnySpin) {
  for (const double rate : {1e-3, 0.1, 1.0, 3.0, 10.0, 100.0, 1000.0, 5000.0}) {
    const Spin start = tumbling(rate);
    Spin spin = start;
    for (int tick = 0; tick < 1000; ++tick) {
      spin = torque_free(spin, kBrick, kTick);
      ASSERT_NEAR(energy_of(spin, kBrick) / energy_of(start, kBrick), 1, 1e-3) << rate << " rad/s, " << tick;
    }
    const Vector3d momentum = momentum_of(start, kBrick);
    EXPECT_LT((momentum_of(spin, kBrick) - momentum).norm() / momentum.norm(), 1e-10) << rate << " rad/s";
    EXPECT_LT((spin.axes.transpose() * spin.axes - Matrix3d::Identity()).norm(), 1e-11);
  }
}

// In many small steps a body follows Euler's equations, whatever order its moments have.
TEST(TorqueFree, FollowsEulersEquations) {
  for (const Vector3d& moments :
       {Vector3d(1, 2, 2.5), Vector3d(2.5, 1, 2), Vector3d(2, 2.5, 1), Vector3d(2, 1, 2.5)}) {
    const Spin start = tumbling(2);
    constexpr double kStep = 1e-6;
    const Spin end = torque_free(start, moments, kStep);
    const Vector3d spin = start.axes.transpose() * start.rate;
    const Vector3d change = -spin.cross(moments.cwiseProduct(spin)).cwiseQuotient(moments) * kStep;
    EXPECT_LT((end.rate - start.rate - start.axes * change).norm(), 1e-10);
    EXPECT_LT((end.axes - rotation_by(start.rate * kStep).toRotationMatrix() * start.axes).norm(), 1e-10);
  }
}

TEST(TorqueFree, IsOfSecondOrder) {
  const auto end_after = [](int steps) {
    Spin spin = tumbling(3);
    for (int n = 0; n < steps; ++n) spin = torque_free(spin, kBrick, 1.0 / steps);
    return spin.axes;
  };
  const Matrix3d exact = end_after(20000);
  const double coarse = (end_after(100) - exact).norm();
  const double fine = (end_after(200) - exact).norm();
  EXPECT_LT(coarse, 1e-3);
  EXPECT_NEAR(coarse / fine, 4, 0.4);
}

// A symmetric top precesses steadily about its angular momentum: one step of any length is enough.
TEST(TorqueFree, IsExactIfTwoMomentsAreEqual) {
  for (const Vector3d& moments :
       {Vector3d(1, 1, 2), Vector3d(2, 1, 1), Vector3d(1, 2, 1), Vector3d(2, 2, 1), Vector3d(1, 1, 1)}) {
    const Spin start = tumbling(50);
    Spin in_steps = start;
    for (int n = 0; n < 1000; ++n) in_steps = torque_free(in_steps, moments, 0.1 / 1000);
    const Spin at_once = torque_free(start, moments, 0.1);
    EXPECT_LT((at_once.axes - in_steps.axes).norm(), 1e-9);
    EXPECT_LT((at_once.rate - in_steps.rate).norm(), 1e-7);
  }
}

TEST(TorqueFree, WhatDoesNotSpinStays) {
  const Spin still{rotation_by({0.3, -1.2, 0.4}).toRotationMatrix(), Vector3d::Zero()};
  EXPECT_EQ(torque_free(still, kBrick, kTick).axes, still.axes);
  EXPECT_EQ(torque_free(still, kBrick, kTick).rate, Vector3d::Zero());
}

Vector3d rate_after(const Matrix3d& inertia, const Vector3d& last, double dt) {
  SteppedRate next = next_rate(inertia, inertia.inverse(), last, dt);
  for (int pass = 0; pass < 3; ++pass) {
    const Vector3d beyond = momentum_beyond_middle(inertia, next.rate, next.rate, dt);
    next.rate += inertia.inverse() * (beyond - next.beyond_middle);
    next.beyond_middle = beyond;
  }
  return next.rate;
}

TEST(StepsOfConstantRate, KeepMomentumAndEnergy) {
  constexpr double kStep = 1.0 / 240;
  for (const double spin : {1.0, 30.0, 150.0}) {
    Matrix3d axes = rotation_by({0.3, -1.2, 0.4}).toRotationMatrix();
    Vector3d rate = Vector3d(0.1, 1, 0.4).normalized() * spin;
    const auto inertia = [&] { return Matrix3d(axes * kBrick.asDiagonal() * axes.transpose()); };
    const auto middle = [&] {
      return Vector3d(inertia() * rate - momentum_beyond_middle(inertia(), rate, rate, kStep));
    };
    const Vector3d momentum = middle();
    const double energy = rate.dot(inertia() * rate);
    const double most = spin * kStep;  // rad in a step
    for (int n = 0; n < 24000; ++n) {
      axes = rotation_by(rate * kStep).toRotationMatrix() * axes;
      rate = rate_after(inertia(), rate, kStep);
    }
    EXPECT_NEAR(rate.dot(inertia() * rate) / energy, 1, most * most) << spin;
    EXPECT_LT((middle() - momentum).norm() / momentum.norm(), most * most) << spin;
  }
}

// In steps in which the body turns about its axis by up to half a turn.
TEST(StepsOfConstantRate, KeepMomentumAndEnergyOfARotorHoweverFastItSpins) {
  constexpr double kStep = 1.0 / 240;
  const Vector3d moments(0.3, 0.3, 0.5);
  for (const double spin : {3.0, 100.0, 750.0}) {
    Matrix3d axes = rotation_by({0.3, -1.2, 0.4}).toRotationMatrix();
    Vector3d rate = axes * Vector3d(1, 2, spin);
    const auto inertia = [&] { return Matrix3d(axes * moments.asDiagonal() * axes.transpose()); };
    const auto tilt = [&] { return Vector3d(rate - axes.col(2) * axes.col(2).dot(rate)); };
    const auto middle = [&] {
      return Vector3d(inertia() * rate - momentum_beyond_middle(inertia(), rate, tilt(), kStep));
    };
    const Vector3d momentum = middle();
    const double energy = rate.dot(inertia() * rate);
    for (int n = 0; n < 24000; ++n) {
      const Matrix3d turn = rotation_by(tilt() * kStep).toRotationMatrix();
      axes = turn * rotation_by((rate - tilt()) * kStep).toRotationMatrix() * axes;
      rate = next_rate_of_rotor(inertia(), axes.col(2), turn * rate, kStep).rate;
    }
    EXPECT_NEAR(rate.dot(inertia() * rate) / energy, 1, 1e-8) << spin;
    EXPECT_LT((middle() - momentum).norm() / momentum.norm(), 1e-8) << spin;
  }
}

// The error of an unsymmetric step is of the first order.
TEST(StepsOfConstantRate, HaveErrorsOfTheSecondOrder) {
  Spin exact = tumbling(3);
  for (int n = 0; n < 10000; ++n) exact = torque_free(exact, kBrick, 1.0 / 10000);
  const auto error = [&](int steps) {
    const double dt = 1.0 / steps;
    const Spin start = tumbling(3);
    // Half a step back: to where the rate is that of the step before.
    const Spin before = torque_free(start, kBrick, -dt / 2);
    Matrix3d axes = start.axes;
    Vector3d rate = before.rate;
    for (int n = 0; n < steps; ++n) {
      const Matrix3d inertia = axes * kBrick.asDiagonal() * axes.transpose();
      rate = rate_after(inertia, rate, dt);
      axes = rotation_by(rate * dt).toRotationMatrix() * axes;
    }
    return (axes - exact.axes).norm();
  };
  EXPECT_LT(error(400), 1e-3);
  EXPECT_NEAR(error(200) / error(400), 4, 0.5);
}

}  // namespace
}  // namespace tessera
