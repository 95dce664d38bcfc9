// Robots come to a pose, with given positions of their joints.
#include "coordinator/set_state.h"

#include <cmath>
#include <limits>
#include <map>

#include "coordinator/test_cluster.h"
#include "lpss/base/rotation.h"
#include "lpss/model/limits.h"

namespace tessera {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

Pose some_pose(double by) {
  return {Vector3d(0.3, -0.2, 0.5) * by, rotation_by(by * Vector3d(0.7, 0.4, -0.9))};
}

// A base, a limb on it by a joint of this type, and a hand on the limb by a hinge; a lamp on the ceiling of
// sector (0, 0, 1). Centres of mass lie off the bodies' origins.
WorldDescription robot(JointType type) {
  WorldDescription world;
  world.settings.sector_size = 100;
  world.shapes = {Shape{{{Box{{1, 0.5, 0.25}}, {}}}}};
  for (const char* name : {"base", "limb", "hand", "lamp"}) {
    BodyDescription& body = world.bodies.emplace_back();
    body.name = name;
    const auto n = static_cast<double>(world.bodies.size());
    body.properties.centre = {0.1 * n, -0.05 * n, 0.02};
    const Eigen::Quaterniond axes = rotation_by(n * Vector3d(0.2, 0.1, 0));
    body.properties.principal_axes = {axes.x(), axes.y(), axes.z(), axes.w()};
    body.pose.position.local = {3 * n, 0, 0};
  }
  world.bodies[3].pose.position.sector = {0, 0, 1};
  const auto add = [&](const char* name, JointType of, std::uint64_t parent,
                       std::uint64_t child) -> JointProperties& {
    JointDescription& joint = world.joints.emplace_back();
    joint.name = name;
    joint.properties.type = of;
    joint.properties.parent = BodyId{parent};
    joint.properties.child = BodyId{child};
    joint.properties.in_parent = some_pose(1.3);
    joint.properties.in_child = some_pose(-0.8);
    if (of == JointType::kScrew) joint.properties.pitch = 0.2;
    return joint.properties;
  };
  add("shoulder", type, 1, 2);
  add("wrist", JointType::kRevolute, 2, 3);
  add("cable", JointType::kUniversal, 0, 4).anchor = {0, 0, 1};
  return world;
}

v1::SetState::OfBody& add_body(v1::SetState& state, const std::string& name, const WorldPose& pose) {
  v1::SetState::OfBody& body = *state.add_bodies();
  body.mutable_body()->set_name(name);
  *body.mutable_pose() = to_proto(pose);
  return body;
}

v1::SetState::OfJoint& add_joint(v1::SetState& state, const std::string& name,
                                 const std::vector<double>& positions,
                                 const std::vector<double>& rates = {}) {
  v1::SetState::OfJoint& joint = *state.add_joints();
  joint.mutable_joint()->set_name(name);
  joint.mutable_positions()->Add(positions.begin(), positions.end());
  joint.mutable_rates()->Add(rates.begin(), rates.end());
  return joint;
}

// Where the commands put each body, relative to the centre of a sector.
std::map<std::uint64_t, JointSide> sides(const std::vector<Command>& commands, const SectorIndex& sector) {
  std::map<std::uint64_t, JointSide> sides;
  for (const Command& command : commands) {
    const Teleport& jump = std::get<Teleport>(command);
    EXPECT_FALSE(jump.keeps_rotation || jump.keeps_linear_velocity || jump.keeps_angular_velocity);
    JointSide side = side_of(jump.state);
    side.pose.position += metres_between(sector, jump.home, 100);
    EXPECT_TRUE(sides.emplace(jump.id.value, side).second) << "a body goes to one place";
  }
  return sides;
}

class SetStateOfEachType : public ::testing::TestWithParam<JointType> {};

TEST_P(SetStateOfEachType, PutsTheJointsWhereTheyAreToBe) {
  const WorldRegistry registry = registry_of(robot(GetParam()));
  const WorldPose pose{{{2, 0, 0}, {49.5, 20, -3}}, rotation_by(Vector3d(0.3, -1, 0.6))};
  const std::vector<double> positions = {0.4, -0.7};
  const std::vector<double> rates = {1.5, -2};
  const auto axes = static_cast<std::size_t>(axis_count(GetParam()));
  const auto of_axes = [&](const std::vector<double>& all) {
    return std::vector<double>(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(axes));
  };
  v1::SetState state;
  // Joints come in any order.
  add_joint(state, "wrist", {0.25}, {3});
  add_joint(state, "shoulder", of_axes(positions), of_axes(rates));
  v1::SetState::OfBody& base = add_body(state, "base", pose);
  *base.mutable_linear_velocity() = xyz(1, 2, 3);
  *base.mutable_angular_velocity() = xyz(0.5, 0, -0.5);
  const auto commands = checked(state, registry);
  ASSERT_TRUE(commands.ok()) << commands.status();
  ASSERT_EQ(commands->size(), 3u) << "only what is named moves";
  const auto placed = sides(*commands, pose.position.sector);

  // The base, as a teleport puts it.
  const Pose centre = centre_frame(registry.find(BodyId{1})->properties);
  const Pose body{pose.position.local, pose.orientation};
  EXPECT_NEAR((placed.at(1).pose.position - (body * centre).position).norm(), 0, 1e-9);
  EXPECT_EQ(placed.at(1).linear_velocity, Vector3d(1, 2, 3));
  EXPECT_EQ(placed.at(1).angular_velocity, Vector3d(0.5, 0, -0.5));

  const JointState shoulder =
      joint_state(registry.joints().find(JointId{1})->record.properties, placed.at(1), placed.at(2));
  for (std::size_t axis = 0; axis < axes; ++axis) {
    EXPECT_NEAR(shoulder.position[axis], positions[axis], 1e-9);
    EXPECT_NEAR(shoulder.velocity[axis], rates[axis], 1e-9);
  }
  EXPECT_NEAR(shoulder.gap, 0, 1e-9);
  EXPECT_NEAR(shoulder.twist, 0, 1e-6);
  const JointState wrist =
      joint_state(registry.joints().find(JointId{2})->record.properties, placed.at(2), placed.at(3));
  EXPECT_NEAR(wrist.position[0], 0.25, 1e-9);
  EXPECT_NEAR(wrist.velocity[0], 3, 1e-9);
  EXPECT_NEAR(wrist.gap, 0, 1e-9);
  EXPECT_NEAR(wrist.twist, 0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Types, SetStateOfEachType,
                         ::testing::Values(JointType::kFixed, JointType::kRevolute, JointType::kPrismatic,
                                           JointType::kBall, JointType::kUniversal, JointType::kScrew));

TEST(SetState, PlacesWhatHangsOnTheWorld) {
  const WorldRegistry registry = registry_of(robot(JointType::kRevolute));
  v1::SetState state;
  add_joint(state, "cable", {0.3, 0.6}, {0, 2});
  const auto commands = checked(state, registry);
  ASSERT_TRUE(commands.ok()) << commands.status();
  ASSERT_EQ(commands->size(), 1u);
  const Teleport& jump = std::get<Teleport>(commands->front());
  EXPECT_EQ(jump.id, BodyId{4});
  EXPECT_EQ(jump.home, (SectorIndex{0, 0, 1}));
  const JointState cable = joint_state(registry.joints().find(JointId{3})->record.properties, {},
                                       sides(*commands, {0, 0, 1}).at(4));
  EXPECT_NEAR(cable.position[0], 0.3, 1e-9);
  EXPECT_NEAR(cable.position[1], 0.6, 1e-9);
  EXPECT_NEAR(cable.velocity[0], 0, 1e-9);
  EXPECT_NEAR(cable.velocity[1], 2, 1e-9);
  EXPECT_NEAR(cable.gap, 0, 1e-9);
}

TEST(SetState, OfABallJointTakesAnOrientation) {
  const WorldRegistry registry = registry_of(robot(JointType::kBall));
  const Eigen::Quaterniond turn = rotation_by(Vector3d(0.5, 0.2, -0.3));
  v1::SetState state;
  add_body(state, "base", {});
  *add_joint(state, "shoulder", {}).mutable_orientation() = to_proto(WorldPose{{}, turn}).orientation();
  const auto commands = checked(state, registry);
  ASSERT_TRUE(commands.ok()) << commands.status();
  const auto placed = sides(*commands, {});
  const JointProperties& joint = registry.joints().find(JointId{1})->record.properties;
  const Eigen::Quaterniond a = (placed.at(1).pose * joint.in_parent).orientation;
  const Eigen::Quaterniond b = (placed.at(2).pose * joint.in_child).orientation;
  EXPECT_NEAR((a.conjugate() * b).angularDistance(turn), 0, 1e-6);
}

// Without positions, the joint is at its zero, and at rest.
TEST(SetState, WhatIsMissingIsZero) {
  const WorldRegistry registry = registry_of(robot(JointType::kUniversal));
  v1::SetState state;
  add_body(state, "base", {});
  add_joint(state, "shoulder", {0.5});
  const auto commands = checked(state, registry);
  ASSERT_TRUE(commands.ok()) << commands.status();
  const auto placed = sides(*commands, {});
  const JointState shoulder =
      joint_state(registry.joints().find(JointId{1})->record.properties, placed.at(1), placed.at(2));
  EXPECT_NEAR(shoulder.position[0], 0.5, 1e-9);
  EXPECT_NEAR(shoulder.position[1], 0, 1e-9);
  EXPECT_NEAR(placed.at(2).linear_velocity.norm(), 0, 1e-12);
}

// A long chain with its joints from the tip to the base.
TEST(SetState, PlacesALongChain) {
  WorldDescription world = robot(JointType::kRevolute);
  world.joints.resize(1);
  world.bodies.resize(2);
  constexpr std::uint64_t kLinks = 60;
  for (std::uint64_t n = 2; n < kLinks; ++n) {
    BodyDescription& body = world.bodies.emplace_back(world.bodies[1]);
    body.name = "link" + std::to_string(n);
    JointDescription& joint = world.joints.emplace_back(world.joints[0]);
    joint.name = "joint" + std::to_string(n);
    joint.properties.parent = BodyId{n};
    joint.properties.child = BodyId{n + 1};
  }
  const WorldRegistry registry = registry_of(world);
  v1::SetState state;
  add_body(state, "base", {});
  for (std::uint64_t n = kLinks - 1; n > 1; --n) add_joint(state, "joint" + std::to_string(n), {0.1});
  add_joint(state, "shoulder", {0.1});
  const auto commands = checked(state, registry);
  ASSERT_TRUE(commands.ok()) << commands.status();
  const auto placed = sides(*commands, {});
  ASSERT_EQ(placed.size(), kLinks);
  for (std::uint64_t n = 1; n < kLinks; ++n) {
    const JointState joint =
        joint_state(registry.joints().find(JointId{n})->record.properties, placed.at(n), placed.at(n + 1));
    EXPECT_NEAR(joint.position[0], 0.1, 1e-6);
    EXPECT_NEAR(joint.gap, 0, 1e-6);
  }
}

TEST(SetState, IsRefusedWithTheElementAndTheBound) {
  WorldDescription world = robot(JointType::kRevolute);
  world.joints[0].properties.axes[0].lower = -1;
  world.joints[0].properties.axes[0].upper = 0.5;
  const WorldRegistry registry = registry_of(world);
  const auto expect = [&](const v1::SetState& state, absl::StatusCode code, const std::string& words) {
    const auto refused = checked(state, registry);
    EXPECT_EQ(refused.status().code(), code) << refused.status();
    EXPECT_THAT(std::string(refused.status().message()), HasSubstr(words));
  };
  const auto with_base = [](const std::vector<double>& positions, const std::vector<double>& rates = {}) {
    v1::SetState state;
    add_body(state, "base", {});
    add_joint(state, "shoulder", positions, rates);
    return state;
  };
  constexpr auto kNotFound = absl::StatusCode::kNotFound;
  expect({}, kInvalid, "it must name a body or a joint");
  v1::SetState state;
  add_body(state, "nobody", {});
  expect(state, kNotFound, "'nobody'");
  state.Clear();
  add_joint(state, "no joint", {});
  expect(state, kNotFound, "'no joint'");
  state.Clear();
  add_body(state, "base", {}).clear_pose();
  expect(state, kInvalid, "body 'base': pose must be set");
  state.Clear();
  add_body(state, "base", {{}, Eigen::Quaterniond(2, 0, 0, 0)});
  expect(state, kInvalid, "body 'base'");
  state.Clear();
  add_body(state, "base", {{{std::numeric_limits<std::int64_t>::max(), 0, 0}, {1000, 0, 0}}});
  expect(state, absl::StatusCode::kOutOfRange, "");
  state.Clear();
  *add_body(state, "base", {}).mutable_linear_velocity() = xyz(2 * kSpeedMax, 0, 0);
  expect(state, kInvalid, "linear velocity");

  state.Clear();
  add_body(state, "base", {});
  add_body(state, "base", {});
  expect(state, kInvalid, "'base' is placed twice");
  state = with_base({});
  add_body(state, "limb", {});
  expect(state, kInvalid, "joint 'shoulder': 'limb' is placed twice");
  state = with_base({});
  add_joint(state, "shoulder", {});
  expect(state, kInvalid, "'limb' is placed twice");

  state.Clear();
  add_joint(state, "wrist", {});
  add_joint(state, "shoulder", {});
  expect(state, kInvalid, "its parent 'limb' must be placed, too");
  state.Clear();
  add_joint(state, "shoulder", {});
  add_body(state, "hand", {});
  expect(state, kInvalid, "joint 'shoulder': its parent 'base' must be placed, too");

  expect(with_base({0, 0}), kInvalid, "joint 'shoulder': 2 positions must be at most 1");
  expect(with_base({}, {0, 0}), kInvalid, "2 rates must be at most 1");
  expect(with_base({0.6}), kInvalid, "joint 'shoulder': position 0 = 0.6");
  expect(with_base({-1.1}), kInvalid, "position 0 = -1.1");
  expect(with_base({std::nan("")}), kInvalid, "position 0 = nan must be finite");
  expect(with_base({}, {2 * kAngularSpeedMax}), kInvalid, "rate 0");
  expect(with_base({}, {std::nan("")}), kInvalid, "rate 0 = nan must be finite");
  state = with_base({});
  state.mutable_joints(0)->mutable_orientation()->set_w(1);
  expect(state, kInvalid, "joint 'shoulder': only a ball joint takes an orientation");
  EXPECT_TRUE(checked(with_base({0.5}, {1}), registry).ok());

  const WorldRegistry balls = registry_of(robot(JointType::kBall));
  state = with_base({});
  state.mutable_joints(0)->mutable_orientation()->set_w(3);
  EXPECT_THAT(std::string(checked(state, balls).status().message()),
              HasSubstr("joint 'shoulder': orientation"));
}

// A body that follows may be too fast where the joint and its parent are not.
TEST(SetState, SpeedsOfWhatFollowsAreBounded) {
  const WorldRegistry registry = registry_of(robot(JointType::kRevolute));
  int refused = 0;
  for (const double rate : {-0.9, 0.9}) {
    v1::SetState state;
    *add_body(state, "base", {}).mutable_angular_velocity() = xyz(0, 0, 0.9 * kAngularSpeedMax);
    add_joint(state, "shoulder", {0}, {rate * kAngularSpeedMax});
    const absl::Status status = checked(state, registry).status();
    if (status.ok()) continue;
    ++refused;
    EXPECT_EQ(status.code(), kInvalid);
    EXPECT_THAT(std::string(status.message()), HasSubstr("joint 'shoulder': "));
  }
  EXPECT_GE(refused, 1) << "in one direction the speeds add up";
}

// A teleport would refuse it: joints hold the bodies.
TEST(SetState, GoesToTheServersInAListOfItsOwn) {
  const auto cluster = loaded_cluster({}, robot(JointType::kRevolute));
  v1::Command command;
  add_body(*command.mutable_set_state(), "base", {{{4, 0, 0}}});
  add_joint(*command.mutable_set_state(), "shoulder", {0.4});
  ASSERT_TRUE(cluster->apply({push("base"), command})->ok());
  cluster->step(1);
  const std::vector<Command> commands = unpack_commands(cluster->work(kFirst).at(0).commands()).value();
  ASSERT_EQ(commands.size(), 3u);
  EXPECT_EQ(std::get<Teleport>(commands[1]).id, BodyId{1});
  EXPECT_EQ(std::get<Teleport>(commands[2]).id, BodyId{2});
}

}  // namespace
}  // namespace tessera
