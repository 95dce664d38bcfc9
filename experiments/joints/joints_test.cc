// Mechanisms move as mechanics says, and the rows tell it.
#include "experiments/joints/joints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <string>

#include "experiments/joints/mechanism.h"
#include "lpss/simulation/simulation.h"

namespace tessera::mechanisms {
namespace {

Report measured(const std::string& only) {
  absl::StatusOr<Report> report = measure_joints(
      {.quick = true, .only = only}, [](std::uint64_t, std::uint64_t, const Report&) { return true; });
  EXPECT_TRUE(report.ok()) << report.status();
  return report.ok() ? *std::move(report) : Report();
}

Mechanism mechanism_of(const std::string& name) {
  for (const Mechanism& mechanism : all_mechanisms()) {
    if (mechanism.name == name) return mechanism;
  }
  ADD_FAILURE() << name;
  return {};
}

TEST(JointsExperiment, DrivesDoAsTheyAreToldBesideBullets) {
  Report report = measured("drive ");
  EXPECT_THAT(report.misses, testing::IsEmpty());
  std::set<std::string> worlds;
  for (const Row& row : report.table("rows")) {
    worlds.insert(row["world"]);
    EXPECT_TRUE(row["whole"]) << row;
    EXPECT_GT(row["tick_us"], 0) << row;
    if (row["world"] == "plain Bullet") continue;
    EXPECT_LT(row["gap_um"], 100) << row;
    EXPECT_LT(row["error"], 0.02) << row;
  }
  EXPECT_THAT(worlds, testing::ElementsAre("Tessera", "plain Bullet", "sectors of 4 m"));
}

TEST(JointsExperiment, AWhipKeepsItsLengthAndItsEnergy) {
  Report report = measured("whip");
  EXPECT_THAT(report.misses, testing::IsEmpty());
  const Row& row = report.table("rows").at(0);
  EXPECT_EQ(row["joints"], 60);
  EXPECT_LT(row["gap_um"], 500) << row;
  EXPECT_LT(row["energy_gain"], 0.01) << row;
  EXPECT_TRUE(report.table("rows").at(2)["same_bits"]);
}

TEST(JointsExperiment, SaysWhereNoMechanismHasTheName) {
  EXPECT_FALSE(measure_joints({.only = "perpetual motion"}, {}).ok());
}

// Two equal rods of 1 m, angles from the level downwards, by Lagrange: M(a) a'' = f(a, a').
struct Pendulum {
  using State = std::array<double, 4>;  // angles, rates

  static State rates(const State& s) {
    constexpr double kMoment = (1 + 0.1 * 0.1) / 12;  // kg m^2, of a rod about its centre
    constexpr double kGravity = 9.81;
    const double turned = std::cos(s[0] - s[1]) / 2;
    const double across = std::sin(s[0] - s[1]) / 2;
    const double m00 = kMoment + 0.25 + 1;
    const double m11 = kMoment + 0.25;
    const double f0 = 1.5 * kGravity * std::cos(s[0]) - across * s[3] * s[3];
    const double f1 = 0.5 * kGravity * std::cos(s[1]) + across * s[2] * s[2];
    const double det = m00 * m11 - turned * turned;
    return {s[2], s[3], (m11 * f0 - turned * f1) / det, (m00 * f1 - turned * f0) / det};
  }
};

// One step of Runge and Kutta's.
Pendulum::State after(const Pendulum::State& s, double dt) {
  const auto plus = [&](const Pendulum::State& way, double time) {
    Pendulum::State sum = s;
    for (std::size_t n = 0; n < sum.size(); ++n) sum[n] += time * way[n];
    return sum;
  };
  const Pendulum::State k1 = Pendulum::rates(s);
  const Pendulum::State k2 = Pendulum::rates(plus(k1, dt / 2));
  const Pendulum::State k3 = Pendulum::rates(plus(k2, dt / 2));
  const Pendulum::State k4 = Pendulum::rates(plus(k3, dt));
  Pendulum::State end = s;
  for (std::size_t n = 0; n < end.size(); ++n) end[n] += dt / 6 * (k1[n] + 2 * k2[n] + 2 * k3[n] + k4[n]);
  return end;
}

TEST(JointsExperiment, SmallStepsAreAReference) {
  WorldSettings settings;
  settings.time_step = 1.0 / 1920;
  settings.substeps = 1;
  settings.adapt = false;
  settings.sleep_after = 0;
  const auto simulation = Simulation::create(mechanism_of("double_pendulum").world(settings)).value();
  Pendulum::State exact{};
  for (int tick = 0; tick < 1920; ++tick) {
    simulation->step();
    exact = after(exact, settings.time_step);
  }
  const Eigen::Vector3d elbow(std::cos(exact[0]), 0, -std::sin(exact[0]));
  const Eigen::Vector3d half = Eigen::Vector3d(std::cos(exact[1]), 0, -std::sin(exact[1])) / 2;
  std::vector<Eigen::Vector3d> places;
  simulation->for_each_body([&](const BodyRecord& body) { places.emplace_back(body.state.position.data()); });
  EXPECT_LT((places.at(0) - elbow / 2).norm(), 0.003);
  EXPECT_LT((places.at(1) - elbow - half).norm(), 0.003);
}

}  // namespace
}  // namespace tessera::mechanisms
