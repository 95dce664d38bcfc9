// Programs that sense and drive joints, against what mechanics says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "lpss/simulation/program_scenes.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kInertia = 0.5;  // kg m^2, of the rotor about its axis

ProgramRecord joint_program(absl::string_view kind, std::uint64_t joint, ProgramNumbers numbers) {
  numbers.emplace_back("joint", static_cast<double>(joint));
  return example_program(kind, numbers);
}

// A rotor on the world, on a border of sectors, about the vertical through its middle.
WorldBuilder rotor_world(const WorldSettings& settings, const ProgramRecord& program) {
  WorldBuilder builder(settings);
  BodyDescription& rotor = add_box(builder, "rotor", {0.8, 0.2, 0.2}, {0.3, 0.2, 0.2}, Motion::kDynamic, 2);
  rotor.properties.inertia = {0.1, kInertia, kInertia};
  rotor.programs = {program};
  builder.tie("axle", JointType::kRevolute, "", "rotor", {0.3, 0.2, 0.2}, Eigen::Vector3d::UnitZ());
  return builder;
}

// Of the first joint, as clients have it.
JointState state_of_joint(Watched& world, const std::string& parent, const std::string& child) {
  const JointProperties joint = joint_records_of(world.world())->at(0).properties;
  const BodyRecord held = world.body(child);
  const double size = world.world().settings.sector_size;
  JointSide parent_side;
  if (parent.empty()) {
    parent_side.pose.position = metres_between(held.home, joint.anchor, size);
  } else {
    const BodyRecord body = world.body(parent);
    parent_side = side_of(body.state);
    parent_side.pose.position += metres_between(held.home, body.home, size);
  }
  return joint_state(joint, parent_side, side_of(held.state));
}

struct Hinge {
  std::string controller;
  std::string parent;
};

// The controller is on a side of the joint, or on another body, which sleeps.
TEST(DrivenJoints, AreSensedAsClientsHaveThem) {
  for (const auto& [controller, parent] :
       {Hinge{"arm", "base"}, Hinge{"base", "base"}, Hinge{"arm", ""}, Hinge{"other", "base"}}) {
    for (const std::uint32_t partitions : {1u, 3u, 8u}) {
      SCOPED_TRACE(controller + " of " + parent + " on " + std::to_string(partitions));
      WorldBuilder builder(settings_of(1));
      add_box(builder, "base", {0.2, 0.2, 0.2}, {0.4, 0.2, 0.2}, Motion::kDynamic, 5);
      add_box(builder, "arm", {0.8, 0.1, 0.1}, {0.9, 0.2, 0.2}, Motion::kDynamic);
      add_box(builder, "other", {0.2, 0.2, 0.2}, {-4.1, 0.2, 0.2}, Motion::kKinematic);
      builder.tie("hinge", JointType::kRevolute, parent, "arm", {0.55, 0.2, 0.2}, Eigen::Vector3d::UnitY());
      for (BodyDescription& body : builder.world().bodies) {
        if (body.name == controller)
          body.programs = {joint_program("pid", 1, {{"set_point", 0.5}, {"p", 3}})};
      }
      Watched world(builder, partitions);
      for (int tick = 0; tick < 60; ++tick) {
        world.step();
        const JointState joint = state_of_joint(world, parent, "arm");
        ASSERT_NEAR(value_of(world.body(controller), "error"),
                    std::remainder(0.5 - joint.position[0], 2 * kPi), 1e-12);
        ASSERT_NEAR(value_of(world.body(controller), "effort"), 3 * value_of(world.body(controller), "error"),
                    1e-12);
      }
      EXPECT_GT(std::abs(value_of(world.body(controller), "error") - 0.5), 0.05) << "it has moved";
    }
  }
}

TEST(DrivenJoints, ThatAreGoneOrCannotBeDriven) {
  WorldBuilder builder(settings_of(1));
  for (const std::string name : {"one", "two", "three"})
    add_box(builder, name, {0.2, 0.2, 0.2}, {0.4, name == "one" ? 0.2 : 1.2, 0.2}, Motion::kDynamic);
  builder.tie("fixed", JointType::kFixed, "", "one", {0.4, 0.2, 0.4});
  builder.tie("hinge", JointType::kRevolute, "", "two", {0.4, 1.2, 0.4}, Eigen::Vector3d::UnitY());
  std::vector<BodyDescription>& bodies = builder.world().bodies;
  bodies[0].programs = {joint_program("pid", 1, {{"set_point", 1}, {"p", 1}})};
  bodies[1].programs = {joint_program("pid", 2, {{"set_point", 1}, {"p", 1}, {"axis", 2}})};
  bodies[2].programs = {joint_program("pid", 2, {{"set_point", 1}, {"p", 1}})};
  Watched world(builder, 2);
  world.step();
  EXPECT_EQ(world.body("one").programs[0].fault,
            "tick 1: joint 1: drive of axis 1 must be free: the joint has 0 axes with a coordinate");
  EXPECT_EQ(world.body("two").programs[0].fault,
            "tick 1: joint 2: drive of axis 2 must be free: the joint has 1 axes with a coordinate");
  EXPECT_GT(value_of(world.body("three"), "effort"), 0);
  world.step({RemoveJoint{JointId{2}}});
  const double effort = value_of(world.body("three"), "effort");
  world.run(0.2);
  EXPECT_EQ(value_of(world.body("three"), "effort"), effort);
  EXPECT_EQ(world.body("three").programs[0].fault, "");
  EXPECT_TRUE(validate(world.cluster().snapshot()).ok());
}

// I x'' = p (goal - x) - d x': a damped oscillator, the better the shorter a tick is. The effort of a tick
// follows from its beginning, half a tick late on average, which takes p dt / 2 from the damping.
TEST(Pid, AnswersAStepAsADampedOscillator) {
  constexpr double kStiffness = 8;
  constexpr double kDamping = 1;
  constexpr double kGoal = 0.8;
  for (const auto& [rate, bound] : {std::pair(60.0, 0.02), std::pair(240.0, 0.005)}) {
    WorldSettings settings = settings_of(1);
    settings.time_step = 1 / rate;
    Watched world(
        rotor_world(settings,
                    joint_program("pid", 1, {{"p", kStiffness}, {"d", kDamping}, {"set_point", kGoal}})),
        4);
    const double decay = (kDamping - kStiffness / rate / 2) / (2 * kInertia);
    const double swing = std::sqrt(kStiffness / kInertia - decay * decay);
    world.step();  // at whose end it begins
    for (double t = 0; t < 4; t += 1 / rate) {
      const double right =
          kGoal * (1 - std::exp(-decay * t) * (std::cos(swing * t) + decay / swing * std::sin(swing * t)));
      ASSERT_NEAR(kGoal - value_of(world.body("rotor"), "error"), right, bound * kGoal) << t << " s";
      world.step();
    }
  }
}

// A level arm of 1 kg, whose weight pulls with m g l cos(x).
TEST(Pid, HasNoErrorUnderALoadWithAnIntegral) {
  constexpr double kGoal = -0.4;
  for (const double integral : {0.0, 40.0}) {
    WorldBuilder builder(settings_of(2));
    add_box(builder, "arm", {1, 0.1, 0.1}, {1.2, 0.2, 0.2}, Motion::kDynamic).programs = {
        joint_program("pid", 1, {{"p", 40}, {"d", 8}, {"i", integral}, {"set_point", kGoal}})};
    builder.tie("shoulder", JointType::kRevolute, "", "arm", {0.7, 0.2, 0.2}, Eigen::Vector3d::UnitY());
    Watched world(builder, 2);
    world.run(12);
    const BodyRecord arm = world.body("arm");
    const double error = value_of(arm, "error");
    const double load = kG * 0.5 * std::cos(kGoal - error);
    EXPECT_NEAR(error, integral == 0 ? -load / 40 : 0, 2e-4);
    EXPECT_NEAR(value_of(arm, "effort"), -load, 0.01);
    EXPECT_NEAR(value_of(arm, "integral"), integral == 0 ? 0 : -load, 0.02);
  }
}

TEST(Pid, KeepsItsBoundsAndItsSumDoesNotGrowBeyondThem) {
  Watched world(rotor_world(
      settings_of(1), joint_program("pid", 1, {{"of_rate", 1}, {"p", 1}, {"i", 5}, {"effort_max", 0.3}})));
  world.tell("rotor", "set_point", 2);
  double fastest = 0;
  for (int tick = 0; tick < 600; ++tick) {
    world.step();
    const BodyRecord rotor = world.body("rotor");
    ASSERT_LE(std::abs(value_of(rotor, "effort")), 0.3);
    fastest = std::max(fastest, rotor.state.angular_velocity[2]);
    // 0.3 N m on 0.5 kg m^2.
    if (tick == 60) {
      EXPECT_NEAR(rotor.state.angular_velocity[2], 0.6 * 61 * kDt, 0.02);
    }
  }
  EXPECT_NEAR(value_of(world.body("rotor"), "error"), 0, 1e-3);
  EXPECT_LT(fastest, 2.4) << "it does not shoot far over";
}

TEST(Pid, LetsItsJointSleepWithinItsTolerance) {
  Watched world(
      rotor_world(settings_of(1),
                  joint_program("pid", 1, {{"p", 8}, {"d", 3}, {"set_point", 0.5}, {"tolerance", 1e-3}})));
  world.run(8);
  EXPECT_EQ(world.body("rotor").state.activity, Activity::kAsleep);
  EXPECT_NEAR(value_of(world.body("rotor"), "error"), 0, 1e-3);
  world.tell("rotor", "set_point", -0.5);
  world.run(0.5);
  EXPECT_LT(value_of(world.body("rotor"), "error"), -0.05);
  world.run(8);
  EXPECT_EQ(world.body("rotor").state.activity, Activity::kAsleep);
  EXPECT_NEAR(value_of(world.body("rotor"), "error"), 0, 1e-3);
}

// d / v + v / a, and a tick until it is told and moves.
TEST(Trajectory, TakesTheTimeOfATrapezoid) {
  constexpr double kSpeed = 1.5;
  constexpr double kAcceleration = 2;
  for (const double goal : {2.5, -0.4, 7.0}) {
    for (const std::uint32_t partitions : {1u, 4u}) {
      SCOPED_TRACE(goal);
      Watched world(
          rotor_world(settings_of(1),
                      joint_program("trajectory", 1, {{"speed", kSpeed}, {"acceleration", kAcceleration}})),
          partitions);
      world.run(0.5);
      world.tell("rotor", "goal", goal);
      double turned = 0;
      double before = 0;
      double rate = 0;
      int arrives = 0;
      for (int tick = 1; tick <= 600; ++tick) {
        world.step();
        const BodyRecord rotor = world.body("rotor");
        const double now = state_of_joint(world, "", "rotor").position[0];
        turned += std::remainder(now - before, 2 * kPi);
        before = now;
        const double next = rotor.state.angular_velocity[2];
        ASSERT_LE(std::abs(next), kSpeed * (1 + 1e-4));
        ASSERT_LE(std::abs(next - rate), kAcceleration * kDt * (1 + 1e-3)) << tick;
        rate = next;
        ASSERT_NEAR(value_of(rotor, "error"), 0, 2e-5);
        if (arrives == 0 && std::abs(turned - goal) < 1e-5) arrives = tick;
      }
      const double way = std::abs(goal);
      const double time = way > kSpeed * kSpeed / kAcceleration ? way / kSpeed + kSpeed / kAcceleration
                                                                : 2 * std::sqrt(way / kAcceleration);
      EXPECT_NEAR(arrives * kDt, time, 2 * kDt);
      EXPECT_NEAR(turned, goal, 1e-5);
      EXPECT_EQ(world.body("rotor").state.activity, Activity::kAsleep);
    }
  }
}

TEST(Trajectory, TurnsBackWhereItsGoalChanges) {
  Watched world(
      rotor_world(settings_of(1), joint_program("trajectory", 1, {{"speed", 2}, {"acceleration", 3}})));
  double rate = 0;
  double farthest = 0;
  for (int tick = 0; tick < 400; ++tick) {
    if (tick == 0) world.tell("rotor", "goal", 1.5);
    if (tick == 40) world.tell("rotor", "goal", 0.2);
    world.step();
    const double next = world.body("rotor").state.angular_velocity[2];
    ASSERT_LE(std::abs(next - rate), 2 * 3 * kDt * (1 + 1e-3)) << tick;  // of two ticks where it was told
    rate = next;
    farthest = std::max(farthest, state_of_joint(world, "", "rotor").position[0]);
  }
  EXPECT_GT(farthest, 0.5);
  EXPECT_LT(farthest, 1.5);
  EXPECT_NEAR(state_of_joint(world, "", "rotor").position[0], 0.2, 1e-5);
}

// On a body that stands, which drives a joint of others; its limits are kept.
TEST(Trajectory, DrivesASlideFromAStandingBodyToItsLimit) {
  WorldBuilder builder(settings_of(1));
  add_box(builder, "desk", {0.2, 0.2, 0.2}, {-4.1, 0.2, 0.2}, Motion::kKinematic).programs = {
      joint_program("trajectory", 1, {{"speed", 0.5}, {"acceleration", 1}})};
  add_box(builder, "carriage", {0.2, 0.2, 0.2}, {0.4, 0.2, 0.2}, Motion::kDynamic, 3);
  JointDescription& slide =
      builder.tie("slide", JointType::kPrismatic, "", "carriage", {0.4, 0.2, 0.2}, Eigen::Vector3d::UnitZ());
  slide.properties.axes[0].lower = -0.2;
  slide.properties.axes[0].upper = 0.9;
  Watched world(builder, 4);
  world.run(1);
  world.tell("desk", "goal", 5);
  world.run(5);
  EXPECT_NEAR(world.position("carriage").z(), 0.2 + 0.9, 1e-4);
  EXPECT_EQ(world.body("desk").programs[0].fault, "");
  world.tell("desk", "goal", 0);
  world.run(5);
  EXPECT_NEAR(world.position("carriage").z(), 0.2, 1e-4);
}

// Arms over borders of sectors, whose bases drive both of their joints.
TEST(DrivenJoints, MoveTheSameOnAnyNumberOfPartitionsAndThreads) {
  WorldBuilder builder(settings_of(1));
  builder.add_floor(20, 0);
  for (int n = 0; n < 4; ++n) {
    const std::string of = std::to_string(n);
    const double y = 0.7 * n - 1;
    add_box(builder, "base" + of, {0.3, 0.3, 0.3}, {0, y, 0.15}, Motion::kDynamic, 40).programs = {
        joint_program("trajectory", static_cast<std::uint64_t>(2 * n + 1), {{"goal", -1}, {"speed", 2}}),
        joint_program("pid", static_cast<std::uint64_t>(2 * n + 2),
                      {{"set_point", 1}, {"p", 30}, {"d", 3}, {"i", 5}})};
    add_box(builder, "upper" + of, {0.6, 0.08, 0.08}, {0.3, y, 0.4}, Motion::kDynamic);
    add_box(builder, "lower" + of, {0.5, 0.06, 0.06}, {0.85, y, 0.4}, Motion::kDynamic, 0.5);
    builder.tie("shoulder" + of, JointType::kRevolute, "base" + of, "upper" + of, {0, y, 0.4},
                Eigen::Vector3d::UnitY());
    builder.tie("elbow" + of, JointType::kRevolute, "upper" + of, "lower" + of, {0.6, y, 0.4},
                Eigen::Vector3d::UnitY());
  }
  const auto alone = hashes_of(*cluster_of(builder.world(), 1), 180);
  expect_the_same_on_any_partitions(builder.world(), alone);
}

}  // namespace
}  // namespace tessera
