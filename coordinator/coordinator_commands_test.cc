// Commands and queries: what is refused, and at which tick the rest takes effect.
#include <cmath>
#include <limits>

#include "coordinator/coordinator.h"
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "lpss/model/limits.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

v1::Vector3 xyz(double x, double y, double z) { return to_proto(Eigen::Vector3d(x, y, z)); }

v1::SetVelocityRequest velocity(std::uint64_t id, double x) {
  v1::SetVelocityRequest request;
  request.mutable_body()->set_id(id);
  *request.mutable_linear() = xyz(x, 0, 0);
  return request;
}

v1::TeleportRequest teleport(const std::string& name, const WorldPose& pose) {
  v1::TeleportRequest request;
  request.mutable_body()->set_name(name);
  *request.mutable_pose() = to_proto(pose);
  return request;
}

v1::SpawnRequest spawn(const std::string& name, double radius) {
  BodyDescription body;
  body.name = name;
  v1::SpawnRequest request;
  *request.mutable_body() = to_proto(body);
  *request.mutable_shape() = to_proto(Shape{{{Sphere{radius}, {}}}});
  return request;
}

v1::StepRequest step(std::uint64_t ticks) {
  v1::StepRequest request;
  request.set_ticks(ticks);
  return request;
}

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
  const auto first = cluster->ask<v1::CommandReply>(velocity(2, 1));
  ASSERT_TRUE(first->ok());
  EXPECT_EQ(first->answer.tick(), 1u);
  EXPECT_TRUE(cluster->take_grants(kFirst).empty());
  cluster->ask<v1::StepReply>(step(3));
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  cluster->work(kSecond);
  const auto commands = commands_of(grants);
  ASSERT_EQ(commands.size(), 1u);
  ASSERT_EQ(commands.at(1).size(), 1u);
  EXPECT_EQ(std::get<SetVelocity>(commands.at(1)[0]).linear[0], 1);
  EXPECT_EQ(cluster->ask<v1::CommandReply>(velocity(2, 1))->answer.tick(), 4u);
}

TEST(Commands, WhileRunningAreToldTheirTickWhenItIsGranted) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::ResumeReply>(v1::ResumeRequest());
  std::uint64_t granted = 0;
  const std::vector<v1::Grant> grants = cluster->take_grants(kFirst);
  for (const v1::Grant& grant : grants) granted += grant.ticks();
  EXPECT_EQ(granted, 32u);
  const auto command = cluster->ask<v1::CommandReply>(velocity(2, 1));
  EXPECT_FALSE(command->status);
  cluster->report(kFirst, 1, 8);
  cluster->report(kSecond, 1, 1);  // a window of one tick is open
  ASSERT_TRUE(command->ok());
  EXPECT_EQ(command->answer.tick(), granted + 1);
  EXPECT_EQ(commands_of(cluster->take_grants(kFirst), granted).count(granted + 1), 1u);
}

TEST(Commands, APauseTellsThoseThatWaitTheirTick) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::ResumeReply>(v1::ResumeRequest());
  const auto command = cluster->ask<v1::CommandReply>(velocity(2, 1));
  EXPECT_FALSE(command->status);
  cluster->ask<v1::PauseReply>(v1::PauseRequest());
  ASSERT_TRUE(command->ok());
  EXPECT_EQ(command->answer.tick(), 33u);
}

TEST(Commands, OfABodyThatIsTeleportedDelayNobody) {
  const auto cluster = loaded_cluster();
  for (int n = 0; n < 600; ++n) {
    EXPECT_EQ(cluster->ask<v1::CommandReply>(teleport("ball", {}))->answer.tick(), 1u);
    EXPECT_EQ(cluster->ask<v1::CommandReply>(velocity(2, 3))->answer.tick(), 1u);
  }
  EXPECT_EQ(cluster->ask<v1::CommandReply>(velocity(4, 4))->answer.tick(), 1u);
  cluster->ask<v1::StepReply>(step(10));
  EXPECT_EQ(commands_of(cluster->work(kFirst)).at(1).size(), 1201u);
}

TEST(Commands, TeleportsAreOfTheCentreFrame) {
  const auto cluster = loaded_cluster();
  const WorldPose pose{{{7, 0, 0}, {49.9, 0, 0}}, Eigen::Quaterniond::Identity()};
  ASSERT_TRUE(cluster->ask<v1::CommandReply>(teleport("egg", pose))->ok());
  cluster->ask<v1::StepReply>(step(1));
  const auto commands = commands_of(cluster->work(kFirst));
  const Teleport& jump = std::get<Teleport>(commands.at(1).at(0));
  EXPECT_EQ(jump.home, (SectorIndex{8, 0, 0}));  // 49.9 + 0.25 is behind the border
  EXPECT_NEAR(jump.state.position[0], -49.85, 1e-12);
}

TEST(Commands, TeleportsThatKeepTheOrientationAreOfTheBodyFrame) {
  const auto cluster = loaded_cluster();
  v1::TeleportRequest request = teleport("egg", {{{7, 0, 0}, {49.9, 0, 0}}, Eigen::Quaterniond(0, 0, 0, 0)});
  request.set_keeps_orientation(true);
  request.set_keeps_angular_velocity(true);
  request.mutable_angular_velocity()->set_x(std::nan(""));
  ASSERT_TRUE(cluster->ask<v1::CommandReply>(request)->ok());
  cluster->ask<v1::StepReply>(step(1));
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
  const auto known = cluster->ask<v1::SpawnReply>(spawn("a", 0.5));
  const auto fresh = cluster->ask<v1::SpawnReply>(spawn("b", 0.75));
  const auto again = cluster->ask<v1::SpawnReply>(spawn("", 0.75));
  ASSERT_TRUE(known->ok() && fresh->ok() && again->ok()) << known->message() << fresh->message();
  EXPECT_EQ(known->answer.id(), 5u);
  EXPECT_EQ(fresh->answer.id(), 6u);
  EXPECT_EQ(again->answer.id(), 7u);
  EXPECT_EQ(again->answer.tick(), 1u);
  cluster->ask<v1::StepReply>(step(1));
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].new_shapes_size(), 1);
  const auto commands = commands_of(grants);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[0]).record.properties.shape, 1u);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[1]).record.properties.shape, 2u);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[2]).record.properties.shape, 2u);

  v1::FindBodiesRequest find;
  find.set_name_prefix("body_");
  const auto found = cluster->ask<v1::FindBodiesReply>(find);
  ASSERT_EQ(found->answer.bodies_size(), 1);
  EXPECT_EQ(found->answer.bodies(0).name(), "body_7");
  EXPECT_EQ(cluster->status().bodies(), 7u);
}

TEST(Spawn, ShapesOfAWorldHaveALimitOfBytes) {
  CoordinatorOptions options;
  options.shape_bytes_max = 200;
  const auto cluster = loaded_cluster(options);
  int spawned = 0;
  std::string refusal;
  for (; refusal.empty() && spawned < 100; ++spawned) {
    const auto heard = cluster->ask<v1::SpawnReply>(spawn("", 1.0 + 0.01 * spawned));
    if (heard->code() == absl::StatusCode::kResourceExhausted) refusal = heard->message();
  }
  EXPECT_GT(spawned, 2);
  EXPECT_THAT(refusal, HasSubstr("may have 200 (--shapes-mib)"));
  EXPECT_TRUE(cluster->ask<v1::SpawnReply>(spawn("", 1.0))->ok()) << "a shape that it has needs no room";
}

TEST(Spawn, ShapesGoWithTheLastBodyThatHasThem) {
  CoordinatorOptions options;
  options.shape_bytes_max = 200;
  const auto cluster = loaded_cluster(options);
  for (int n = 0; n < 200; ++n) {
    const auto first = cluster->ask<v1::SpawnReply>(spawn("first", 1.0 + 0.01 * n));
    ASSERT_TRUE(first->ok()) << n << " " << first->message();
    ASSERT_TRUE(cluster->ask<v1::SpawnReply>(spawn("second", 1.0 + 0.01 * n))->ok());
    cluster->ask<v1::StepReply>(step(1));
    const std::vector<v1::Grant> spawned = cluster->work(kFirst);
    cluster->work(kSecond);
    ASSERT_EQ(spawned.at(0).new_shapes_size(), 1);
    const ShapeId shape = spawned[0].new_shapes(0).id();
    EXPECT_EQ(shape, 2u + n) << "ids are never given twice";

    v1::RemoveRequest remove;
    remove.mutable_body()->set_name("first");
    cluster->ask<v1::CommandReply>(remove);
    remove.mutable_body()->set_name("second");
    cluster->ask<v1::CommandReply>(remove);
    cluster->ask<v1::StepReply>(step(1));
    const auto commands = unpack_commands(cluster->work(kFirst).at(0).commands()).value();
    cluster->work(kSecond);
    ASSERT_EQ(commands.size(), 2u);
    EXPECT_EQ(std::get<RemoveBody>(commands[0]).last_of, std::nullopt);
    EXPECT_EQ(std::get<RemoveBody>(commands[1]).last_of, shape);
  }
  v1::SpawnRequest by_id = spawn("late", 1);
  by_id.clear_shape();
  by_id.mutable_body()->mutable_properties()->set_shape(50);
  EXPECT_THAT(cluster->ask<v1::SpawnReply>(by_id)->message(), HasSubstr("there is no shape 50"));
}

TEST(Spawn, RemovedNamesMayBeUsedAgainButNotIds) {
  const auto cluster = loaded_cluster();
  v1::RemoveRequest remove;
  remove.mutable_body()->set_name("ball");
  EXPECT_TRUE(cluster->ask<v1::CommandReply>(remove)->ok());
  EXPECT_EQ(cluster->ask<v1::CommandReply>(remove)->code(), absl::StatusCode::kNotFound);
  const auto heard = cluster->ask<v1::SpawnReply>(spawn("ball", 0.5));
  ASSERT_TRUE(heard->ok());
  EXPECT_EQ(heard->answer.id(), 5u);
}

TEST(FindBodies, ByPrefixAscendingAndCut) {
  const auto cluster = loaded_cluster();
  v1::FindBodiesRequest find;
  auto found = cluster->ask<v1::FindBodiesReply>(find);
  ASSERT_EQ(found->answer.bodies_size(), 4);
  EXPECT_EQ(found->answer.bodies(0).name(), "floor");
  EXPECT_EQ(found->answer.bodies(0).properties().motion(), v1::MOTION_STATIC);
  find.set_limit(2);
  found = cluster->ask<v1::FindBodiesReply>(find);
  EXPECT_EQ(found->answer.bodies_size(), 2);
  EXPECT_TRUE(found->answer.truncated());
  find.set_name_prefix("e");
  found = cluster->ask<v1::FindBodiesReply>(find);
  ASSERT_EQ(found->answer.bodies_size(), 1);
  EXPECT_EQ(found->answer.bodies(0).id(), 4u);
  EXPECT_FALSE(found->answer.truncated());
}

TEST(FindBodies, ByIdAndMotionAndWithShapes) {
  const auto cluster = loaded_cluster();
  v1::FindBodiesRequest find;
  for (const std::uint64_t id : {4, 99, 2, 4}) find.add_ids(id);
  auto found = cluster->ask<v1::FindBodiesReply>(find);
  ASSERT_EQ(found->answer.bodies_size(), 2);
  EXPECT_EQ(found->answer.bodies(0).id(), 2u);
  EXPECT_EQ(found->answer.bodies(1).id(), 4u);
  EXPECT_TRUE(found->answer.shapes().empty());

  find.Clear();
  find.set_only_static(true);
  find.set_with_shapes(true);
  find.set_limit(1);
  found = cluster->ask<v1::FindBodiesReply>(find);
  ASSERT_EQ(found->answer.bodies_size(), 1);
  EXPECT_EQ(found->answer.bodies(0).name(), "floor");
  ASSERT_EQ(found->answer.shapes().size(), 1u);
  EXPECT_EQ(found->answer.shapes().begin()->first, found->answer.bodies(0).properties().shape());
}

// Everything that is refused, with the words that must be in the message; nothing of it changes the world.
TEST(Commands, AreRefusedWithTheFieldAndTheBound) {
  const auto cluster = loaded_cluster();
  const auto expect = [&](const auto& heard, absl::StatusCode code, const char* words) {
    EXPECT_EQ(heard->code(), code) << heard->message();
    EXPECT_THAT(heard->message(), HasSubstr(words));
  };
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  const auto command = [&](const auto& request) { return cluster->template ask<v1::CommandReply>(request); };

  expect(command(v1::RemoveRequest()), kInvalid, "an id or a name must be set");
  expect(command(velocity(99, 1)), absl::StatusCode::kNotFound, "id 99");
  expect(command(velocity(2, kNan)), kInvalid, "body 'ball': linear velocity x = nan must be finite");
  expect(command(velocity(2, 2 * kSpeedMax)), kInvalid, "must be at most 1e+06 m/s");
  expect(command(velocity(1, 1)), kInvalid, "body 'floor': it is static");
  v1::SetVelocityRequest spin = velocity(2, 0);
  *spin.mutable_angular() = xyz(0, 0, 2 * kAngularSpeedMax);
  expect(command(spin), kInvalid, "angular velocity");

  v1::ApplyImpulseRequest impulse;
  impulse.mutable_body()->set_name("ball");
  *impulse.mutable_impulse() = xyz(0, 2 * kImpulseMax, 0);
  expect(command(impulse), kInvalid, "impulse");
  *impulse.mutable_impulse() = xyz(0, 1, 0);
  *impulse.mutable_lever() = xyz(0, 0, kNan);
  expect(command(impulse), kInvalid, "lever z = nan");
  impulse.mutable_body()->set_name("lift");
  expect(command(impulse), kInvalid, "it is kinematic, and must be dynamic");
  impulse.mutable_body()->set_name("nobody");
  expect(command(impulse), absl::StatusCode::kNotFound, "'nobody'");

  v1::ApplyForceRequest force;
  force.mutable_body()->set_id(2);
  *force.mutable_force() = xyz(2 * kForceMax, 0, 0);
  expect(command(force), kInvalid, "force");
  *force.mutable_force() = xyz(0, 0, 0);
  *force.mutable_torque() = xyz(std::numeric_limits<double>::infinity(), 0, 0);
  expect(command(force), kInvalid, "torque x = inf");

  v1::TeleportRequest nowhere;
  nowhere.mutable_body()->set_id(2);
  expect(command(nowhere), kInvalid, "pose must be set");
  constexpr std::int64_t kEnd = std::numeric_limits<std::int64_t>::max();
  const WorldPose outside{{{kEnd, 0, 0}, {1000, 0, 0}}, Eigen::Quaterniond::Identity()};
  expect(command(teleport("ball", outside)), absl::StatusCode::kOutOfRange, "");
  const WorldPose crooked{{{}, {0, 0, 0}}, Eigen::Quaterniond(2, 0, 0, 0)};
  expect(command(teleport("ball", crooked)), kInvalid, "quaternion");
  const WorldPose not_a_place{{{}, {0, kNan, 0}}, Eigen::Quaterniond::Identity()};
  expect(command(teleport("ball", not_a_place)), kInvalid, "pose y = nan");

  v1::KinematicTargetRequest target;
  target.mutable_body()->set_name("ball");
  *target.mutable_pose() = to_proto(WorldPose{});
  expect(command(target), kInvalid, "it is dynamic, and must be kinematic");

  v1::SurfaceMotionRequest belt;
  belt.mutable_body()->set_name("ball");
  *belt.mutable_velocity() = xyz(0, 2 * kSurfaceSpeedMax, 0);
  expect(command(belt), kInvalid, "surface velocity");
  *belt.mutable_velocity() = xyz(0, 1, 0);
  *belt.mutable_running() = xyz(kNan, 0, 0);
  expect(command(belt), kInvalid, "running surface x = nan");

  const auto spawned = [&](const v1::SpawnRequest& request) { return cluster->ask<v1::SpawnReply>(request); };
  expect(spawned(spawn("ball", 0.5)), absl::StatusCode::kAlreadyExists, "'ball'");
  expect(spawned(spawn("new", -1)), kInvalid, "shape of body 'new'");
  expect(spawned(spawn("new", 60)), kInvalid, "sector size");
  expect(spawned(v1::SpawnRequest()), kInvalid, "body must be set");
  v1::SpawnRequest massless = spawn("new", 0.6);
  massless.mutable_body()->mutable_properties()->set_mass(0);
  expect(spawned(massless), kInvalid, "mass");
  v1::SpawnRequest shapeless = spawn("new", 0.6);
  shapeless.clear_shape();
  shapeless.mutable_body()->mutable_properties()->set_shape(77);
  expect(spawned(shapeless), kInvalid, "shape 77");
  expect(spawned(spawn(std::string(kNameBytesMax + 1, 'n'), 0.6)), kInvalid, "bytes");

  expect(cluster->ask<v1::StepReply>(step(0)), kInvalid, "ticks = 0");

  EXPECT_EQ(cluster->status().bodies(), 4u);
  EXPECT_TRUE(cluster->inbox[kFirst].empty());
  ASSERT_TRUE(cluster->ask<v1::SpawnReply>(spawn("new", 0.9))->ok());
  cluster->ask<v1::StepReply>(step(1));
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].new_shapes_size(), 1);  // the refused ones left no shape behind
  const auto commands = commands_of(grants);
  ASSERT_EQ(commands.at(1).size(), 1u);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[0]).record.properties.shape, 2u);
  EXPECT_EQ(std::get<SpawnBody>(commands.at(1)[0]).record.id, BodyId{5});
}

TEST(Steps, AreRefusedWhileTheWorldRuns) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::ResumeReply>(v1::ResumeRequest());
  EXPECT_EQ(cluster->ask<v1::StepReply>(step(1))->code(), absl::StatusCode::kFailedPrecondition);
}

TEST(Queries, HashesAreSummedOverServers) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::StepReply>(step(3));
  cluster->work_all();
  const auto hash = cluster->ask<v1::HashReply>(v1::HashRequest());
  const std::vector<v1::Grant> grants = cluster->work(kFirst);
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(grants[0].ticks(), 0u);
  EXPECT_FALSE(hash->status);
  cluster->work(kSecond);
  ASSERT_TRUE(hash->ok());
  EXPECT_EQ(hash->answer.tick(), 3u);
  WorldHash sum(3, kFirst.value);
  sum.add(WorldHash(3, kSecond.value));
  EXPECT_EQ(hash->answer.hash(), sum.to_string());
}

v1::RaycastRequest ray() {
  v1::RaycastRequest request;
  *request.mutable_origin() = to_proto(WorldPosition{{}, {0, 0, 0}});
  *request.mutable_direction() = xyz(1e-200, 0, 0);
  request.set_length(1000);
  return request;
}

void answer_ray(TestCluster& cluster, NodeId node, std::uint64_t query, std::uint64_t body, double distance) {
  v1::ClusterMessage message;
  message.mutable_answer()->set_world(1);
  message.mutable_answer()->set_query(query);
  message.mutable_answer()->set_hit(body != 0);
  message.mutable_answer()->set_body(body);
  message.mutable_answer()->set_distance(distance);
  cluster.receive(node, message);
}

TEST(Queries, TheNearestHitWinsAndTheSmallestIdAmongEquals) {
  const auto cluster = loaded_cluster();
  const auto far = cluster->ask<v1::RaycastReply>(ray());
  const auto tie = cluster->ask<v1::RaycastReply>(ray());
  const auto miss = cluster->ask<v1::RaycastReply>(ray());
  const std::vector<v1::Grant> grants = cluster->take_grants(kFirst);
  const v1::RayQuery& query = grants.at(0).queries(0).ray();
  EXPECT_DOUBLE_EQ(query.direction().x(), 1);
  EXPECT_EQ(query.mask(), 0xffffffffu);
  answer_ray(*cluster, kFirst, 1, 4, 520);
  answer_ray(*cluster, kSecond, 1, 1, 3);
  answer_ray(*cluster, kFirst, 2, 4, 520);
  answer_ray(*cluster, kSecond, 2, 3, 520);
  answer_ray(*cluster, kFirst, 3, 0, 0);
  answer_ray(*cluster, kSecond, 3, 0, 0);
  ASSERT_TRUE(far->ok() && tie->ok() && miss->ok());
  EXPECT_EQ(far->answer.name(), "floor");
  EXPECT_EQ(far->answer.distance(), 3);
  EXPECT_EQ(tie->answer.body(), 3u);
  EXPECT_EQ(from_proto(tie->answer.position()), (WorldPosition{{5, 0, 0}, {20, 0, 0}}));
  EXPECT_FALSE(miss->answer.hit());
}

TEST(Queries, BadRaysAreRefused) {
  const auto cluster = loaded_cluster();
  const auto expect = [&](const v1::RaycastRequest& request, absl::StatusCode code, const char* words) {
    const auto heard = cluster->ask<v1::RaycastReply>(request);
    EXPECT_EQ(heard->code(), code);
    EXPECT_THAT(heard->message(), HasSubstr(words));
  };
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  v1::RaycastRequest request = ray();
  *request.mutable_direction() = xyz(0, 0, 0);
  expect(request, kInvalid, "direction");
  *request.mutable_direction() = xyz(0, kNan, 0);
  expect(request, kInvalid, "direction y");
  for (const double length : {0.0, -1.0, 2 * kRayLengthMax, kNan}) {
    request = ray();
    request.set_length(length);
    expect(request, kInvalid, "length");
  }
  request = ray();
  request.clear_origin();
  expect(request, kInvalid, "origin");
  request = ray();
  request.mutable_origin()->mutable_sector()->set_i(std::numeric_limits<std::int64_t>::max());
  expect(request, absl::StatusCode::kOutOfRange, "the ray's end");
  EXPECT_TRUE(cluster->inbox[kFirst].empty());
}

TEST(Queries, ARayPassesThroughALimitedNumberOfSectors) {
  WorldDescription world = small_world();
  world.bodies.resize(2);
  world.settings.sector_size = 10;
  const auto cluster = loaded_cluster({}, world);
  v1::RaycastRequest request = ray();
  request.set_length(kRaySectorsMax * 10 + 1);
  const auto refused = cluster->ask<v1::RaycastReply>(request);
  EXPECT_EQ(refused->code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(refused->message(), HasSubstr("at most 655360 m"));
  request.set_length(kRaySectorsMax * 10);
  cluster->ask<v1::RaycastReply>(request);
  EXPECT_EQ(cluster->take_grants(kFirst).at(0).queries_size(), 1);
}

}  // namespace
}  // namespace tessera
