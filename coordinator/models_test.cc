// Models that are spawned: whole, with names of their own, where they are told to be.
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "coordinator/command_list.h"
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "lpss/base/rotation.h"
#include "lpss/model/limits.h"
#include "lpss/programs/module.h"
#include "lpss/wasm/test_modules.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A base with an arm, which a joint to the world holds, and a gripper, whose joint follows that of the arm: a
// leader that comes later in the list.
WorldDescription robot() {
  WorldDescription robot;
  robot.shapes = {Shape{{{Box{{1, 1, 1}}, {}}}}, Shape{{{Sphere{0.5}, {}}}}};
  for (const char* name : {"base", "arm", "gripper"}) {
    BodyDescription& body = robot.bodies.emplace_back();
    body.name = name;
    body.properties.assembly = 3;
    body.pose.position.local = {static_cast<double>(robot.bodies.size()), 0, 1};
  }
  robot.bodies[2].properties.shape = 1;
  robot.bodies[1].linear_velocity = {2, 0, 0};
  robot.bodies[1].angular_velocity = {0, 3, 0};
  const auto add = [&](const char* name, JointType type, std::uint64_t parent,
                       std::uint64_t child) -> JointProperties& {
    JointDescription& joint = robot.joints.emplace_back();
    joint.name = name;
    joint.properties.type = type;
    joint.properties.parent = BodyId{parent};
    joint.properties.child = BodyId{child};
    return joint.properties;
  };
  add("grip", JointType::kRevolute, 2, 3).axes[0].mimic = {.leader = JointId{3}, .axis = 0, .multiplier = -1};
  add("stand", JointType::kFixed, 0, 1).in_parent.position = {1, 0, 1};
  add("shoulder", JointType::kRevolute, 1, 2);
  robot.frames.push_back({"camera", 1, {{0, 0, 0.5}, Eigen::Quaterniond::Identity()}});
  return robot;
}

v1::Command robot_at(const std::string& prefix, const WorldPose& pose) {
  v1::Command command = spawn_of(model_of(robot()), prefix);
  *command.mutable_spawn()->mutable_pose() = to_proto(pose);
  return command;
}

class Models : public ::testing::Test {
 protected:
  // The list is given, and stays.
  absl::StatusOr<GivenCommands> give(const std::vector<v1::Command>& list) {
    auto given = tessera::give(request_of(list).commands(), registry_, 1);
    if (given.ok()) {
      registry_.keep();
    } else {
      registry_.roll_back();
    }
    return given;
  }
  void expect_refusal(const v1::Command& command, absl::StatusCode code, const std::string& words) {
    const absl::Status status = give({command}).status();
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(words));
  }
  std::vector<std::string> names(const std::string& prefix) {
    v1::FindBodies query;
    query.set_name_prefix(prefix);
    std::vector<std::string> names;
    const v1::FoundBodies all = registry_.find(query);
    for (const auto& found : all.bodies()) names.push_back(found.name());
    return names;
  }

  WorldRegistry registry_ = registry_of(small_world());
};

// Those of one kind, in their order.
template <typename Kind>
std::vector<Kind> all_of_kind(const PackedCommands& commands) {
  std::vector<Kind> result;
  for (const Command& command : commands.unpacked()) {
    if (const auto* one = std::get_if<Kind>(&command)) result.push_back(*one);
  }
  return result;
}

TEST_F(Models, AreSpawnedWhereTheySay) {
  const auto given = give({spawn_of(model_of(robot()))});
  ASSERT_TRUE(given.ok()) << given.status();
  const v1::Created& created = given->applied.created(0);
  EXPECT_EQ(created.first_body(), 5u);
  EXPECT_EQ(created.bodies(), 3u);
  EXPECT_EQ(created.first_joint(), 1u);
  EXPECT_EQ(created.joints(), 3u);
  const auto bodies = all_of_kind<SpawnBody>(given->commands);
  ASSERT_EQ(bodies.size(), 3u);
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_EQ(bodies[n].record.id.value, 5 + n);
    EXPECT_EQ(bodies[n].record.state.position, (std::array<double, 3>{1.0 + static_cast<double>(n), 0, 1}));
  }
  EXPECT_EQ(bodies[2].record.properties.shape, 1u) << "the world's ball";
  EXPECT_EQ(bodies[0].record.properties.shape, 2u);
  ASSERT_EQ(given->new_shapes.size(), 1u) << "and only what it does not have is new";
  EXPECT_EQ(given->new_shapes[0].id(), 2u);
  EXPECT_THAT(names(""), ElementsAre("floor", "ball", "lift", "egg", "base", "arm", "gripper"));
}

std::string module_named(const std::string& name) {
  return wasm::test_module(R"((module (memory 1) (func (export "run"))))",
                           "program | " + name + " | Tests.\n");
}

// A ball with a program, and the module of that.
v1::Command ball_with(const std::string& program, const std::string& module, const std::string& name = "") {
  v1::Command command = spawn(name);
  v1::Model& model = *command.mutable_spawn()->mutable_model();
  model.mutable_bodies(0)->add_programs()->set_kind(program);
  model.add_modules(module);
  return command;
}

TEST_F(Models, BringTheModulesOfTheirPrograms) {
  const auto module = load_module(module_named("one"));
  ASSERT_TRUE(module.ok()) << module.status();
  const std::string kind = (*module)->kind;
  v1::Command without = ball_with(kind, "");
  without.mutable_spawn()->mutable_model()->clear_modules();
  expect_refusal(without, absl::StatusCode::kInvalidArgument, "the world does not have its module");
  const auto given = give({ball_with(kind, module_named("one"))});
  ASSERT_TRUE(given.ok()) << given.status();
  ASSERT_EQ(given->new_modules.size(), 1u);
  EXPECT_EQ(given->new_modules[0], *module);
  EXPECT_EQ(registry_.settings().modules, given->new_modules);
  const auto again = give({ball_with(kind, module_named("one")), without});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->new_modules.empty()) << "it is shared";
  EXPECT_EQ(registry_.settings().modules.size(), 1u);
}

TEST_F(Models, WhoseModulesAreRefusedLeaveNone) {
  expect_refusal(ball_with("character", "no module"), absl::StatusCode::kInvalidArgument,
                 "model: module 0: byte");
  EXPECT_FALSE(give({ball_with("character", module_named("one")), spawn_of(v1::Model())}).ok());
  EXPECT_TRUE(registry_.settings().modules.empty()) << "the list was refused";
  for (std::size_t n = 0; n < kModulesMax; ++n)
    ASSERT_TRUE(give({ball_with("character", module_named("m" + std::to_string(n)))}).ok());
  expect_refusal(ball_with("character", module_named("one")), absl::StatusCode::kResourceExhausted,
                 "with its modules, the world would have more than 16");
  EXPECT_EQ(registry_.settings().modules.size(), kModulesMax);
}

// In the order of the list they would follow what is not there yet.
TEST_F(Models, JointsComeAfterThoseThatTheyFollow) {
  const auto given = give({spawn_of(model_of(robot()))});
  ASSERT_TRUE(given.ok()) << given.status();
  const auto joints = all_of_kind<AddJoint>(given->commands);
  ASSERT_EQ(joints.size(), 3u);
  EXPECT_EQ(joints[0].record.id, JointId{3});
  EXPECT_EQ(joints[1].record.id, JointId{1});
  EXPECT_EQ(joints[2].record.id, JointId{2});
  EXPECT_EQ(joints[1].record.properties.axes[0].mimic.leader, JointId{3});
  ASSERT_EQ(joints[1].leaders.size(), 1u);
  EXPECT_EQ(joints[1].leaders[0].id, JointId{3});
  EXPECT_EQ(joints[1].leaders[0].child, BodyId{6});
  EXPECT_EQ(joints[0].record.properties.parent, BodyId{5});
  EXPECT_EQ(joints[0].record.properties.child, BodyId{6});
  EXPECT_EQ(joints[0].record.parent_motion, Motion::kDynamic);
  EXPECT_EQ(joints[2].record.properties.parent, BodyId{});
  EXPECT_EQ(joints[2].record.properties.child, BodyId{5});
}

// References are places in the list, which are other ids in a world that has bodies and joints.
TEST_F(Models, AreManyTimesTheSame) {
  ASSERT_TRUE(give({robot_at("a/", {}), robot_at("b/", {})}).ok());
  const auto given = give({robot_at("c/", {})});
  ASSERT_TRUE(given.ok()) << given.status();
  EXPECT_EQ(given->applied.created(0).first_body(), 11u);
  EXPECT_EQ(given->applied.created(0).first_joint(), 7u);
  EXPECT_TRUE(given->new_shapes.empty());
  const auto joints = all_of_kind<AddJoint>(given->commands);
  EXPECT_EQ(joints[1].record.id, JointId{7});
  EXPECT_EQ(joints[1].record.properties.axes[0].mimic.leader, JointId{9});
  EXPECT_EQ(joints[1].record.properties.parent, BodyId{12});
  EXPECT_EQ(joints[1].record.properties.child, BodyId{13});
  EXPECT_THAT(names("b/"), ElementsAre("b/base", "b/arm", "b/gripper"));
  EXPECT_TRUE(registry_.joints().has_name("c/shoulder"));
  v1::FindFrames frames;
  ASSERT_EQ(registry_.find(frames).frames_size(), 3);
  EXPECT_EQ(registry_.find(frames).frames(1).frame().name(), "b/camera");
  EXPECT_EQ(registry_.find(frames).frames(1).body(), "b/arm");
  EXPECT_EQ(registry_.find(frames).frames(1).frame().pose().position().z(), 0.5);
}

// Bodies of one do not collide with each other; with those of another they do.
TEST_F(Models, AreAssembliesOfTheirOwn) {
  WorldDescription pair = robot();
  pair.joints.clear();
  pair.bodies[1].properties.assembly = 0;
  pair.bodies[2].properties.assembly = 8;
  const auto given = give({spawn_of(model_of(robot()), "a/"), spawn_of(model_of(pair), "b/")});
  ASSERT_TRUE(given.ok()) << given.status();
  std::vector<std::uint64_t> assemblies;
  for (const SpawnBody& body : all_of_kind<SpawnBody>(given->commands))
    assemblies.push_back(body.record.properties.assembly);
  ASSERT_EQ(assemblies.size(), 6u);
  EXPECT_EQ(assemblies[0], assemblies[1]);
  EXPECT_EQ(assemblies[0], assemblies[2]);
  EXPECT_EQ(assemblies[4], 0u) << "of none";
  const std::set<std::uint64_t> apart = {assemblies[0], assemblies[3], assemblies[5]};
  EXPECT_EQ(apart.size(), 3u);
  EXPECT_GE(*apart.begin(), kSpawnedAssemblies) << "files have smaller ones";
}

// All turn and move with the pose: also velocities, and what the world holds.
TEST_F(Models, ComeToAPose) {
  const WorldPose pose{{{3, 0, -2}, {10, 0, 0}},
                       rotation_by(std::numbers::pi / 2 * Eigen::Vector3d::UnitZ())};
  const auto given = give({robot_at("r/", pose)});
  ASSERT_TRUE(given.ok()) << given.status();
  const auto bodies = all_of_kind<SpawnBody>(given->commands);
  for (std::size_t n = 0; n < 3; ++n) {
    const BodyRecord& body = bodies[n].record;
    EXPECT_EQ(body.home, (SectorIndex{3, 0, -2}));
    const JointSide side = side_of(body.state);
    EXPECT_NEAR((side.pose.position - Eigen::Vector3d(10, 1.0 + static_cast<double>(n), 1)).norm(), 0, 1e-12);
    EXPECT_NEAR(side.pose.orientation.angularDistance(pose.orientation), 0, 1e-7);
  }
  const JointSide arm = side_of(bodies[1].record.state);
  EXPECT_NEAR((arm.linear_velocity - Eigen::Vector3d(0, 2, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((arm.angular_velocity - Eigen::Vector3d(-3, 0, 0)).norm(), 0, 1e-12);
  const JointProperties stand = all_of_kind<AddJoint>(given->commands)[2].record.properties;
  EXPECT_EQ(stand.anchor, (SectorIndex{3, 0, -2}));
  EXPECT_NEAR((stand.in_parent.position - Eigen::Vector3d(10, 1, 1)).norm(), 0, 1e-12);
  EXPECT_NEAR(stand.in_parent.orientation.angularDistance(pose.orientation), 0, 1e-7);
}

// A body far from the model's origin goes to the sector where it comes to.
TEST_F(Models, ReachIntoOtherSectors) {
  WorldDescription two = robot();
  two.joints.clear();
  two.bodies[1].pose.position = {{1, 0, 0}, {-30, 0, 0}};  // at x = 70
  v1::Command command = spawn_of(model_of(two));
  const WorldPose pose{{{5, 0, 0}, {0, 0, 0}}, rotation_by(std::numbers::pi * Eigen::Vector3d::UnitZ())};
  *command.mutable_spawn()->mutable_pose() = to_proto(pose);
  const auto given = give({command});
  ASSERT_TRUE(given.ok()) << given.status();
  const BodyRecord far = all_of_kind<SpawnBody>(given->commands)[1].record;
  EXPECT_EQ(far.home, (SectorIndex{4, 0, 0}));
  EXPECT_NEAR(far.state.position[0], 30, 1e-9);
}

// None of their own bodies carries it.
TEST(ModelsOfAWorld, WhoseBodyCarriesAFrame) {
  WorldDescription ferry = small_world();
  MovingFrame& deck = ferry.settings.frames.emplace_back();
  deck.name = "deck";
  deck.region = FrameRegion{.size = {20, 20, 20}};
  deck.carrier = FrameCarrier{BodyId{3}, {}};
  WorldRegistry registry = registry_of(ferry);

  WorldDescription ball;
  ball.shapes = {Shape{{{Sphere{0.5}, {}}}}};
  ball.bodies.emplace_back().name = "ball";
  const v1::Command as_it_is = spawn_of(model_of(ball), "a/");
  v1::Command aboard = spawn_of(model_of(ball), "b/");
  const WorldPose place{{SectorIndex{1, 0, 0, FrameNumber{1}}, {2, 0, 0}}, Eigen::Quaterniond::Identity()};
  *aboard.mutable_spawn()->mutable_pose() = to_proto(place);
  const auto given = tessera::give(request_of({as_it_is, aboard}).commands(), registry, 1);
  ASSERT_TRUE(given.ok()) << given.status();
  const auto bodies = all_of_kind<SpawnBody>(given->commands);
  ASSERT_EQ(bodies.size(), 2u);
  EXPECT_EQ(bodies[0].record.home, SectorIndex{});
  EXPECT_EQ(bodies[1].record.home, place.position.sector);
  EXPECT_TRUE(registry.settings().frames[0].carrier.has_value()) << "the world's own";
}

TEST_F(Models, MissingNamesAreGenerated) {
  WorldDescription nameless = robot();
  nameless.frames.clear();
  for (BodyDescription& body : nameless.bodies) body.name.clear();
  for (JointDescription& joint : nameless.joints) joint.name.clear();
  ASSERT_TRUE(give({spawn_of(model_of(nameless))}).ok());
  EXPECT_THAT(names("body_"), ElementsAre("body_5", "body_6", "body_7"));
  for (const char* name : {"joint_1", "joint_2", "joint_3"})
    EXPECT_TRUE(registry_.joints().has_name(name)) << name;
}

TEST_F(Models, GoByTheirPrefix) {
  ASSERT_TRUE(give({robot_at("a/", {}), robot_at("b/", {})}).ok());
  const auto given = give({removal_of_all("a/")});
  ASSERT_TRUE(given.ok()) << given.status();
  const auto removed = all_of_kind<RemoveBody>(given->commands);
  ASSERT_EQ(removed.size(), 3u);
  for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(removed[n].id.value, 5 + n);
  EXPECT_THAT(names("a/"), ElementsAre());
  EXPECT_THAT(names("b/"), ElementsAre("b/base", "b/arm", "b/gripper"));
  EXPECT_FALSE(registry_.joints().has_name("a/shoulder"));
  EXPECT_TRUE(registry_.joints().has_name("b/shoulder"));
  EXPECT_EQ(registry_.find(v1::FindFrames()).frames_size(), 1);
  ASSERT_TRUE(give({robot_at("a/", {})}).ok()) << "the names are free again";
}

// Of bodies that share a shape, the last one takes it away.
TEST_F(Models, TheLastBodyOfAPrefixTakesItsShape) {
  ASSERT_TRUE(give({robot_at("a/", {})}).ok());
  const auto removed = all_of_kind<RemoveBody>(give({removal_of_all("a/")})->commands);
  EXPECT_EQ(removed[0].last_of, std::nullopt);
  EXPECT_EQ(removed[1].last_of, ShapeId{2});
  EXPECT_EQ(removed[2].last_of, std::nullopt) << "the ball has it";
}

TEST_F(Models, AreRefusedWithTheElementAndTheBound) {
  expect_refusal(spawn_of({}), kInvalid, "model: it must have a body");
  ASSERT_TRUE(give({robot_at("a/", {})}).ok());
  expect_refusal(robot_at("a/", {}), absl::StatusCode::kAlreadyExists, "body 'a/base': the name is in use");

  // Names of frames, and of joints, that others have.
  WorldDescription other = robot();
  other.joints.clear();
  for (BodyDescription& body : other.bodies) body.name += "2";
  expect_refusal(spawn_of(model_of(other), "a/"), absl::StatusCode::kAlreadyExists, "frame 'a/camera'");
  other = robot();
  other.frames.clear();
  for (BodyDescription& body : other.bodies) body.name += "2";
  expect_refusal(spawn_of(model_of(other), "a/"), absl::StatusCode::kAlreadyExists, "joint 'a/grip'");
  other.bodies[0].name = "camera";
  expect_refusal(spawn_of(model_of(other), "a/"), absl::StatusCode::kAlreadyExists, "body 'a/camera'");

  other = robot();
  other.bodies[1].name = "base";
  expect_refusal(spawn_of(model_of(other)), kInvalid, "'base'");
  other = robot();
  other.joints[2].properties.child = BodyId{9};
  expect_refusal(spawn_of(model_of(other)), kInvalid, "joint 'shoulder': child = 9");
  other = robot();
  other.joints[0].properties.axes[0].mimic.leader = JointId{9};
  expect_refusal(spawn_of(model_of(other)), kInvalid, "joint 'grip'");
  other = robot();
  other.bodies[2].properties.shape = 7;
  expect_refusal(spawn_of(model_of(other)), kInvalid, "shape");
  other = robot();
  other.bodies[2].properties.mass = -1;
  expect_refusal(spawn_of(model_of(other)), kInvalid, "body 'gripper': mass = -1");

  const std::int64_t end = std::numeric_limits<std::int64_t>::max();
  expect_refusal(robot_at("b/", {{{end, 0, 0}, {1000, 0, 0}}}), absl::StatusCode::kOutOfRange, "pose");
  expect_refusal(robot_at("b/", {{{end, 0, 0}, {49, 0, 0}}}), absl::StatusCode::kOutOfRange, "body 'b/base'");
  expect_refusal(robot_at("b/", {{}, Eigen::Quaterniond(2, 0, 0, 0)}), kInvalid, "pose");
  expect_refusal(robot_at("b/", {{{}, {std::nan(""), 0, 0}}}), kInvalid, "pose");
  EXPECT_EQ(registry_.body_count(), 7u);
  EXPECT_EQ(registry_.next_ids().next_body, BodyId{8});
}

// The whole of the coordinator, to the servers of all.
TEST(ModelsOfAWorld, GoToAllServersAtOneTick) {
  const auto cluster = loaded_cluster();
  const auto heard = cluster->send(request_of({robot_at("r/", {{{5, 0, 0}}})}, 1));
  cluster->collect();
  for (const NodeId node : {kFirst, kSecond}) {
    const std::vector<v1::Grant> grants = cluster->work(node);
    ASSERT_FALSE(grants.empty());
    EXPECT_EQ(unpack_commands(grants[0].commands()).value().size(), 6u);
    EXPECT_EQ(grants[0].new_shapes_size(), 1);
  }
  ASSERT_TRUE(heard->ok()) << heard->message();
  EXPECT_EQ(heard->answer.tick(), 1u);
  EXPECT_EQ(cluster->find_joints("r/").joints_size(), 3);
  EXPECT_EQ(cluster->find_frames("r/").frames_size(), 1);
}

}  // namespace
}  // namespace tessera
