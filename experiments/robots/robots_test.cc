// Robots stand, are the same beside each other and in MuJoCo's words, and the rows tell how they fare.
#include "experiments/robots/robots.h"

#include <absl/strings/match.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>
#include <vector>

#include "experiments/lowest_point.h"
#include "experiments/mujoco/mujoco.h"
#include "experiments/robots/robot.h"
#include "lpss/observe/mechanics.h"
#include "lpss/simulation/simulation.h"

namespace tessera::robots {
namespace {

using testing::HasSubstr;

double mass_of(const Robot& robot) {
  double sum = 0;
  for (const Link& link : robot.links) sum += link.mass;
  return sum;
}

TEST(Robots, AreMadeAsTheyAreDescribed) {
  EXPECT_EQ(ant().links.size(), 9u);
  EXPECT_EQ(hinges_of(ant()), 8u);
  EXPECT_DOUBLE_EQ(mass_of(ant()), 20);
  EXPECT_EQ(humanoid().links.size(), 15u);
  EXPECT_EQ(hinges_of(humanoid()), 21u);
  EXPECT_NEAR(mass_of(humanoid()), 43.8, 1e-9);
}

TEST(Robots, TouchThePlaneAtTheStartAndAreWhole) {
  for (const Robot& robot : {ant(), humanoid()}) {
    double lowest = 1;
    for (const Link& link : robot.links)
      lowest = std::min(lowest, lowest_point(Shape{link.parts}, link.pose));
    EXPECT_NEAR(lowest + robot.height, 0.01, 0.015) << robot.name;
    const WorldDescription world = robots_on_plane({}, robot, 3);
    const auto simulation = Simulation::create(world).value();
    std::vector<BodyRecord> bodies;
    simulation->for_each_body([&](const BodyRecord& body) { bodies.push_back(body); });
    const Mechanics start = MechanicsOfWorld::create(world)->at(bodies);
    EXPECT_LT(start.gap, 1e-6) << robot.name;
    EXPECT_LT(start.twist, 1e-6) << robot.name;
    for (const JointState& joint : start.joints) EXPECT_NEAR(joint.position[0], 0, 1e-6) << robot.name;
  }
}

// Where joints turn as links move, no velocity is left across them.
TEST(Robots, AreThrownWithoutTearing) {
  for (const Robot& robot : {ant(), humanoid()}) {
    const WorldDescription world = robot_in_space({}, robot, 1);
    const auto simulation = Simulation::create(world).value();
    MechanicsOfWorld mechanics = MechanicsOfWorld::create(world).value();
    const auto seen = [&] {
      std::vector<BodyRecord> bodies;
      simulation->for_each_body([&](const BodyRecord& body) { bodies.push_back(body); });
      return mechanics.at(bodies);
    };
    const Mechanics start = seen();
    simulation->step();
    const Mechanics next = seen();
    EXPECT_GT(start.kinetic, 1) << robot.name;
    EXPECT_NEAR(next.kinetic / start.kinetic, 1, 1e-3) << robot.name;
  }
}

TEST(Robots, HaveTargetsThatSwingInPhasesOfTheirOwn) {
  const std::vector<Command> first = servo_targets(ant(), 0, 2, 0.25);
  const std::vector<Command> second = servo_targets(ant(), 1, 1, 0.25);
  ASSERT_EQ(first.size(), 16u);
  ASSERT_EQ(second.size(), 8u);
  for (std::size_t n = 0; n < second.size(); ++n) {
    const auto& one = std::get<SetDrives>(first[n + 8]);
    const auto& same = std::get<SetDrives>(second[n]);
    EXPECT_EQ(one.id.value, n + 9);
    EXPECT_EQ(same.id.value, n + 1);
    EXPECT_EQ(one.drives, same.drives);
    EXPECT_NE(one.drives, std::get<SetDrives>(first[n]).drives);
    EXPECT_LT(std::abs(one.drives[0].target), 0.4);
  }
}

TEST(Robots, AreTheSameInMujocosWords) {
  const std::string text = mjcf_of(robots_on_plane({}, ant(), 1), {1, false}).value();
  EXPECT_THAT(text, HasSubstr("<option cone='pyramidal' integrator='Euler' timestep='0.01666"));
  EXPECT_THAT(text, HasSubstr("mass='10' "));
  EXPECT_THAT(text, HasSubstr("limited='true' range='-0.5 0.5'"));
  EXPECT_THAT(text, HasSubstr("<position name='s2_0' joint='j2_0' kp='200'/>"));
  EXPECT_THAT(text, HasSubstr("damping='10'"));
  EXPECT_THAT(text, HasSubstr("contype='2' conaffinity='1'"));
  const std::string person = mjcf_of(robots_on_plane({}, humanoid(), 1), {4, true}).value();
  EXPECT_THAT(person, HasSubstr("name='j2_0'"));
  EXPECT_THAT(person, HasSubstr("name='j2_1'"));
}

TEST(RobotsExperiment, TellsTimeAndErrorsBesideMujoco) {
  absl::StatusOr<Report> report =
      measure_robots({.quick = true}, [](std::uint64_t, std::uint64_t, const Report&) { return true; });
  ASSERT_TRUE(report.ok()) << report.status();
  const std::vector<Row>& rows = report->table("rows");
  EXPECT_EQ(rows.size(), has_mujoco() ? 14u : 8u);
  EXPECT_EQ(report->misses.size(), has_mujoco() ? 0u : 1u);
  for (const Row& row : rows) {
    const bool is_ours = row["hash"].is_string();
    const bool is_ant = row["robot"] == "ant";
    EXPECT_EQ(row["hinges"], is_ant ? 8 : 21) << row;
    EXPECT_GT(row["steps_per_s"], 0) << row;
    EXPECT_EQ(row["ratio"].is_number(), has_mujoco()) << row;
    EXPECT_NEAR(row["height_m"], is_ant ? 0.51 : 1.19, 0.05) << row;
    if (!is_ours) continue;
    const bool is_coarse = absl::StrContains(row["world"].get<std::string>(), "1 substep");
    EXPECT_LT(row["gap_mm_max"], is_coarse ? 1 : 0.1) << row;
    EXPECT_LE(row["gap_mm_mean"], row["gap_mm_max"]) << row;
    EXPECT_LT(row["below_mm_max"], is_coarse ? 40 : 2) << row;
    EXPECT_EQ(row["thrown"], 4) << row;
    EXPECT_EQ(row["thrown_lost"], 0) << row;
    EXPECT_LT(row["energy_error_max"], 0.002) << row;
    EXPECT_LT(row["spin_error_max"], 0.002) << row;
  }
}

TEST(RobotsExperiment, SaysWhereNoRobotHasTheName) {
  EXPECT_FALSE(measure_robots({.only = "centipede"}, {}).ok());
}

}  // namespace
}  // namespace tessera::robots
