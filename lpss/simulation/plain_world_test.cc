#include "lpss/simulation/plain_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "lpss/simulation/example_worlds.h"

namespace tessera {
namespace {

// A tower of five crates on a plane, `metres` along x from the anchor.
WorldDescription tower_at(double metres) {
  WorldDescription world;
  world.shapes = {Shape{{ShapePart{Plane{}, Pose{}}}}, Shape{{ShapePart{Box{}, Pose{}}}}};
  world.bodies.emplace_back();
  world.bodies.back().name = "ground";
  world.bodies.back().properties.motion = Motion::kStatic;
  for (int level = 0; level < 5; ++level) {
    world.bodies.emplace_back();
    BodyDescription& crate = world.bodies.back();
    crate.name = "crate_" + std::to_string(level);
    crate.properties.shape = 1;
    crate.properties.mass = 6;
    crate.pose.position = canonical({}, {metres, 0, 0.5 + level}, world.settings.sector_size).value();
  }
  return world;
}

// How far (m) a body of the tower ends from where the world puts it, at most; infinite for what is no number.
double displacement_of(const WorldDescription& world, int ticks) {
  const std::unique_ptr<PlainWorld> plain = PlainWorld::create(world, Precision::kFloat32).value();
  std::vector<Eigen::Vector3d> start;
  for (const BodyDescription& body : world.bodies) {
    if (body.properties.motion == Motion::kStatic) continue;
    const WorldPosition& place = body.pose.position;
    start.push_back(metres_between(world.anchor, place.sector, world.settings.sector_size) + place.local);
  }
  for (int tick = 0; tick < ticks; ++tick) plain->step();
  std::vector<Eigen::Vector3d> end;
  plain->for_each_body([&](const BodyRecord& record) { end.emplace_back(record.state.position.data()); });
  double largest = 0;
  for (std::size_t i = 0; i < start.size(); ++i) {
    const double moved = (end[i] - start[i]).norm();
    largest = std::isfinite(moved) ? std::max(largest, moved) : std::numeric_limits<double>::infinity();
  }
  return largest;
}

TEST(PlainWorldTest, TowerStandsNearTheOriginAndNotFarAway) {
  const double near = displacement_of(tower_at(0), 120);
  EXPECT_LT(near, 0.05);
  EXPECT_GT(displacement_of(tower_at(6.4e6 + 0.3), 120), 2 * near);
}

// A tower in the air, over a planet whose centre is 6.371e6 m below: 4.9 m in a second.
TEST(PlainWorldTest, BodiesFallToTheCentreOfAPlanet) {
  WorldDescription world = tower_at(0);
  world.bodies.erase(world.bodies.begin());
  CentralGravity planet;
  planet.centre = canonical({}, {0, 0, -planet.radius}, world.settings.sector_size).value();
  world.settings.gravity = planet;
  EXPECT_NEAR(displacement_of(world, 60), planet.surface / 2, 0.1);
}

TEST(PlainWorldTest, BodiesFallAsleepTogether) {
  const std::unique_ptr<PlainWorld> plain = PlainWorld::create(tower_at(0), Precision::kFloat32).value();
  for (int tick = 0; tick < 600; ++tick) plain->step();
  plain->for_each_body([](const BodyRecord& record) { EXPECT_EQ(record.state.activity, Activity::kAsleep); });
}

// An arm of 1 m and 1 kg that is held out from a wall by a joint along or about y: it weighs 9.81 N,
// and 4.905 N m about the joint.
WorldDescription arm_with(JointType type, const JointAxis& axis, const JointDrive& drive) {
  WorldSettings settings;
  settings.sleep_after = 0;
  WorldBuilder builder(settings);
  builder.add("arm", builder.shape(Box{{1, 0.1, 0.1}}), 1, {-0.5, 0, 0});
  const Eigen::Vector3d along =
      type == JointType::kPrismatic ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
  JointDescription& joint = builder.tie("joint", type, "", "arm", {0, 0, 0}, along);
  joint.properties.axes[0] = axis;
  joint.drives[0] = drive;
  return builder.world();
}

// The joint after `ticks`.
JointState joint_after(const WorldDescription& world, int ticks) {
  const std::unique_ptr<PlainWorld> plain = PlainWorld::create(world, Precision::kFloat32).value();
  for (int tick = 0; tick < ticks; ++tick) plain->step();
  JointState state;
  plain->for_each_body([&](const BodyRecord& record) {
    const JointSide arm{{Eigen::Vector3d(record.state.position.data()), quaternion_of(record.state)},
                        Eigen::Vector3d(record.state.linear_velocity.data()),
                        Eigen::Vector3d(record.state.angular_velocity.data())};
    state = joint_state(joint_records_of(world).value()[0].properties, {}, arm);
  });
  return state;
}

class PlainJointTest : public testing::TestWithParam<JointType> {};

TEST_P(PlainJointTest, MovesTheWayThatItsAxisSays) {
  EXPECT_LT(joint_after(arm_with(GetParam(), {}, {}), 20).position[0], -0.3);
  JointAxis narrow;
  narrow.lower = -0.2;
  narrow.upper = 0.1;
  EXPECT_NEAR(joint_after(arm_with(GetParam(), narrow, {}), 300).position[0], -0.2, 0.02);
  EXPECT_NEAR(joint_after(arm_with(GetParam(), {}, {DriveMode::kVelocity, 0.5}), 60).velocity[0], 0.5, 0.05);
  EXPECT_NEAR(joint_after(arm_with(GetParam(), {}, {DriveMode::kPosition, 0.3}), 300).position[0], 0.3, 0.02);
  EXPECT_GT(joint_after(arm_with(GetParam(), {}, {DriveMode::kEffort, 12}), 20).position[0], 0.1);
  JointAxis sprung;
  sprung.spring_stiffness = 40;
  sprung.spring_reference = -0.2;
  sprung.damping = 10;
  const double sag = (GetParam() == JointType::kPrismatic ? 9.81 : 4.905) / 40;
  EXPECT_NEAR(joint_after(arm_with(GetParam(), sprung, {}), 600).position[0], -0.2 - sag, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Axes, PlainJointTest, testing::Values(JointType::kRevolute, JointType::kPrismatic),
                         [](const testing::TestParamInfo<JointType>& type) {
                           return type.param == JointType::kRevolute ? "Revolute" : "Prismatic";
                         });

TEST(PlainWorldTest, JointsHoldTheirBodies) {
  for (const JointType type : {JointType::kFixed, JointType::kBall, JointType::kUniversal}) {
    const JointState state = joint_after(arm_with(type, {}, {}), 120);
    EXPECT_LT(state.gap, 0.05);
    EXPECT_LT(state.twist, 0.05);
  }
}

}  // namespace
}  // namespace tessera
