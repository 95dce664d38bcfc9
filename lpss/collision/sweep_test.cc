// Shapes that go along a line stop where they touch others.
#include "lpss/collision/sweep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "lpss/collision/closest.h"
#include "lpss/collision/test_shapes.h"

namespace tessera::collision {
namespace {

using ExactCore = Core<double>;

const Eigen::Matrix3d kSweepUpright = Eigen::Matrix3d::Identity();
const Eigen::Vector3d kSweepEast = Eigen::Vector3d::UnitX();

ExactCore core_ball(double radius) { return {.kind = ExactCore::Kind::kPoint, .margin = radius}; }
ExactCore core_box(const Eigen::Vector3d& half) { return {.kind = ExactCore::Kind::kBox, .half = half}; }
ExactCore core_capsule(double radius, double half) {
  return {.kind = ExactCore::Kind::kSegment, .half = {0, 0, half}, .margin = radius};
}
ExactCore core_cylinder(double radius, double half) {
  return {.kind = ExactCore::Kind::kCylinder, .half = {radius, radius, half}};
}
ExactCore core_ellipsoid(const Eigen::Vector3d& radii) {
  return {.kind = ExactCore::Kind::kEllipsoid, .half = radii};
}

void expect_sweep(const std::optional<SweepContact>& contact, double distance,
                  const Eigen::Vector3d& normal) {
  ASSERT_TRUE(contact);
  EXPECT_NEAR(contact->distance, distance, 1e-6);
  EXPECT_NEAR((contact->normal - normal).norm(), 0, 1e-5) << contact->normal.transpose();
}

TEST(Sweep, FacesMeetWhereTheyAreLevel) {
  const auto from = [](double y) {
    return sweep(core_box({0.5, 0.5, 0.5}), core_box({1, 1, 1}), {kSweepUpright, kSweepUpright, {10, y, 0}},
                 {kSweepEast, 20});
  };
  expect_sweep(from(0), 8.5, -kSweepEast);
  expect_sweep(from(1.4999), 8.5, -kSweepEast);
  EXPECT_FALSE(from(1.5001));
  EXPECT_FALSE(sweep(core_box({0.5, 0.5, 0.5}), core_box({1, 1, 1}),
                     {kSweepUpright, kSweepUpright, {10, 0, 0}}, {kSweepEast, 8.4999}));
  EXPECT_FALSE(sweep(core_box({0.5, 0.5, 0.5}), core_box({1, 1, 1}),
                     {kSweepUpright, kSweepUpright, {10, 0, 0}}, {-kSweepEast, 20}));
}

// Of a ball beside the line, as of a ray at a ball of both radii.
TEST(Sweep, BallsMeetAtTheSumOfTheirRadii) {
  for (const double aside : {0.0, 0.3, 0.7, 0.79}) {
    const double before = std::sqrt(0.8 * 0.8 - aside * aside);
    const auto contact = sweep(core_ball(0.3), core_ball(0.5), {kSweepUpright, kSweepUpright, {50, aside, 0}},
                               {kSweepEast, 100});
    expect_sweep(contact, 50 - before, Eigen::Vector3d(-before, -aside, 0) / 0.8);
  }
  EXPECT_FALSE(sweep(core_ball(0.3), core_ball(0.5), {kSweepUpright, kSweepUpright, {50, 0.80001, 0}},
                     {kSweepEast, 100}));
}

TEST(Sweep, ACapsuleMeetsACylinderAtItsSideAndItsRim) {
  const Eigen::Matrix3d lying = rotation<double>(std::numbers::pi / 2, 1, 0, 0);  // along y
  expect_sweep(sweep(core_capsule(0.2, 0.5), core_cylinder(0.4, 1), {lying, kSweepUpright, {5, 0, 0}},
                     {kSweepEast, 9}),
               4.4, -kSweepEast);
  // The ball at its end is 0.1 m over the cap: it meets the rim at a height of half its radius.
  const double before = 0.2 * std::sqrt(0.75);
  expect_sweep(sweep(core_capsule(0.2, 0.5), core_cylinder(0.4, 1),
                     {kSweepUpright, kSweepUpright, {5, 0, -1.6}}, {kSweepEast, 9}),
               5 - 0.4 - before, Eigen::Vector3d(-before, 0, 0.1) / 0.2);
}

TEST(Sweep, WhatOverlapsTouchesAtOnceAndWhatJustTouchesMaySlideAndLeave) {
  const auto from = [](double height, const Eigen::Vector3d& direction) {
    return sweep(core_box({0.5, 0.5, 0.5}), core_box({9, 9, 1}),
                 {kSweepUpright, kSweepUpright, {0, 0, -1.5 - height}}, {direction, 5});
  };
  expect_sweep(from(-0.01, kSweepEast), 0, Eigen::Vector3d::UnitZ());
  expect_sweep(from(-0.01, Eigen::Vector3d::UnitZ()), 0, Eigen::Vector3d::UnitZ());
  for (const double height : {-0.5 * kSweepTouching, 0.0, 0.5 * kSweepTouching}) {
    EXPECT_FALSE(from(height, kSweepEast)) << height;
    EXPECT_FALSE(from(height, Eigen::Vector3d::UnitZ())) << height;
    expect_sweep(from(height, -Eigen::Vector3d::UnitZ()), std::max(0.0, height), Eigen::Vector3d::UnitZ());
  }
}

TEST(Sweep, AtAPlaneTheGapIsGoneAtOneRate) {
  const Eigen::Vector3d down = Eigen::Vector3d(3, 0, -4) / 5;
  expect_sweep(sweep_at_plane(2, Eigen::Vector3d::UnitZ(), {down, 3}), 2.5, Eigen::Vector3d::UnitZ());
  EXPECT_FALSE(sweep_at_plane(2, Eigen::Vector3d::UnitZ(), {down, 2.4999}));
  EXPECT_FALSE(sweep_at_plane(0, Eigen::Vector3d::UnitZ(), {kSweepEast, 3}));
  expect_sweep(sweep_at_plane(-1, Eigen::Vector3d::UnitZ(), {kSweepEast, 3}), 0, Eigen::Vector3d::UnitZ());
}

// Of all pairs of shapes, turned and placed at random: where one stops, they touch; and a little before, they
// did not.
TEST(Sweep, ShapesTouchWhereTheyStopAndNotBefore) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  const std::vector<Eigen::Vector3d> corners{
      {1, 0, 0}, {-0.4, 0.5, 0}, {-0.2, -0.7, 0.1}, {0.1, 0, 0.9}, {0, 0, -0.3}};
  const ExactCore hull{.kind = ExactCore::Kind::kPoints, .points = corners};
  const std::vector<Eigen::Vector3d> triangle{{1, 0, 0}, {-0.4, 0.5, 0}, {-0.2, -0.7, 0.1}};
  const ExactCore face{.kind = ExactCore::Kind::kPoints, .points = triangle};
  const std::vector<ExactCore> shapes{core_ball(0.4),
                                      core_box({0.3, 0.5, 0.2}),
                                      core_capsule(0.2, 0.6),
                                      core_cylinder(0.4, 0.3),
                                      core_ellipsoid({0.5, 0.2, 0.3}),
                                      hull,
                                      face};
  int hits = 0;
  for (const ExactCore& a : shapes) {
    for (const ExactCore& b : shapes) {
      for (int n = 0; n < 40; ++n) {
        const Eigen::Matrix3d turn_a = rotation<double>(normal(random), 1, normal(random), normal(random));
        const Eigen::Matrix3d turn_b = rotation<double>(normal(random), 1, normal(random), normal(random));
        const Eigen::Vector3d aim = any().normalized();
        const Placement<double> start{turn_a, turn_b, aim * 20 + 0.4 * any()};
        const auto contact = sweep(a, b, start, {aim, 40});
        if (!contact) continue;
        ++hits;
        const auto gap_at = [&](double distance) {
          const Placement<double> at{turn_a, turn_b, start.offset - aim * distance};
          return search_closest<double>(a, b, at, 100, Eigen::Vector3d::Zero())->gap;
        };
        EXPECT_NEAR(gap_at(contact->distance), 0, 1e-6);
        EXPECT_GT(gap_at(contact->distance - 1e-3), 0);
        EXPECT_NEAR(contact->normal.norm(), 1, 1e-12);
        EXPECT_LT(contact->normal.dot(aim), 0);
      }
    }
  }
  EXPECT_GT(hits, 1000);
}

}  // namespace
}  // namespace tessera::collision
