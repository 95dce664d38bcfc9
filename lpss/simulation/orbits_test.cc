// Free flight around a planet against the solution of two bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

constexpr double kRadius = 6.371e6;  // m, of the planet
constexpr double kSurface = 9.81;    // m/s^2
constexpr double kPull = kSurface * kRadius * kRadius;

struct Motion3 {
  Eigen::Vector3d position;  // m, from the planet's centre
  Eigen::Vector3d velocity;  // m/s
};

// Two bodies, after `time` seconds on an ellipse, from its lowest point.
Motion3 on_ellipse(const Motion3& lowest, double time) {
  const double low = lowest.position.norm();
  const double speed = lowest.velocity.norm();
  const double axis = 1 / (2 / low - speed * speed / kPull);  // half of the major one
  const double eccentricity = 1 - low / axis;
  const double rate = std::sqrt(kPull / (axis * axis * axis));
  double anomaly = rate * time;
  for (int n = 0; n < 50; ++n) {
    anomaly -=
        (anomaly - eccentricity * std::sin(anomaly) - rate * time) / (1 - eccentricity * std::cos(anomaly));
  }
  const double flat = std::sqrt(1 - eccentricity * eccentricity);
  const Eigen::Vector3d p = lowest.position / low;
  const Eigen::Vector3d q = lowest.velocity / speed;
  const double turning = rate / (1 - eccentricity * std::cos(anomaly));
  return {axis * ((std::cos(anomaly) - eccentricity) * p + flat * std::sin(anomaly) * q),
          axis * turning * (-std::sin(anomaly) * p + flat * std::cos(anomaly) * q)};
}

double energy(const Motion3& motion) {
  return motion.velocity.squaredNorm() / 2 - kPull / motion.position.norm();
}

// A satellite that starts in sector 0, at the lowest point of its orbit, in a plane across all axes.
class Satellite {
 public:
  Satellite(double height, double speed_by_circular, double time_step) {
    WorldSettings settings;
    settings.precision = engine_tests::test_precision;
    settings.time_step = time_step;
    const Eigen::Vector3d up = Eigen::Vector3d(2, -1, 2) / 3;
    start_.position = up * (kRadius + height);
    start_.velocity = Eigen::Vector3d(1, 2, 0).normalized() *
                      (speed_by_circular * std::sqrt(kPull / start_.position.norm()));
    const absl::StatusOr<WorldPosition> centre = canonical({}, -start_.position, settings.sector_size);
    EXPECT_TRUE(centre.ok());
    centre_ = *centre;
    settings.gravity = CentralGravity{centre_, kSurface, kRadius};
    WorldBuilder builder(settings);
    builder.add("satellite", builder.shape(Sphere{0.5}), 100, {0, 0, 0}).linear_velocity = start_.velocity;
    auto simulation = Simulation::create(builder.world());
    EXPECT_TRUE(simulation.ok()) << simulation.status();
    simulation_ = std::move(*simulation);
  }

  void fly_for(double seconds) {
    const auto ticks = std::lround(seconds / simulation_->partition().dt());
    for (long tick = 0; tick < ticks; ++tick) simulation_->step();
  }

  double time() const { return static_cast<double>(simulation_->tick()) * simulation_->partition().dt(); }
  Motion3 right() const { return on_ellipse(start_, time()); }

  Motion3 motion() const {
    Motion3 motion;
    simulation_->for_each_body([&](const BodyRecord& body) {
      motion.position = metres_between(centre_.sector, body.home, simulation_->partition().sector_size()) +
                        (Eigen::Vector3d(body.state.position.data()) - centre_.local);
      motion.velocity = Eigen::Vector3d(body.state.linear_velocity.data());
    });
    return motion;
  }

 private:
  Motion3 start_;
  WorldPosition centre_;
  std::unique_ptr<Simulation> simulation_;
};

TEST(Orbits, HalfAnHourAt400KilometresEndsWhereTwoBodiesDo) {
  Satellite satellite(400e3, 1, 1.0 / 60);
  for (int part = 0; part < 3; ++part) {
    satellite.fly_for(600);
    const Motion3 is = satellite.motion();
    const Motion3 right = satellite.right();
    EXPECT_NEAR(is.position.norm(), right.position.norm(), 2e-3) << satellite.time();
    EXPECT_LT((is.position - right.position).norm(), 0.02) << satellite.time();
    EXPECT_LT((is.velocity - right.velocity).norm(), 1e-4) << "at the end of the tick";
  }
}

TEST(Orbits, AnEllipseKeepsItsEnergy) {
  constexpr double kStep = 0.1;
  Satellite satellite(400e3, 1.2, kStep);  // up to 11,000 km
  const double at_start = energy(satellite.motion());
  double farthest = 0;
  for (int turn = 0; turn < 2; ++turn) {
    double worst = 0;
    for (int part = 0; part < 20; ++part) {
      satellite.fly_for(400);
      worst = std::max(worst, std::abs(energy(satellite.motion()) / at_start - 1));
      farthest = std::max(farthest, satellite.motion().position.norm());
    }
    EXPECT_LT(worst, 5e-9) << "turn " << turn << ": it swings, and does not grow";
    EXPECT_LT((satellite.motion().position - satellite.right().position).norm(), 0.7 * (turn + 1));
  }
  EXPECT_GT(farthest, 1.5 * kRadius);
}

TEST(Orbits, ErrorsAreOfSecondOrder) {
  const auto error = [](double time_step) {
    Satellite satellite(400e3, 1.1, time_step);
    satellite.fly_for(4000);
    return (satellite.motion().position - satellite.right().position).norm();
  };
  EXPECT_NEAR(error(0.1) / error(0.05), 4, 0.2);
}

}  // namespace
}  // namespace tessera
