// Joints: what servers are told of them, what is refused, and how long they last.
#include <limits>

#include "coordinator/test_cluster.h"
#include "lpss/model/limits.h"
#include "lpss/programs/registry.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> joints(TestCluster& cluster, const std::string& prefix = "") {
  std::vector<std::string> names;
  const v1::FoundJoints all = cluster.find_joints(prefix);
  for (const auto& found : all.joints()) names.push_back(found.joint().name());
  return names;
}

// Of the joint that a command has added.
std::uint64_t added(const HeardReply& heard) {
  EXPECT_TRUE(heard->ok()) << heard->message();
  return heard->answer.applied().created_size() == 0 ? 0 : heard->answer.applied().created(0).first_joint();
}

std::vector<Command> next_commands(TestCluster& cluster) {
  cluster.step(1);
  std::vector<Command> commands;
  for (const v1::Grant& grant : cluster.work(kFirst)) {
    const std::vector<Command> granted = unpack_commands(grant.commands()).value();
    commands.insert(commands.end(), granted.begin(), granted.end());
  }
  cluster.work(kSecond);
  return commands;
}

TEST(JointsOfAWorld, GoToTheServersOfTheirBodies) {
  TestCluster cluster;
  cluster.join(kFirst);
  cluster.join(kSecond);
  WorldDescription world = small_world();
  JointDescription joint;
  joint.name = "pin";
  joint.properties.child = BodyId{4};
  joint.properties.anchor = {5, 0, 0};
  joint.properties.in_parent.position = {0.25, 0, 0};
  joint.properties.in_child.position = {0.25, 0, 0};  // the egg's centre
  world.joints = {joint};
  v1::LoadRequest request;
  *request.mutable_world() = to_proto(world);
  cluster.ask<v1::LoadReply>(request);
  std::size_t told = 0;
  for (const NodeId node : {kFirst, kSecond}) {
    const auto loads = cluster.take(node, v1::ClusterMessage::kLoadWorld);
    ASSERT_EQ(loads.size(), 1u);
    const auto bodies = unpack_records(loads[0].load_world().records());
    const auto records = unpack_joints(loads[0].load_world().joints());
    ASSERT_TRUE(bodies.ok() && records.ok());
    cluster.loaded(node, 1);
    const bool has_child =
        std::ranges::any_of(*bodies, [](const BodyRecord& body) { return body.id == BodyId{4}; });
    ASSERT_EQ(records->size(), has_child ? 1u : 0u);
    if (!has_child) continue;
    ++told;
    EXPECT_EQ(records->front().id, JointId{1});
    EXPECT_EQ(records->front().properties.in_child.position, Eigen::Vector3d::Zero());
    EXPECT_EQ(records->front().properties.anchor, (SectorIndex{5, 0, 0}));
  }
  EXPECT_EQ(told, 1u);
  EXPECT_THAT(joints(cluster), ElementsAre("pin"));
  EXPECT_EQ(added(cluster.apply(hinge("next", "", "ball"))), 2u);
}

TEST(JointsOfAWorld, AreCheckedBeforeItIsLoaded) {
  TestCluster cluster;
  cluster.join(kFirst);
  WorldDescription world = small_world();
  world.joints.resize(1);
  world.joints[0].name = "pin";
  world.joints[0].properties.child = BodyId{9};
  v1::LoadRequest request;
  *request.mutable_world() = to_proto(world);
  const auto load = cluster.ask<v1::LoadReply>(request);
  EXPECT_EQ(load->code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(load->message(), HasSubstr("joint 'pin': child = 9"));
}

TEST(Joints, FollowOthersAsLongAsTheseLast) {
  const auto cluster = loaded_cluster();
  const auto follower = [](std::uint64_t leader, std::uint32_t axis) {
    v1::Command command = hinge("follower", "", "egg");
    v1::AxisMimic& mimic =
        *command.mutable_add_joint()->mutable_joint()->mutable_properties()->add_axes()->mutable_mimic();
    mimic.set_leader(leader);
    mimic.set_axis(axis);
    mimic.set_multiplier(-2);
    return command;
  };
  const std::uint64_t id = added(cluster->apply(hinge("leader", "", "ball")));
  const auto missing = cluster->apply(follower(id + 7, 1));
  EXPECT_EQ(missing->code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(missing->message(), HasSubstr("joint 'follower': mimic leader"));
  const auto no_axis = cluster->apply(follower(id, 2));
  EXPECT_EQ(no_axis->code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(no_axis->message(), HasSubstr("mimic axis = 2 must be 1 to 1"));
  EXPECT_TRUE(cluster->apply(follower(id, 1))->ok());
  const auto leaders = [&] {
    return cluster->find_joints("follower").joints(0).joint().properties().axes(0).mimic().leader();
  };
  EXPECT_EQ(leaders(), id);
  cluster->apply(removal_of_joint("leader"));
  next_commands(*cluster);
  EXPECT_EQ(leaders(), 0u);
}

TEST(Joints, FollowNoneThatAProgramMayRemove) {
  WorldDescription world = small_world();
  const auto ball = std::ranges::find(world.bodies, "ball", &BodyDescription::name);
  ball->programs = {*new_program("breaker")};
  const auto cluster = loaded_cluster({}, world);
  const std::uint64_t id = added(cluster->apply(hinge("leader", "", "ball")));
  v1::Command command = hinge("follower", "", "egg");
  v1::AxisMimic& mimic =
      *command.mutable_add_joint()->mutable_joint()->mutable_properties()->add_axes()->mutable_mimic();
  mimic.set_leader(id);
  mimic.set_axis(1);
  const auto refused = cluster->apply(command);
  EXPECT_EQ(refused->code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(refused->message(),
              HasSubstr("joint 'follower': mimic leader: joint 'leader' may be removed by "
                        "the program breaker of body 'ball'"));
}

// A server tells that a program has removed joints in tick 2, the last one so far.
void tell_of_torn(TestCluster& cluster, const std::vector<std::uint64_t>& torn) {
  const std::uint64_t world = cluster.work(kFirst).at(0).world();
  cluster.work_all();
  v1::TickReport report;
  report.set_tick(2);
  for (const std::uint64_t joint : torn) report.add_removed_joints(joint);
  // As where a tick is repeated.
  for (int times = 0; times < 2; ++times) cluster.report(kFirst, world, 2, {report});
}

TEST(Joints, ThatProgramsHaveRemovedAreForgotten) {
  const auto cluster = loaded_cluster();
  const std::uint64_t torn = added(cluster->apply(hinge("torn", "", "ball")));
  ASSERT_TRUE(cluster->apply(hinge("kept", "", "egg"))->ok());
  cluster->step(2);
  tell_of_torn(*cluster, {torn, torn + 100});
  EXPECT_THAT(joints(*cluster), ElementsAre("kept"));
  EXPECT_EQ(cluster->apply(removal_of_joint("torn"))->code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(cluster->apply(teleport("ball", {}))->ok()) << "nothing holds it";
  EXPECT_EQ(added(cluster->apply(hinge("torn", "", "ball"))), torn + 2);
}

// It is stored and recorded as a list of a client is, and in a replay it comes from the recording.
TEST(Joints, ThatProgramsHaveRemovedAreTakenOutByACommand) {
  for (const bool is_replay : {false, true}) {
    std::vector<v1::RecordedCommands> lists;
    CoordinatorOptions options;
    options.inputs = [&](const v1::RecordedInput& input) {
      if (input.has_commands()) lists.push_back(input.commands());
    };
    const auto cluster = loaded_cluster(options, small_world(), is_replay);
    const std::uint64_t torn = added(cluster->apply(hinge("torn", "", "ball")));
    cluster->step(2);
    tell_of_torn(*cluster, {torn});
    ASSERT_EQ(lists.size(), is_replay ? 1u : 2u);
    EXPECT_EQ(joints(*cluster).size(), is_replay ? 1u : 0u);
    if (is_replay) continue;
    ASSERT_EQ(lists[1].commands_size(), 1);
    EXPECT_EQ(lists[1].commands(0).remove_joint().joint().id(), torn);
    EXPECT_EQ(lists[1].tick(), 3u);
  }
}

TEST(Joints, ATeleportOfWhatTheyHoldSaysThatItMovesOneBodyAlone) {
  const auto cluster = loaded_cluster();
  ASSERT_TRUE(cluster->apply(hinge("arm", "lift", "egg"))->ok());
  for (const std::string held : {"lift", "egg"}) {
    v1::Command command = teleport(held, {});
    const auto refused = cluster->apply(command);
    EXPECT_EQ(refused->code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(refused->message(), HasSubstr("joint \"arm\" holds it"));
    command.mutable_teleport()->set_alone(true);
    EXPECT_TRUE(cluster->apply(command)->ok());
  }
  EXPECT_TRUE(cluster->apply(teleport("ball", {}))->ok());
}

TEST(Joints, AreAddedInCentreFramesAndListedInBodyFrames) {
  const auto cluster = loaded_cluster();
  v1::Command command = hinge("arm", "lift", "egg");
  *command.mutable_add_joint()
       ->mutable_joint()
       ->mutable_properties()
       ->mutable_in_child()
       ->mutable_position() = to_proto(Eigen::Vector3d(1, 0, 0));
  const auto heard = cluster->apply(command);
  EXPECT_EQ(added(heard), 1u);
  EXPECT_EQ(heard->answer.applied().tick(), 1u);
  const std::vector<Command> commands = next_commands(*cluster);
  ASSERT_EQ(commands.size(), 1u);
  const JointRecord& record = std::get<AddJoint>(commands[0]).record;
  EXPECT_EQ(record.id, JointId{1});
  EXPECT_EQ(record.parent_motion, Motion::kKinematic);
  EXPECT_EQ(record.properties.parent, BodyId{3});
  EXPECT_EQ(record.properties.child, BodyId{4});
  EXPECT_EQ(record.properties.in_child.position, Eigen::Vector3d(0.75, 0, 0));

  const v1::FoundJoints listed = cluster->find_joints();
  ASSERT_EQ(listed.joints_size(), 1);
  const v1::FoundJoints::Found& found = listed.joints(0);
  EXPECT_EQ(found.parent(), "lift");
  EXPECT_EQ(found.child(), "egg");
  EXPECT_EQ(found.child_centre().x(), 0.25);
  EXPECT_EQ(found.joint().properties().in_child().position().x(), 1);
}

TEST(Joints, AreDrivenByColumnsAsOneByOne) {
  const auto cluster = loaded_cluster();
  cluster->apply(hinge("a", "lift", "ball"));
  cluster->apply(hinge("b", "lift", "egg"));
  next_commands(*cluster);
  v1::Command columns = drive_columns({2, 1}, {0.5, -0.25});
  columns.mutable_drive_joints()->set_mode(v1::JointDrive::SERVO);
  columns.mutable_drive_joints()->add_stiffness(40);
  ASSERT_TRUE(cluster->apply(columns)->ok());
  const std::vector<Command> commands = next_commands(*cluster);
  ASSERT_EQ(commands.size(), 2u);
  const JointDrive expected[] = {{DriveMode::kServo, 0.5, 40}, {DriveMode::kServo, -0.25, 40}};
  for (std::size_t n = 0; n < 2; ++n) {
    const auto& set = std::get<SetDrives>(commands[n]);
    EXPECT_EQ(set.id, JointId{2 - n});
    EXPECT_EQ(set.axes, 1);
    EXPECT_EQ(set.drives[0], expected[n]);
  }
}

TEST(Joints, GetNamesAndNewIds) {
  const auto cluster = loaded_cluster();
  EXPECT_EQ(added(cluster->apply(hinge("", "", "ball"))), 1u);
  EXPECT_EQ(added(cluster->apply(hinge("b", "", "ball"))), 2u);
  EXPECT_THAT(joints(*cluster), ElementsAre("joint_1", "b"));
  EXPECT_THAT(joints(*cluster, "j"), ElementsAre("joint_1"));
  ASSERT_TRUE(cluster->apply(removal_of_joint("b"))->ok());
  EXPECT_EQ(cluster->apply(removal_of_joint("b"))->code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(added(cluster->apply(hinge("b", "", "ball"))), 3u);
  const std::vector<Command> commands = next_commands(*cluster);
  ASSERT_EQ(commands.size(), 4u);
  EXPECT_EQ(std::get<RemoveJoint>(commands[2]).id, JointId{2});
}

TEST(Joints, AreAtMostSoManyOfABody) {
  const auto cluster = loaded_cluster();
  for (std::size_t n = 0; n < kJointsPerBodyMax; ++n)
    ASSERT_TRUE(cluster->apply(hinge("", "", "ball"))->ok());
  const auto refused = cluster->apply(hinge("one_more", "egg", "ball"));
  EXPECT_EQ(refused->code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(refused->message(), HasSubstr("joint 'one_more': the body with the id"));
  EXPECT_THAT(refused->message(), HasSubstr("has at most 128"));
  EXPECT_TRUE(cluster->apply(hinge("other", "", "egg"))->ok());
  ASSERT_TRUE(cluster->apply(removal_of_joint("joint_1"))->ok());
  EXPECT_TRUE(cluster->apply(hinge("one_more", "egg", "ball"))->ok());
}

TEST(Joints, GoWithTheirBodies) {
  const auto cluster = loaded_cluster();
  cluster->apply(hinge("a", "lift", "ball"));
  cluster->apply(hinge("b", "egg", "ball"));
  cluster->apply(hinge("c", "", "egg"));
  ASSERT_TRUE(cluster->apply(removal("ball"))->ok());
  EXPECT_THAT(joints(*cluster), ElementsAre("c"));
  ASSERT_TRUE(cluster->apply(removal("egg"))->ok());
  EXPECT_THAT(joints(*cluster), IsEmpty());
}

TEST(Joints, DrivesOfAxesThatAreNotNamedStay) {
  const auto cluster = loaded_cluster();
  v1::Command cross = hinge("cross", "lift", "egg");
  cross.mutable_add_joint()->mutable_joint()->mutable_properties()->set_type(v1::JOINT_UNIVERSAL);
  cluster->apply(cross);
  ASSERT_TRUE(cluster->apply(drive("cross", 2, v1::JointDrive::VELOCITY, 3))->ok());
  ASSERT_TRUE(cluster->apply(drive("cross", 1, v1::JointDrive::POSITION, 0.5))->ok());
  const std::vector<Command> commands = next_commands(*cluster);
  ASSERT_EQ(commands.size(), 3u);
  const JointDrives expected{JointDrive{DriveMode::kPosition, 0.5}, JointDrive{DriveMode::kVelocity, 3}};
  EXPECT_EQ(std::get<SetDrives>(commands[2]).drives, expected);
  EXPECT_EQ(cluster->find_joints().joints(0).joint().drives(1).target(), 3);
}

TEST(Joints, AreRefusedWithTheFieldAndTheBound) {
  const auto cluster = loaded_cluster();
  const auto expect = [](const auto& heard, absl::StatusCode code, const std::string& words) {
    EXPECT_EQ(heard->code(), code) << heard->message();
    EXPECT_THAT(heard->message(), HasSubstr(words));
  };
  const auto add = [&](const v1::Command& command) { return cluster->apply(command); };
  const auto& command = add;
  constexpr auto kNotFound = absl::StatusCode::kNotFound;

  v1::Command nothing;
  nothing.mutable_add_joint();
  expect(add(nothing), kInvalid, "joint must be set");
  expect(add(hinge("j", "", "")), kInvalid, "joint 'j': child: an id or a name");
  expect(add(hinge("j", "", "nobody")), kNotFound,
         "joint 'j': child: there is no body with the name 'nobody'");
  expect(add(hinge("j", "nobody", "ball")), kNotFound, "joint 'j': parent: there is no body");
  expect(add(hinge("j", "ball", "ball")), kInvalid, "joint 'j': parent and child");
  expect(add(hinge("j", "ball", "floor")), kInvalid, "joint 'j': the child must be dynamic");
  v1::Command request = hinge("j", "floor", "ball");
  request.mutable_add_joint()
      ->mutable_joint()
      ->mutable_properties()
      ->mutable_in_child()
      ->mutable_position()
      ->set_x(101);
  expect(add(request), kInvalid, "in_child: its distance 101 m");
  request = hinge("j", "floor", "ball");
  request.mutable_add_joint()->mutable_joint()->mutable_properties()->add_axes()->set_lower(-4);
  expect(add(request), kInvalid, "joint 'j': axis 1: limit = -4 rad");
  ASSERT_TRUE(add(hinge("j", "floor", "ball"))->ok());
  expect(add(hinge("j", "floor", "ball")), absl::StatusCode::kAlreadyExists, "joint 'j'");

  expect(command(removal_of_joint("k")), kNotFound, "'k'");
  nothing.mutable_remove_joint();
  expect(command(nothing), kInvalid, "joint: an id or a name");
  expect(command(drive("k", 1, v1::JointDrive::FREE, 0)), kNotFound, "'k'");
  expect(command(drive("j", 0, v1::JointDrive::FREE, 0)), kInvalid, "joint 'j': axis = 0 must be 1 to 2");
  expect(command(drive("j", 2, v1::JointDrive::VELOCITY, 0)), kInvalid, "drive of axis 2 must be free");
  expect(command(drive("j", 1, static_cast<v1::JointDrive::Mode>(9), 0)), kInvalid, "mode = 9");
  expect(command(drive("j", 1, v1::JointDrive::POSITION, 5)), kInvalid, "position = 5 rad");
  expect(command(drive("j", 1, v1::JointDrive::VELOCITY, kNan)), kInvalid, "must be finite");
  nothing = drive("j", 1, v1::JointDrive::FREE, 0);
  nothing.mutable_set_joint_drives()->clear_drives();
  expect(command(nothing), kInvalid, "drives must not be empty");
  expect(command(drive_columns({}, {1})), kInvalid, "joints must not be empty");
  expect(command(drive_columns({1, 9}, {1})), kNotFound, "joints[1]: there is no joint with the id 9");
  expect(command(drive_columns({1, 1, 1}, {1, 2})), kInvalid,
         "targets: 2 elements must be one for each of 3 joints, or one for all");
  expect(command(drive_columns({1}, {kNan})), kInvalid, "joints[0] ('j'): drive of axis 1");
  nothing = drive_columns({1}, {1});
  nothing.mutable_drive_joints()->set_axis(3);
  expect(command(nothing), kInvalid, "joints[0] ('j'): axis = 3 must be 1 to 2");
  EXPECT_THAT(joints(*cluster), ElementsAre("j"));
}

}  // namespace
}  // namespace tessera
