// Commands: what is refused, and at which tick the rest takes effect.
#include <cmath>
#include <limits>

#include "coordinator/command_list.h"
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "lpss/model/limits.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

// The commands of each grant with ticks that a server has, by the tick that they apply at.
std::map<Tick, std::vector<Command>> commands_of(const std::vector<v1::Grant>& grants, Tick before = 0) {
  std::map<Tick, std::vector<Command>> result;
  Tick tick = before;
  for (const v1::Grant& grant : grants) {
    const auto commands = unpack_commands(grant.commands());
    EXPECT_TRUE(commands.ok());
    if (!commands->empty()) result[tick + 1] = *commands;
    tick += grant.ticks();
  }
  return result;
}

TEST(Commands, WhilePausedAreToldTheTickThatWillBeNext) {
  const auto cluster = loaded_cluster();
  const auto first = cluster->apply(velocity(2, 1));
  ASSERT_TRUE(first->ok());
  EXPECT_EQ(first->answer.applied().tick(), 1u);
  EXPECT_TRUE(cluster->take_grants(kFirst).empty());
  cluster->step(3);
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  cluster->work(kSecond);
  const auto commands = commands_of(grants);
  ASSERT_EQ(commands.size(), 1u);
  ASSERT_EQ(commands.at(1).size(), 1u);
  EXPECT_EQ(std::get<SetVelocity>(commands.at(1)[0]).linear[0], 1);
  EXPECT_EQ(cluster->apply(velocity(2, 1))->answer.applied().tick(), 4u);
}

// The reply does not wait for the tick.
TEST(Commands, WhileRunningAreToldTheirTickAtOnce) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::ResumeReply>(v1::ResumeRequest());
  std::uint64_t granted = 0;
  const std::vector<v1::Grant> grants = cluster->take_grants(kFirst);
  for (const v1::Grant& grant : grants) granted += grant.ticks();
  EXPECT_EQ(granted, 32u);
  const auto command = cluster->apply(velocity(2, 1));
  ASSERT_TRUE(command->ok());
  EXPECT_EQ(command->answer.applied().tick(), granted + 1);
  EXPECT_EQ(command->answer.tick(), 0u) << "completed so far";
  EXPECT_EQ(cluster->apply(velocity(2, 2))->answer.applied().tick(), granted + 1) << "before it is granted";
  cluster->report(kFirst, 1, 8);
  cluster->report(kSecond, 1, 1);  // a window of one tick is open
  const auto commands = commands_of(cluster->take_grants(kFirst), granted);
  ASSERT_EQ(commands.count(granted + 1), 1u);
  EXPECT_EQ(commands.at(granted + 1).size(), 2u);
  EXPECT_EQ(cluster->apply(velocity(2, 3))->answer.applied().tick(), granted + 2);
}

TEST(Commands, OfABodyThatIsTeleportedDelayNobody) {
  const auto cluster = loaded_cluster();
  for (int n = 0; n < 600; ++n) {
    EXPECT_EQ(cluster->apply(teleport("ball", {}))->answer.applied().tick(), 1u);
    EXPECT_EQ(cluster->apply(velocity(2, 3))->answer.applied().tick(), 1u);
  }
  EXPECT_EQ(cluster->apply(velocity(4, 4))->answer.applied().tick(), 1u);
  cluster->step(10);
  EXPECT_EQ(commands_of(cluster->work(kFirst)).at(1).size(), 1201u);
}

TEST(Commands, TeleportsAreOfTheCentreFrame) {
  const auto cluster = loaded_cluster();
  const WorldPose pose{{{7, 0, 0}, {49.9, 0, 0}}, Eigen::Quaterniond::Identity()};
  ASSERT_TRUE(cluster->apply(teleport("egg", pose))->ok());
  cluster->step(1);
  const auto commands = commands_of(cluster->work(kFirst));
  const Teleport& jump = std::get<Teleport>(commands.at(1).at(0));
  EXPECT_EQ(jump.home, (SectorIndex{8, 0, 0}));  // 49.9 + 0.25 is behind the border
  EXPECT_NEAR(jump.state.position[0], -49.85, 1e-12);
}

TEST(Commands, TeleportsThatKeepTheOrientationAreOfTheBodyFrame) {
  const auto cluster = loaded_cluster();
  v1::Command command = teleport("egg", {{{7, 0, 0}, {49.9, 0, 0}}, Eigen::Quaterniond(0, 0, 0, 0)});
  command.mutable_teleport()->set_keeps_orientation(true);
  command.mutable_teleport()->set_keeps_angular_velocity(true);
  command.mutable_teleport()->mutable_angular_velocity()->set_x(std::nan(""));
  ASSERT_TRUE(cluster->apply(command)->ok());
  cluster->step(1);
  const auto commands = commands_of(cluster->work(kFirst));
  const Teleport& jump = std::get<Teleport>(commands.at(1).at(0));
  EXPECT_TRUE(jump.keeps_rotation);
  EXPECT_FALSE(jump.keeps_linear_velocity);
  EXPECT_TRUE(jump.keeps_angular_velocity);
  EXPECT_EQ(jump.home, (SectorIndex{7, 0, 0}));
  EXPECT_EQ(jump.state.position[0], 49.9);
}

TEST(Spawn, SharesEqualShapesAndNumbersNewOnes) {
  const auto cluster = loaded_cluster();
  const auto known = cluster->apply(spawn("a", 0.5));
  const auto fresh = cluster->apply(spawn("b", 0.75));
  const auto again = cluster->apply(spawn("", 0.75));
  ASSERT_TRUE(known->ok() && fresh->ok() && again->ok()) << known->message() << fresh->message();
  EXPECT_EQ(known->answer.applied().created(0).first_body(), 5u);
  EXPECT_EQ(fresh->answer.applied().created(0).first_body(), 6u);
  EXPECT_EQ(again->answer.applied().created(0).first_body(), 7u);
  EXPECT_EQ(again->answer.applied().tick(), 1u);
  cluster->step(1);
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].new_shapes_size(), 1);
  const auto commands = commands_of(grants);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[0]).record.properties.shape, 1u);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[1]).record.properties.shape, 2u);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[2]).record.properties.shape, 2u);

  v1::FindBodies find;
  find.set_name_prefix("body_");
  const v1::FoundBodies found = cluster->find_bodies(find);
  ASSERT_EQ(found.bodies_size(), 1);
  EXPECT_EQ(found.bodies(0).name(), "body_7");
  EXPECT_EQ(cluster->status().bodies(), 7u);
}

TEST(Spawn, ShapesOfAWorldHaveALimitOfBytes) {
  CoordinatorOptions options;
  options.shape_bytes_max = 200;
  const auto cluster = loaded_cluster(options);
  int spawned = 0;
  std::string refusal;
  for (; refusal.empty() && spawned < 100; ++spawned) {
    const auto heard = cluster->apply(spawn("", 1.0 + 0.01 * spawned));
    if (heard->code() == absl::StatusCode::kResourceExhausted) refusal = heard->message();
  }
  EXPECT_GT(spawned, 2);
  EXPECT_THAT(refusal, HasSubstr("may have 200 (--shapes-mib)"));
  EXPECT_TRUE(cluster->apply(spawn("", 1.0))->ok()) << "a shape that it has needs no room";
}

TEST(Spawn, ShapesGoWithTheLastBodyThatHasThem) {
  CoordinatorOptions options;
  options.shape_bytes_max = 200;
  const auto cluster = loaded_cluster(options);
  for (int n = 0; n < 200; ++n) {
    const auto first = cluster->apply(spawn("first", 1.0 + 0.01 * n));
    ASSERT_TRUE(first->ok()) << n << " " << first->message();
    ASSERT_TRUE(cluster->apply(spawn("second", 1.0 + 0.01 * n))->ok());
    cluster->step(1);
    const std::vector<v1::Grant> spawned = cluster->work(kFirst);
    cluster->work(kSecond);
    ASSERT_EQ(spawned.at(0).new_shapes_size(), 1);
    const ShapeId shape = spawned[0].new_shapes(0).id();
    EXPECT_EQ(shape, 2u + n) << "ids are never given twice";

    cluster->apply({removal("first"), removal("second")});
    cluster->step(1);
    const auto commands = unpack_commands(cluster->work(kFirst).at(0).commands()).value();
    cluster->work(kSecond);
    ASSERT_EQ(commands.size(), 2u);
    EXPECT_EQ(std::get<RemoveBody>(commands[0]).last_of, std::nullopt);
    EXPECT_EQ(std::get<RemoveBody>(commands[1]).last_of, shape);
  }
}

TEST(Spawn, RemovedNamesMayBeUsedAgainButNotIds) {
  const auto cluster = loaded_cluster();
  EXPECT_TRUE(cluster->apply(removal("ball"))->ok());
  EXPECT_EQ(cluster->apply(removal("ball"))->code(), absl::StatusCode::kNotFound);
  const auto heard = cluster->apply(spawn("ball", 0.5));
  ASSERT_TRUE(heard->ok());
  EXPECT_EQ(heard->answer.applied().created(0).first_body(), 5u);
}

TEST(FindBodies, ByPrefixAscendingAndCut) {
  const auto cluster = loaded_cluster();
  v1::FindBodies find;
  v1::FoundBodies found = cluster->find_bodies(find);
  ASSERT_EQ(found.bodies_size(), 4);
  EXPECT_EQ(found.bodies(0).name(), "floor");
  EXPECT_EQ(found.bodies(0).properties().motion(), v1::MOTION_STATIC);
  find.set_limit(2);
  found = cluster->find_bodies(find);
  EXPECT_EQ(found.bodies_size(), 2);
  EXPECT_TRUE(found.truncated());
  find.set_name_prefix("e");
  found = cluster->find_bodies(find);
  ASSERT_EQ(found.bodies_size(), 1);
  EXPECT_EQ(found.bodies(0).id(), 4u);
  EXPECT_FALSE(found.truncated());
}

TEST(FindBodies, ByIdAndMotionAndWithShapes) {
  const auto cluster = loaded_cluster();
  v1::FindBodies find;
  for (const std::uint64_t id : {4, 99, 2, 4}) find.add_ids(id);
  v1::FoundBodies found = cluster->find_bodies(find);
  ASSERT_EQ(found.bodies_size(), 2);
  EXPECT_EQ(found.bodies(0).id(), 2u);
  EXPECT_EQ(found.bodies(1).id(), 4u);
  EXPECT_TRUE(found.shapes().empty());

  find.Clear();
  find.set_only_static(true);
  find.set_with_shapes(true);
  find.set_limit(1);
  found = cluster->find_bodies(find);
  ASSERT_EQ(found.bodies_size(), 1);
  EXPECT_EQ(found.bodies(0).name(), "floor");
  ASSERT_EQ(found.shapes().size(), 1u);
  EXPECT_EQ(found.shapes().begin()->first, found.bodies(0).properties().shape());
}

// Everything that is refused, with the words that must be in the message; nothing of it changes the world.
TEST(Commands, AreRefusedWithTheFieldAndTheBound) {
  const auto cluster = loaded_cluster();
  const auto expect = [&](const auto& heard, absl::StatusCode code, const char* words) {
    EXPECT_EQ(heard->code(), code) << heard->message();
    EXPECT_THAT(heard->message(), HasSubstr(words));
  };
  const auto command = [&](const v1::Command& given) { return cluster->apply(given); };

  expect(command({}), kInvalid, "a command of no known kind");
  v1::Command nobody;
  nobody.mutable_remove();
  expect(command(nobody), kInvalid, "an id or a name must be set");
  expect(command(removal_of_all("")), kInvalid, "prefix must not be empty");
  expect(command(removal_of_all("bat")), absl::StatusCode::kNotFound, "begins with 'bat'");
  expect(command(velocity(99, 1)), absl::StatusCode::kNotFound, "id 99");
  expect(command(velocity(2, kNan)), kInvalid, "body 'ball': linear velocity x = nan must be finite");
  expect(command(velocity(2, 2 * kSpeedMax)), kInvalid, "must be at most 1e+06 m/s");
  expect(command(velocity(1, 1)), kInvalid, "body 'floor': it is static");
  v1::Command spin = velocity(2, 0);
  *spin.mutable_set_velocity()->mutable_angular() = xyz(0, 0, 2 * kAngularSpeedMax);
  expect(command(spin), kInvalid, "angular velocity");

  v1::Command impulse;
  impulse.mutable_apply_impulse()->mutable_body()->set_name("ball");
  *impulse.mutable_apply_impulse()->mutable_impulse() = xyz(0, 2 * kImpulseMax, 0);
  expect(command(impulse), kInvalid, "impulse");
  *impulse.mutable_apply_impulse()->mutable_impulse() = xyz(0, 1, 0);
  *impulse.mutable_apply_impulse()->mutable_lever() = xyz(0, 0, kNan);
  expect(command(impulse), kInvalid, "lever z = nan");
  impulse.mutable_apply_impulse()->mutable_body()->set_name("lift");
  expect(command(impulse), kInvalid, "it is kinematic, and must be dynamic");
  impulse.mutable_apply_impulse()->mutable_body()->set_name("nobody");
  expect(command(impulse), absl::StatusCode::kNotFound, "'nobody'");

  v1::Command force;
  force.mutable_apply_force()->mutable_body()->set_id(2);
  *force.mutable_apply_force()->mutable_force() = xyz(2 * kForceMax, 0, 0);
  expect(command(force), kInvalid, "force");
  *force.mutable_apply_force()->mutable_force() = xyz(0, 0, 0);
  *force.mutable_apply_force()->mutable_torque() = xyz(std::numeric_limits<double>::infinity(), 0, 0);
  expect(command(force), kInvalid, "torque x = inf");

  v1::Command nowhere;
  nowhere.mutable_teleport()->mutable_body()->set_id(2);
  expect(command(nowhere), kInvalid, "pose must be set");
  constexpr std::int64_t kEnd = std::numeric_limits<std::int64_t>::max();
  const WorldPose outside{{{kEnd, 0, 0}, {1000, 0, 0}}, Eigen::Quaterniond::Identity()};
  expect(command(teleport("ball", outside)), absl::StatusCode::kOutOfRange, "");
  const WorldPose crooked{{{}, {0, 0, 0}}, Eigen::Quaterniond(2, 0, 0, 0)};
  expect(command(teleport("ball", crooked)), kInvalid, "quaternion");
  const WorldPose not_a_place{{{}, {0, kNan, 0}}, Eigen::Quaterniond::Identity()};
  expect(command(teleport("ball", not_a_place)), kInvalid, "pose y = nan");

  v1::Command target;
  target.mutable_set_kinematic_target()->mutable_body()->set_name("ball");
  *target.mutable_set_kinematic_target()->mutable_pose() = to_proto(WorldPose{});
  expect(command(target), kInvalid, "it is dynamic, and must be kinematic");

  v1::Command belt;
  belt.mutable_set_surface_motion()->mutable_body()->set_name("ball");
  *belt.mutable_set_surface_motion()->mutable_velocity() = xyz(0, 2 * kSurfaceSpeedMax, 0);
  expect(command(belt), kInvalid, "surface velocity");
  *belt.mutable_set_surface_motion()->mutable_velocity() = xyz(0, 1, 0);
  *belt.mutable_set_surface_motion()->mutable_running() = xyz(kNan, 0, 0);
  expect(command(belt), kInvalid, "running surface x = nan");

  const auto spawned = [&](const v1::Command& given) { return cluster->apply(given); };
  expect(spawned(spawn("ball", 0.5)), absl::StatusCode::kAlreadyExists, "'ball'");
  expect(spawned(spawn("new", -1)), kInvalid, "radius");
  expect(spawned(spawn("new", 60)), kInvalid, "sector size");
  expect(spawned(spawn_of({})), kInvalid, "model: it must have a body");
  v1::Command massless = spawn("new", 0.6);
  massless.mutable_spawn()->mutable_model()->mutable_bodies(0)->mutable_properties()->set_mass(0);
  expect(spawned(massless), kInvalid, "mass");
  v1::Command shapeless = spawn("new", 0.6);
  shapeless.mutable_spawn()->mutable_model()->mutable_bodies(0)->mutable_properties()->set_shape(77);
  expect(spawned(shapeless), kInvalid, "shape");
  expect(spawned(spawn(std::string(kNameBytesMax + 1, 'n'), 0.6)), kInvalid, "bytes");

  expect(cluster->step(kStepTicksMax + 1), kInvalid, "ticks = 1000000001");

  EXPECT_EQ(cluster->status().bodies(), 4u);
  EXPECT_TRUE(cluster->inbox[kFirst].empty());
  ASSERT_TRUE(cluster->apply(spawn("new", 0.9))->ok());
  cluster->step(1);
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].new_shapes_size(), 1);  // the refused ones left no shape behind
  const auto commands = commands_of(grants);
  ASSERT_EQ(commands.at(1).size(), 1u);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[0]).record.properties.shape, 2u);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[0]).record.id, BodyId{5});
}

v1::Command change(const std::string& body) {
  v1::Command command;
  command.mutable_set_properties()->mutable_body()->set_name(body);
  return command;
}

TEST(Properties, ThatAreNotNamedStay) {
  const auto cluster = loaded_cluster();
  v1::Command first = change("egg");
  v1::SetProperties& properties = *first.mutable_set_properties();
  properties.set_mass(7);
  *properties.mutable_inertia() = xyz(1, 2, 2.5);
  properties.set_friction(0);
  properties.set_mask(6);
  properties.set_gravity(false);
  v1::Command second = change("egg");
  second.mutable_set_properties()->set_restitution(0.25);
  second.mutable_set_properties()->set_angular_damping(0.5);
  ASSERT_TRUE(cluster->apply({first, second})->ok());
  cluster->step(1);
  const auto commands = commands_of(cluster->work(kFirst));
  const SetProperties& last = std::get<SetProperties>(commands.at(1).at(1));
  EXPECT_EQ(last.id, BodyId{4});
  EXPECT_EQ(last.properties.mass, 7);
  EXPECT_EQ(last.properties.inertia, (std::array<double, 3>{1, 2, 2.5}));
  EXPECT_EQ(last.properties.friction, 0);
  EXPECT_EQ(last.properties.restitution, 0.25);
  EXPECT_EQ(last.properties.angular_damping, 0.5);
  EXPECT_EQ(last.properties.linear_damping, 0);
  EXPECT_EQ(last.properties.mask, 6u);
  EXPECT_EQ(last.properties.category, 1u);
  EXPECT_FALSE(last.properties.gravity);
  EXPECT_EQ(last.properties.motion, Motion::kDynamic);
  EXPECT_EQ(last.properties.centre[0], 0.25);
  v1::FindBodies find;
  find.add_ids(4);
  EXPECT_EQ(cluster->find_bodies(find).bodies(0).properties().mass(), 7);
}

// What a body may be told depends on it; what joints it holds are told of it.
TEST(Properties, TheMotionOfABodyChanges) {
  WorldRegistry registry = registry_of(small_world());
  const auto give = [&](const std::vector<v1::Command>& list) {
    return tessera::give(request_of(list).commands(), registry, 1).status();
  };
  v1::Command motion = change("lift");
  motion.mutable_set_properties()->set_motion(v1::MOTION_DYNAMIC);
  ASSERT_TRUE(give({hinge("arm", "lift", "egg"), motion, push("lift")}).ok());
  EXPECT_EQ(registry.joints().find(JointId{1})->record.parent_motion, Motion::kDynamic);
  motion.mutable_set_properties()->set_motion(v1::MOTION_KINEMATIC);
  ASSERT_TRUE(give({motion}).ok());
  EXPECT_EQ(registry.joints().find(JointId{1})->record.parent_motion, Motion::kKinematic);
  EXPECT_THAT(std::string(give({push("lift")}).message()), HasSubstr("it is kinematic"));
  motion.mutable_set_properties()->mutable_body()->set_name("egg");
  const absl::Status child = give({motion});
  EXPECT_EQ(child.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(child.message()),
              HasSubstr("body 'egg': it must be dynamic, for it is the child of the joint 'arm'"));
}

TEST(Properties, AreRefusedWithTheBound) {
  const auto cluster = loaded_cluster();
  const auto expect = [&](const v1::Command& command, absl::StatusCode code, const char* words) {
    const auto heard = cluster->apply(command);
    EXPECT_EQ(heard->code(), code) << heard->message();
    EXPECT_THAT(heard->message(), HasSubstr(words));
  };
  expect(change("nobody"), absl::StatusCode::kNotFound, "'nobody'");
  const auto with = [](const auto& set) {
    v1::Command command = change("ball");
    set(*command.mutable_set_properties());
    return command;
  };
  using Change = v1::SetProperties;
  for (const double mass : {0.0, -1.0, 2 * kMassMax, kNan})
    expect(with([&](Change& to) { to.set_mass(mass); }), kInvalid, "body 'ball': mass = ");
  expect(with([](Change& to) { *to.mutable_inertia() = xyz(1, 1, 3); }), kInvalid, "triangle inequality");
  expect(with([](Change& to) { *to.mutable_inertia() = xyz(1, 0, 1); }), kInvalid, "moment of inertia 1");
  expect(with([](Change& to) { to.set_friction(-1); }), kInvalid, "friction = -1");
  expect(with([](Change& to) { to.set_restitution(1.5); }), kInvalid, "restitution = 1.5");
  expect(with([](Change& to) { to.set_linear_damping(2); }), kInvalid, "linear damping = 2");
  expect(with([](Change& to) { to.set_angular_damping(kNan); }), kInvalid, "angular damping = nan");
  expect(with([](Change& to) { to.set_motion(static_cast<v1::Motion>(9)); }), kInvalid, "motion");
  expect(with([](Change& to) { to.set_motion(v1::MOTION_STATIC); }), kInvalid, "nothing becomes static");
  v1::Command floor = change("floor");
  floor.mutable_set_properties()->set_motion(v1::MOTION_DYNAMIC);
  expect(floor, kInvalid, "body 'floor': what is static stays so");
  EXPECT_TRUE(cluster->apply(with([](Change&) {}))->ok()) << "nothing changes";
}

v1::Command blast(double radius, double impulse) {
  v1::Command command;
  v1::ApplyRadialImpulse& radial = *command.mutable_apply_radial_impulse();
  *radial.mutable_centre() = to_proto(WorldPosition{{1, 0, 0}, {70, 0, 0}});
  radial.set_radius(radius);
  radial.set_impulse(impulse);
  return command;
}

TEST(RadialImpulses, GoToTheServersWithACanonicalCentre) {
  const auto cluster = loaded_cluster();
  v1::Command masked = blast(kRadialSectorsMax * 100, -kImpulseMax);
  masked.mutable_apply_radial_impulse()->set_mask(6);
  ASSERT_TRUE(cluster->apply({blast(5, 3), masked})->ok());
  cluster->step(1);
  const auto commands = commands_of(cluster->work(kFirst)).at(1);
  const auto& all = std::get<ApplyRadialImpulse>(commands.at(0));
  EXPECT_EQ(all.sector, (SectorIndex{2, 0, 0}));
  EXPECT_EQ(all.centre, (std::array<double, 3>{-30, 0, 0}));
  EXPECT_EQ(all.radius, 5);
  EXPECT_EQ(all.impulse, 3);
  EXPECT_EQ(all.mask, 0xffffffffu);
  EXPECT_EQ(std::get<ApplyRadialImpulse>(commands.at(1)).mask, 6u);
}

TEST(RadialImpulses, AreRefusedWithTheBound) {
  const auto cluster = loaded_cluster();
  const auto expect = [&](const v1::Command& command, absl::StatusCode code, const char* words) {
    const auto heard = cluster->apply(command);
    EXPECT_EQ(heard->code(), code) << heard->message();
    EXPECT_THAT(heard->message(), HasSubstr(words));
  };
  for (const double radius : {-1.0, kRadialSectorsMax * 100 + 1, kNan})
    expect(blast(radius, 1), kInvalid, "radius = ");
  for (const double impulse : {2 * kImpulseMax, -2 * kImpulseMax, kNan})
    expect(blast(1, impulse), kInvalid, "impulse = ");
  v1::Command nowhere = blast(1, 1);
  nowhere.mutable_apply_radial_impulse()->clear_centre();
  expect(nowhere, kInvalid, "centre must be set");
  nowhere.mutable_apply_radial_impulse()->mutable_centre()->mutable_local()->set_y(kNan);
  expect(nowhere, kInvalid, "centre");
  nowhere = blast(1, 1);
  nowhere.mutable_apply_radial_impulse()->mutable_centre()->mutable_sector()->set_i(
      std::numeric_limits<std::int64_t>::max());
  expect(nowhere, absl::StatusCode::kOutOfRange, "centre");
}

}  // namespace
}  // namespace tessera
