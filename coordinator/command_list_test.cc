// A list of commands takes effect as a whole or not at all.
#include "coordinator/command_list.h"

#include <algorithm>
#include <set>

#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "coordinator/test_mutations.h"
#include "lpss/programs/registry.h"
#include "proto/snapshot.h"

namespace tessera {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr Tick kNext = 8;

// The small world, with a joint from the lift to the egg, one that follows it, a frame on the egg, and a box
// whose shape no other body has.
WorldDescription jointed_world() {
  WorldDescription world = small_world();
  world.shapes.push_back(Shape{{{Box{{1, 2, 3}}, {}}}});
  BodyDescription& box = world.bodies.emplace_back();
  box.name = "box";
  box.properties.shape = 2;
  JointDescription& arm = world.joints.emplace_back();
  arm.name = "arm";
  arm.properties.type = JointType::kRevolute;
  arm.properties.parent = BodyId{3};
  arm.properties.child = BodyId{4};
  JointDescription& follower = world.joints.emplace_back();
  follower.name = "follower";
  follower.properties.type = JointType::kRevolute;
  follower.properties.child = BodyId{2};
  follower.properties.axes[0].mimic = {.leader = JointId{1}, .axis = 0, .multiplier = 2};
  world.frames.push_back({"tip", 3, {}});
  const auto lift = std::ranges::find(world.bodies, "lift", &BodyDescription::name);
  lift->programs = {*new_program("mover")};
  return world;
}

// All that a snapshot has of it.
std::string written(const WorldRegistry& registry) {
  std::string bytes;
  for (const v1::SnapshotChunk& chunk :
       head_chunks(registry.catalogue(), registry.settings(), {}, kNext, registry.shapes().at(kNext)))
    bytes += chunk.SerializeAsString();
  return bytes;
}

v1::Command on_body(const std::string& name, v1::BodyRef* (*field)(v1::Command&)) {
  v1::Command command;
  field(command)->set_name(name);
  return command;
}

v1::Command change_of_motion(const std::string& body, v1::Motion motion) {
  v1::Command command =
      on_body(body, [](v1::Command& c) { return c.mutable_set_properties()->mutable_body(); });
  command.mutable_set_properties()->set_motion(motion);
  return command;
}

// One of each kind, and those whose effects differ.
std::vector<v1::Command> all_kinds() {
  WorldDescription robot;
  robot.shapes = {Shape{{{Box{{1, 1, 1}}, {}}}}};
  robot.bodies.resize(2);
  robot.bodies[0].name = "base";
  robot.bodies[1].name = "hand";
  for (BodyDescription& body : robot.bodies) body.properties.assembly = 1;
  JointDescription& wrist = robot.joints.emplace_back();
  wrist.name = "wrist";
  wrist.properties.parent = BodyId{1};
  wrist.properties.child = BodyId{2};
  robot.frames.push_back({"camera", 1, {}});

  v1::Command belt =
      on_body("box", [](v1::Command& c) { return c.mutable_set_surface_motion()->mutable_body(); });
  *belt.mutable_set_surface_motion()->mutable_velocity() = xyz(1, 0, 0);
  v1::Command force = on_body("egg", [](v1::Command& c) { return c.mutable_apply_force()->mutable_body(); });
  v1::Command target =
      on_body("lift", [](v1::Command& c) { return c.mutable_set_kinematic_target()->mutable_body(); });
  *target.mutable_set_kinematic_target()->mutable_pose() = to_proto(WorldPose{});
  v1::Command heavier =
      on_body("ball", [](v1::Command& c) { return c.mutable_set_properties()->mutable_body(); });
  heavier.mutable_set_properties()->set_mass(7);
  v1::Command state;
  v1::SetState::OfBody& placed = *state.mutable_set_state()->add_bodies();
  placed.mutable_body()->set_name("lift");
  *placed.mutable_pose() = to_proto(WorldPose{});
  state.mutable_set_state()->add_joints()->mutable_joint()->set_name("arm");
  v1::Command blast;
  blast.mutable_apply_radial_impulse()->mutable_centre();
  v1::Command thruster = on_body("box", [](v1::Command& c) { return c.mutable_set_force()->mutable_body(); });
  *thruster.mutable_set_force()->mutable_force()->mutable_force() = xyz(0, 0, 3);
  v1::Command tagged =
      on_body("ball", [](v1::Command& c) { return c.mutable_set_properties()->mutable_body(); });
  tagged.mutable_set_properties()->set_user_data(std::string("\0\xff", 2));
  tagged.mutable_set_properties()->set_owner("alice");
  v1::Command second_follower = hinge("second", "", "box");
  v1::AxisMimic& mimic = *second_follower.mutable_add_joint()
                              ->mutable_joint()
                              ->mutable_properties()
                              ->add_axes()
                              ->mutable_mimic();
  mimic.set_leader(1);
  mimic.set_axis(1);
  mimic.set_multiplier(1);
  v1::Command told = on_body("lift", [](v1::Command& c) { return c.mutable_tell_program()->mutable_body(); });
  v1::NamedNumber& goal = *told.mutable_tell_program()->add_numbers();
  goal.set_name("goal");
  goal.set_value(0.5);
  return {spawn("new", 0.75),
          spawn("", 0.5),
          spawn_of(model_of(robot), "robot/"),
          removal("ball"),
          removal("egg"),
          removal("box"),
          removal_of_all("b"),
          velocity(2, 1),
          push("ball"),
          force,
          teleport("box", {}),
          target,
          belt,
          hinge("added", "box", "egg"),
          second_follower,
          removal_of_joint("arm"),
          removal_of_joint("follower"),
          drive("arm", 1, v1::JointDrive::VELOCITY, 3),
          drive_columns({1}, {2}),
          state,
          heavier,
          change_of_motion("lift", v1::MOTION_DYNAMIC),
          blast,
          thruster,
          told,
          tagged};
}

TEST(CommandLists, HaveOneOfEachKindHere) {
  std::set<v1::Command::KindCase> kinds;
  for (const v1::Command& command : all_kinds()) {
    WorldRegistry registry = registry_of(jointed_world());
    EXPECT_TRUE(give(request_of({command}).commands(), registry, kNext).ok()) << command.DebugString();
    kinds.insert(command.kind_case());
  }
  EXPECT_EQ(kinds.size(), static_cast<std::size_t>(v1::Command::descriptor()->field_count()));
}

// Every pair of commands, before one that is impossible: afterwards, all is as it was, and the same commands
// do what they do in a world in which nothing was tried.
TEST(CommandLists, LeaveNothingBehindWhereOneIsImpossible) {
  const WorldDescription world = jointed_world();
  const std::string before = written(registry_of(world));
  for (const v1::Command& first : all_kinds()) {
    for (const v1::Command& second : all_kinds()) {
      SCOPED_TRACE(first.ShortDebugString() + "   " + second.ShortDebugString());
      WorldRegistry tried = registry_of(world);
      WorldRegistry fresh = registry_of(world);
      EXPECT_FALSE(give(request_of({first, second, removal("nobody")}).commands(), tried, kNext).ok());
      tried.roll_back();
      ASSERT_EQ(written(tried), before);
      for (const v1::Command& command : {second, first}) {
        const auto expected = give(request_of({command}).commands(), fresh, kNext);
        const auto given = give(request_of({command}).commands(), tried, kNext);
        ASSERT_EQ(given.status(), expected.status());
        for (WorldRegistry* registry : {&tried, &fresh}) {
          if (given.ok()) {
            registry->keep();
          } else {
            registry->roll_back();
          }
        }
        if (!given.ok()) continue;
        EXPECT_EQ(given->commands.list(), expected->commands.list());
        EXPECT_EQ(given->new_shapes.size(), expected->new_shapes.size());
        EXPECT_EQ(given->applied.SerializeAsString(), expected->applied.SerializeAsString());
      }
      ASSERT_EQ(written(tried), written(fresh));
    }
  }
}

// Names as well: each is free again, and means what it meant.
TEST(CommandLists, NamesMeanWhatTheyMeantBefore) {
  WorldRegistry registry = registry_of(jointed_world());
  ASSERT_FALSE(give(request_of({spawn("new"), removal("egg"), removal_of_joint("follower"),
                                hinge("added", "", "ball"), removal("nobody")})
                        .commands(),
                    registry, kNext)
                   .ok());
  registry.roll_back();
  v1::BodyRef body;
  body.set_name("new");
  EXPECT_EQ(registry.resolve(body).status().code(), absl::StatusCode::kNotFound);
  body.set_name("egg");
  EXPECT_EQ(registry.resolve(body).value(), BodyId{4});
  body.set_name("tip");
  EXPECT_THAT(std::string(registry.resolve(body).status().message()), HasSubstr("frame of the body 'egg'"));
  EXPECT_EQ(registry.with_prefix("").size(), 5u);
  EXPECT_FALSE(registry.joints().has_name("added"));
  EXPECT_TRUE(registry.joints().has_name("arm"));
  EXPECT_EQ(registry.joints().with_child(BodyId{4})->name, "arm");
  EXPECT_EQ(registry.joints().holding(BodyId{2})->name, "follower");
  EXPECT_EQ(registry.joints().find(JointId{2})->record.properties.axes[0].mimic.leader, JointId{1});
}

// What comes earlier in a list is there for what comes later.
TEST(CommandLists, GoOnFromTheirOwnEffects) {
  const auto cluster = loaded_cluster();
  const auto heard =
      cluster->apply({spawn("new"), hinge("pin", "lift", "new"), drive("pin", 1, v1::JointDrive::VELOCITY, 1),
                      push("new"), removal("ball"), spawn("ball", 0.75)});
  ASSERT_TRUE(heard->ok()) << heard->message();
  const v1::Applied& applied = heard->answer.applied();
  EXPECT_EQ(applied.tick(), 1u);
  ASSERT_EQ(applied.created_size(), 3);
  EXPECT_EQ(applied.created(0).command(), 0u);
  EXPECT_EQ(applied.created(0).first_body(), 5u);
  EXPECT_EQ(applied.created(0).bodies(), 1u);
  EXPECT_EQ(applied.created(0).first_joint(), 0u);
  EXPECT_EQ(applied.created(1).command(), 1u);
  EXPECT_EQ(applied.created(1).first_body(), 0u);
  EXPECT_EQ(applied.created(1).first_joint(), 1u);
  EXPECT_EQ(applied.created(1).joints(), 1u);
  EXPECT_EQ(applied.created(2).command(), 5u);
  EXPECT_EQ(applied.created(2).first_body(), 6u);
  cluster->step(1);
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  ASSERT_EQ(grants.size(), 1u) << "all take effect at one tick";
  const std::vector<Command> commands = unpack_commands(grants[0].commands()).value();
  ASSERT_EQ(commands.size(), 6u);
  EXPECT_TRUE(std::holds_alternative<SpawnBody>(commands[0]));
  EXPECT_TRUE(std::holds_alternative<AddJoint>(commands[1]));
  EXPECT_EQ(std::get<SetDrives>(commands[2]).id, JointId{1});
  EXPECT_EQ(std::get<ApplyImpulse>(commands[3]).id, BodyId{5});
  EXPECT_EQ(std::get<RemoveBody>(commands[4]).id, BodyId{2});
  EXPECT_EQ(std::get<SpawnBody>(commands[5]).record.id, BodyId{6});
}

TEST(CommandLists, ErrorsNameTheElement) {
  const auto cluster = loaded_cluster();
  const v1::FoundBodies before = cluster->find_bodies();
  const auto heard = cluster->apply({push("ball"), removal("ball"), spawn("new", 0.75), spawn("egg")});
  EXPECT_EQ(heard->code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(heard->message().rfind("commands[3] (spawn): ", 0), 0u) << heard->message();
  const auto unknown = cluster->apply({push("ball"), v1::Command()});
  EXPECT_EQ(unknown->message(), "commands[1]: a command of no known kind");
  const auto alone = cluster->apply(spawn("egg"));
  EXPECT_THAT(alone->message(), ::testing::Not(HasSubstr("commands["))) << "there are no others";

  EXPECT_EQ(cluster->find_bodies().SerializeAsString(), before.SerializeAsString());
  EXPECT_EQ(cluster->status().bodies(), 4u);
  EXPECT_EQ(cluster->apply(spawn("new", 0.75))->answer.applied().created(0).first_body(), 5u);
  cluster->step(1);
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(unpack_commands(grants[0].commands()).value().size(), 1u);
  ASSERT_EQ(grants[0].new_shapes_size(), 1);
  EXPECT_EQ(grants[0].new_shapes(0).id(), 2u) << "the refused one left no shape behind";
}

// Each kind, in a list after one that is right: the error names the element, and nothing is done.
class WrongElements : public ::testing::Test {
 protected:
  void expect_refused(const v1::Request& list, absl::StatusCode code, const std::string& owner = "") {
    const int last = list.commands_size() - 1;
    const v1::Command& command = list.commands(last);
    const absl::Status status = give(list.commands(), registry_, kNext, owner).status();
    registry_.roll_back();
    EXPECT_EQ(status.code(), code) << status << "\n" << command.DebugString();
    const std::string kind = v1::Command::descriptor()->FindFieldByNumber(command.kind_case())->name();
    EXPECT_THAT(std::string(status.message()),
                ::testing::StartsWith(absl::StrCat("commands[", last, "] (", kind, "): ")));
  }
  ~WrongElements() override { EXPECT_EQ(written(registry_), written(registry_of(jointed_world()))); }

  WorldRegistry registry_ = registry_of(jointed_world());
};

TEST_F(WrongElements, NumbersThatAreNone) {
  for (const v1::Command& command : all_kinds()) {
    v1::Request list = request_of({push("egg"), command});
    with_each_number_wrong(*list.mutable_commands(1), [&](const std::string& field) {
      SCOPED_TRACE(field);
      expect_refused(list, absl::StatusCode::kInvalidArgument);
    });
  }
}

TEST_F(WrongElements, BodiesAndJointsThatThereAreNot) {
  for (const v1::Command& command : all_kinds()) {
    v1::Request list = request_of({push("egg"), command});
    with_each_reference_wrong(*list.mutable_commands(1), [&](const std::string& field) {
      SCOPED_TRACE(field);
      expect_refused(list, absl::StatusCode::kNotFound);
    });
  }
}

TEST_F(WrongElements, BodiesOfAnotherOwner) {
  for (const v1::Command& command : all_kinds()) {
    if (command.has_spawn()) continue;
    expect_refused(request_of({spawn("mine"), push("mine"), command}), absl::StatusCode::kPermissionDenied,
                   "alice");
  }
}

TEST(CommandLists, HaveSoManyElements) {
  WorldRegistry registry = registry_of(small_world());
  google::protobuf::RepeatedPtrField<v1::Command> list;
  for (int n = 0; n <= kCommandsPerListMax; ++n) *list.Add() = velocity(2, 1);
  const auto refused = give(list, registry, 1);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.status().message()),
              AllOf(HasSubstr("commands: 100001 elements"), HasSubstr("at most 100000")));
  list.RemoveLast();
  EXPECT_EQ(give(list, registry, 1)->commands.size(), static_cast<std::size_t>(kCommandsPerListMax));
  for (int n = list.size(); n < 1'000'000; ++n) list.Add();
  EXPECT_THAT(std::string(give(list, registry, 1).status().message()), HasSubstr("1000000 elements"));
}

// A list that there is no room for is not half there.
TEST(CommandLists, WaitForATickWhereThereIsRoomForAll) {
  const auto cluster = loaded_cluster();
  const std::vector<v1::Command> many(kCommandsPerListMax, velocity(2, 1));
  ASSERT_TRUE(cluster->apply(many)->ok());
  ASSERT_TRUE(cluster->apply(many)->ok());
  std::vector<v1::Command> more = many;
  more.front() = spawn("new");
  EXPECT_EQ(cluster->apply(more)->code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(cluster->status().bodies(), 4u);
  EXPECT_TRUE(cluster->apply(spawn("new"))->ok());
}

// As a recording has it, and as a coordinator that takes over gives it.
TEST(CommandLists, GivenAgainDoTheSame) {
  for (const v1::Command& command : all_kinds()) {
    WorldRegistry registry = registry_of(jointed_world());
    WorldRegistry other = registry_of(jointed_world());
    const v1::Request list = request_of({command});
    v1::RecordedCommands recorded = next_record(registry, kNext);
    *recorded.mutable_commands() = list.commands();
    EXPECT_EQ(recorded.tick(), kNext);
    EXPECT_EQ(recorded.next_body(), 6u);
    EXPECT_EQ(recorded.next_joint(), 3u);
    const auto given = give(list.commands(), registry, kNext);
    registry.keep();
    const auto again = give_again(recorded, other);
    ASSERT_TRUE(given.ok() && again.ok()) << given.status() << again.status();
    EXPECT_EQ(again->commands.list(), given->commands.list());
    EXPECT_EQ(again->applied.SerializeAsString(), given->applied.SerializeAsString());
    EXPECT_EQ(written(other), written(registry));
  }
}

TEST(CommandLists, OfAnotherWorldAreNotGivenAgain) {
  WorldRegistry registry = registry_of(jointed_world());
  v1::RecordedCommands recorded = next_record(registry, kNext);
  *recorded.mutable_commands() = request_of({spawn("a")}).commands();
  const std::string before = written(registry);
  recorded.set_next_body(9);
  EXPECT_EQ(give_again(recorded, registry).status().code(), absl::StatusCode::kInternal);
  recorded.set_next_body(6);
  *recorded.add_commands() = removal("nobody");
  EXPECT_EQ(give_again(recorded, registry).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(written(registry), before);
}

}  // namespace
}  // namespace tessera
