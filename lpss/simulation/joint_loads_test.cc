// What joints give along their axes and what they bear, against what mechanics says.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "lpss/joints/tree_dynamics.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

constexpr double kPull = 9.81;

JointLoads loads_of(PartitionCluster& cluster, std::uint64_t joint) {
  for (Rank rank = 0; rank < cluster.size(); ++rank) {
    if (const JointRecord* const record = cluster.partition(rank).joints.record(JointId{joint}))
      return record->loads;
  }
  ADD_FAILURE() << "no joint " << joint;
  return {};
}

double rate_of(PartitionCluster& cluster, std::uint64_t body) {
  const BodyRecord record = *cluster.body(BodyId{body});
  return Eigen::Vector3d(record.state.angular_velocity.data()).norm();
}

void expect_near(const std::array<double, 3>& found, const Eigen::Vector3d& wanted, double error) {
  EXPECT_NEAR((Eigen::Vector3d(found.data()) - wanted).norm(), 0, error)
      << Eigen::Vector3d(found.data()).transpose() << " in the place of " << wanted.transpose();
}

std::unique_ptr<PartitionCluster> after(const WorldDescription& world, int ticks,
                                        std::uint32_t partitions = 1) {
  auto cluster = cluster_of(world, partitions);
  for (int tick = 0; tick < ticks; ++tick) cluster->step();
  return cluster;
}

// Of 2 kg, whose centre is 0.5 m under its hinge about y.
WorldBuilder pendulum() {
  WorldBuilder builder(sectors_of(16));
  builder.add("bob", builder.shape(Box{{0.1, 0.1, 0.4}}), 2, {1, 0, -0.5});
  builder.tie("hinge", JointType::kRevolute, "", "bob", {1, 0, 0}, Eigen::Vector3d::UnitY());
  return builder;
}

// The joint frame: its x along the world's y, z up.
TEST(JointLoads, APendulumAtRestHangsOnItsHinge) {
  const auto cluster = after(pendulum().world(), 3);
  const JointLoads loads = loads_of(*cluster, 1);
  EXPECT_EQ(loads.effort[0], 0);
  expect_near(loads.force, {0, 0, 2 * kPull}, 1e-5);
  expect_near(loads.torque, {0, 0, 0}, 1e-5);
}

TEST(JointLoads, StayAsTheyWereInWhatSleepsAndGoOnInASnapshot) {
  WorldDescription world = pendulum().world();
  world.settings.sleep_after = 0.2;
  const auto cluster = after(world, 60);
  ASSERT_EQ(cluster->counts().bodies_awake, 0u);
  expect_near(loads_of(*cluster, 1).force, {0, 0, 2 * kPull}, 1e-5);
  const auto restored = PartitionCluster::restore(cluster->snapshot(), 2);
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(loads_of(**restored, 1), loads_of(*cluster, 1));
}

// About the hinge, m g l; what is beyond the motor's axis is borne by the joint.
TEST(JointLoads, AMotorThatHoldsAnArmLevelGivesItsMoment) {
  for (const DriveMode mode : {DriveMode::kPosition, DriveMode::kVelocity, DriveMode::kServo}) {
    WorldBuilder builder(sectors_of(16));
    builder.add("arm", builder.shape(Box{{1, 0.1, 0.1}}), 3, {0.5, 0.25, 0});
    JointDescription& motor =
        builder.tie("motor", JointType::kRevolute, "", "arm", {0, 0, 0}, Eigen::Vector3d::UnitY());
    motor.drives[0].mode = mode;
    if (mode == DriveMode::kServo) motor.drives[0] = {mode, 0, 1e6, 1e4};
    const auto cluster = after(builder.world(), 120);
    const JointLoads loads = loads_of(*cluster, 1);
    const double moment = 3 * kPull * 0.5;
    EXPECT_NEAR(loads.effort[0], -moment, 1e-4 * moment) << "gravity turns it to larger angles";
    EXPECT_NEAR(loads.torque[0], loads.effort[0], 1e-6) << "along the axis, the whole torque";
    EXPECT_NEAR(loads.torque[1], -0.25 * 3 * kPull, 1e-3) << "joint's y: against the world's x";
    EXPECT_NEAR(loads.torque[2], 0, 1e-3);
    EXPECT_NEAR(loads.force[2], 3 * kPull, 1e-3);
  }
}

TEST(JointLoads, ALiftBearsItsLoadAndWhatSpeedsItUp) {
  WorldBuilder builder(sectors_of(16));
  builder.add("cabin", builder.shape(Box{{1, 1, 1}}), 4, {0, 0, 0});
  JointDescription& lift =
      builder.tie("lift", JointType::kPrismatic, "", "cabin", {0, 0, 0}, Eigen::Vector3d::UnitZ());
  lift.drives[0] = {DriveMode::kEffort, 4 * (kPull + 1.5)};
  const auto cluster = after(builder.world(), 60);
  const JointLoads loads = loads_of(*cluster, 1);
  EXPECT_NEAR(loads.effort[0], 4 * (kPull + 1.5), 1e-5);
  EXPECT_NEAR(loads.force[0], 4 * (kPull + 1.5), 1e-3) << "x is the axis";
  EXPECT_NEAR(cluster->body(BodyId{1})->state.linear_velocity[2], 1.5, 1e-4);
}

TEST(JointLoads, ALimitGivesWhatItHolds) {
  WorldBuilder builder(sectors_of(16));
  builder.add("cabin", builder.shape(Box{{1, 1, 1}}), 4, {0, 0, 0});
  JointDescription& lift =
      builder.tie("lift", JointType::kPrismatic, "", "cabin", {0, 0, 0}, Eigen::Vector3d::UnitZ());
  lift.properties.axes[0].lower = -0.01;
  EXPECT_NEAR(loads_of(*after(builder.world(), 30), 1).effort[0], 4 * kPull, 1e-3);
}

TEST(JointLoads, ASpringGivesStiffnessTimesWay) {
  WorldBuilder builder(sectors_of(16));
  builder.world().settings.sleep_after = 0;  // never
  builder.add("cabin", builder.shape(Box{{1, 1, 1}}), 4, {0, 0, 0});
  JointDescription& lift =
      builder.tie("lift", JointType::kPrismatic, "", "cabin", {0, 0, 0}, Eigen::Vector3d::UnitZ());
  lift.properties.axes[0].spring_stiffness = 400;
  lift.properties.axes[0].damping = 80;
  const auto cluster = after(builder.world(), 300);
  EXPECT_NEAR(loads_of(*cluster, 1).effort[0], 4 * kPull, 1e-3);
  EXPECT_NEAR(cluster->body(BodyId{1})->state.position[2], -4 * kPull / 400, 1e-5);
}

TEST(JointLoads, EachLinkOfAChainBearsThoseBelowOnAnyServers) {
  WorldBuilder builder(sectors_of(2));
  builder.add_chain(10, {0.3, 0.2, 0.4}, -Eigen::Vector3d::UnitZ());
  const auto one = after(builder.world(), 5);
  const auto four = after(builder.world(), 5, 4);
  for (std::uint64_t joint = 1; joint <= 10; ++joint) {
    const JointLoads loads = loads_of(*one, joint);
    const double weight = static_cast<double>(11 - joint) * kPull;  // of links of 1 kg
    EXPECT_NEAR(Eigen::Vector3d(loads.force.data()).norm(), weight, 1e-4);
    expect_near(loads.torque, {0, 0, 0}, 1e-4);
    EXPECT_EQ(loads, loads_of(*four, joint)) << joint;
  }
}

TEST(JointLoads, AreTheSameOnAnyServersWhileAChainSwings) {
  const WorldDescription world = chain_world(sectors_of(2), 12, {0.3, 0.2, 0.4});
  auto one = cluster_of(world, 1);
  auto three = cluster_of(world, 3);
  for (int tick = 0; tick < 90; ++tick) {
    one->step();
    three->step();
    for (std::uint64_t joint = 1; joint <= 12; ++joint)
      ASSERT_EQ(loads_of(*one, joint), loads_of(*three, joint)) << tick;
  }
}

// Let go level, a pendulum passes its lowest point at w^2 = 2 m g l / (I + m l^2): the hinge bears
// m (g + w^2 l).
TEST(JointLoads, APendulumThatSwingsPullsMore) {
  WorldBuilder builder = pendulum();
  builder.world().settings.time_step = 1. / 240;
  BodyDescription& bob = builder.world().bodies[0];
  constexpr double kLength = 0.5;
  bob.pose.position.local = {1 - kLength, 0, 0};
  bob.pose.orientation = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY());
  auto cluster = cluster_of(builder.world(), 1);
  double most = 0;
  double fastest = 0;
  for (int tick = 0; tick < 240; ++tick) {
    cluster->step();
    most = std::max(most, loads_of(*cluster, 1).force[2]);
    fastest = std::max(fastest, rate_of(*cluster, 1));
  }
  EXPECT_NEAR(most, 2 * (kPull + fastest * fastest * kLength), 0.005 * most);
  const double inertia = 2 * (0.1 * 0.1 + 0.4 * 0.4) / 12;
  const double rate = std::sqrt(2 * 2 * kPull * kLength / (inertia + 2 * kLength * kLength));
  EXPECT_NEAR(fastest, rate, 0.002 * rate);
}

// A weight of 6 kg hangs on two hinged rods side by side, which close a loop: each bears half.
TEST(JointLoads, ALoopSharesWhatItBears) {
  WorldBuilder builder(sectors_of(16));
  const ShapeId rod = builder.shape(Box{{0.1, 0.1, 0.8}});
  builder.add("left", rod, 1, {-1, 0, -0.5});
  builder.add("right", rod, 1, {1, 0, -0.5});
  builder.add("weight", builder.shape(Box{{2.2, 0.2, 0.2}}), 6, {0, 0, -1});
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  builder.tie("above_left", JointType::kRevolute, "", "left", {-1, 0, 0}, y);
  builder.tie("above_right", JointType::kRevolute, "", "right", {1, 0, 0}, y);
  builder.tie("below_left", JointType::kRevolute, "left", "weight", {-1, 0, -1}, y);
  builder.tie("below_right", JointType::kRevolute, "right", "weight", {1, 0, -1}, y);
  const auto cluster = after(builder.world(), 10);
  expect_near(loads_of(*cluster, 1).force, {0, 0, 4 * kPull}, 1e-3);
  expect_near(loads_of(*cluster, 2).force, {0, 0, 4 * kPull}, 1e-3);
  expect_near(loads_of(*cluster, 3).force, {0, 0, 3 * kPull}, 1e-3);
  expect_near(loads_of(*cluster, 4).force, {0, 0, 3 * kPull}, 1e-3);
}

// What stands on the ground takes the ground's push, not the joint's: a table of one leg that a joint holds
// on.
TEST(JointLoads, WhatTheGroundBearsIsNotTheJoints) {
  WorldBuilder builder(sectors_of(16));
  builder.add_floor(10, 0);
  builder.add("leg", builder.shape(Box{{0.6, 0.6, 1}}), 5, {0, 0, 0.5});
  builder.add("top", builder.shape(Box{{1, 1, 0.1}}), 3, {0, 0, 1.1});
  builder.tie("glue", JointType::kFixed, "leg", "top", {0, 0, 1.05});
  const auto cluster = after(builder.world(), 20);
  expect_near(loads_of(*cluster, 1).force, {0, 0, 3 * kPull}, 0.01);
  expect_near(loads_of(*cluster, 1).torque, {0, 0, 0}, 0.02);
}

// Two bars on hinges, driven and moving: rates of now, and what they change by in a tick, by the time.
struct Course {
  Eigen::VectorXd rates;
  Eigen::VectorXd predicted;  // accelerations: M^-1 (efforts - bias)
  Eigen::VectorXd simulated;
};

Course course_of_a_tick(double dt) {
  WorldSettings settings = sectors_of(16);
  settings.time_step = dt;
  WorldBuilder builder(settings);
  const ShapeId bar = builder.shape(Box{{0.9, 0.1, 0.1}});
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  BodyDescription& first = builder.add("first", bar, 2, {0.5, 0, 0});
  first.linear_velocity = {0, 0, -0.75};
  first.angular_velocity = {0, 1.5, 0};
  BodyDescription& second = builder.add("second", bar, 1, {1.5, 0, 0});
  second.linear_velocity = {0, 0, -0.75};
  second.angular_velocity = {0, -1.5, 0};
  const Eigen::Vector2d efforts(3, -1);
  builder.tie("shoulder", JointType::kRevolute, "", "first", {0, 0, 0}, y).drives[0] = {DriveMode::kEffort,
                                                                                        efforts[0]};
  builder.tie("elbow", JointType::kRevolute, "first", "second", {1, 0, 0}, y).drives[0] = {DriveMode::kEffort,
                                                                                           efforts[1]};
  const std::vector<JointRecord> joints = *joint_records_of(builder.world());
  auto cluster = cluster_of(builder.world(), 1);
  const auto dynamics = [&] {
    std::vector<joints::TreeBody> bodies;
    for (const std::uint64_t id : {1, 2}) {
      const BodyRecord body = *cluster->body(BodyId{id});
      joints::TreeBody& of = bodies.emplace_back();
      of.mass = body.properties.mass;
      of.side = side_of(body.state);
      const Eigen::Matrix3d axes = of.side.pose.orientation.toRotationMatrix();
      of.inertia = axes * Eigen::Vector3d(body.properties.inertia.data()).asDiagonal() * axes.transpose();
      of.force = {0, 0, -of.mass * kPull};
    }
    const std::vector<joints::TreeJoint> tree{{&joints[0].properties, std::nullopt, 0},
                                              {&joints[1].properties, 0, 1}};
    return joints::TreeDynamics(bodies, tree, {});
  };
  const joints::TreeDynamics before = dynamics();
  const Eigen::VectorXd bias = before.efforts(Eigen::VectorXd::Zero(2));
  cluster->step();
  return {before.velocities(), before.mass_matrix().ldlt().solve(efforts - bias),
          (dynamics().velocities() - before.velocities()) / dt};
}

TEST(Dynamics, TheSimulationAcceleratesAsTheyPredict) {
  double error = 1;
  for (const double dt : {1. / 100, 1. / 400, 1. / 1600}) {
    const Course course = course_of_a_tick(dt);
    EXPECT_NEAR(course.rates[0], 1.5, 1e-6);
    EXPECT_NEAR(course.rates[1], -3, 1e-6);
    const double now = (course.simulated - course.predicted).norm() / course.predicted.norm();
    EXPECT_LT(now, error / 3) << "of first order in the length of a tick: " << dt;
    error = now;
  }
  EXPECT_LT(error, 5e-3);
}

}  // namespace
}  // namespace tessera
