// Commands, events and queries give the same in one partition as in several.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>

#include "lpss/observe/queries.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"
#include "lpss/tick/events.h"

namespace tessera {
namespace {

using Ids = std::pair<std::uint64_t, std::uint64_t>;

// Where a body is, m from the anchor's centre.
Eigen::Vector3d place(const PartitionCluster& cluster, BodyId id, double size) {
  const absl::StatusOr<BodyRecord> record = cluster.body(id);
  EXPECT_TRUE(record.ok()) << record.status();
  return metres_between({}, record->home, size) + Eigen::Vector3d(record->state.position.data());
}

TEST(Commands, EveryKindGivesTheSameBitsOnOneShareAndOnThree) {
  const WorldDescription world = pile_world(sectors_of(16), 60);
  BodyRecord spawned = records_of(world)->at(1);
  spawned.id = BodyId{1000};
  spawned.state.position[2] += 6;
  const auto commands_at = [&](int tick) -> std::vector<Command> {
    switch (tick) {
      case 20:
        return {SpawnBody{spawned}, ApplyImpulse{BodyId{1000}, {2, 1, 0}, {0.1, 0, 0}}};
      case 40:
        return {RemoveBody{BodyId{7}}, SetVelocity{BodyId{9}, {3, 0, 4}, {0, 0, 1}}};
      case 60: {
        BodyState state;
        state.position = {7.5, -7.9, 3};
        return {Teleport{BodyId{12}, {2, 0, 0}, state}, ApplyForce{BodyId{13}, Wrench{{0, 0, 500}, {}}}};
      }
      case 80:
        return {RemoveBody{BodyId{1}}};  // the floor
      default:
        return {};
    }
  };
  auto one = cluster_of(world, 1);
  auto three = cluster_of(world, 3);
  for (int tick = 0; tick < 160; ++tick) {
    one->step(commands_at(tick));
    three->step(commands_at(tick));
    ASSERT_EQ(one->hash(), three->hash()) << "tick " << tick;
  }
  EXPECT_FALSE(one->body(BodyId{7}).ok());
  EXPECT_TRUE(one->body(BodyId{1000}).ok());
}

// A box whose centre of mass is 0.3 m from the origin of its frame, along a principal axis.
WorldDescription lopsided_box() {
  WorldBuilder builder(sectors_of(8));
  builder.world().settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  BodyDescription& box = builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {0, 0, 0});
  box.properties.centre = {0.3, 0, 0};
  box.properties.principal_axes = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};
  box.pose.orientation = Eigen::AngleAxisd(std::acos(-1) / 2, Eigen::Vector3d::UnitZ());
  box.linear_velocity = {1, 2, 3};
  return builder.world();
}

TEST(Commands, ATeleportLeavesWhatItKeepsAsItIs) {
  const WorldDescription world = lopsided_box();
  for (const std::uint32_t partitions : {1u, 3u}) {
    auto cluster = cluster_of(world, partitions);
    const BodyState before = cluster->body(BodyId{1})->state;
    Teleport jump{BodyId{1}, {5, 0, 0}, {}};
    jump.state.position = {1, 3.9,
                           0};  // of the body frame; the centre is 0.3 m farther along y, beyond the border
    jump.state.angular_velocity = {0, 0, 0.5};
    jump.keeps_rotation = jump.keeps_linear_velocity = true;
    const std::vector<Command> commands{jump};
    cluster->step(commands);
    const BodyRecord after = cluster->body(BodyId{1}).value();
    EXPECT_EQ(after.home, (SectorIndex{5, 1, 0}));
    EXPECT_EQ(after.state.linear_velocity, before.linear_velocity);
    EXPECT_NEAR(after.state.angular_velocity[2], 0.5, 1e-2);
    EXPECT_NEAR(after.state.position[1], -3.8 + 2.0 / 60, 1e-5);
    EXPECT_LT(quaternion_of(after.state).angularDistance(quaternion_of(before)), 0.5 / 60 + 1e-6);
  }
}

// No tick of the way is lost where the body changes home.
TEST(Commands, ForcesAndTargetsCarryBodiesOverBorders) {
  WorldBuilder builder(sectors_of(4));
  builder.world().settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  const auto ball = builder.shape(Sphere{0.5});
  builder.add("rocket", ball, 1, {0, 0, 0});
  builder.add("lift", ball, 1, {0, 10, 0}).properties.motion = Motion::kKinematic;
  for (const std::uint32_t partitions : {1u, 3u}) {
    auto cluster = cluster_of(builder.world(), partitions);
    for (int tick = 1; tick <= 60; ++tick) {
      KinematicTarget target{BodyId{2}, {}, {}, true};
      target.state.position = {0.2 * tick, 10, 0};
      const std::vector<Command> commands{ApplyForce{BodyId{1}, Wrench{{30, 0, 0}, {}}}, target};
      cluster->step(commands);
      ASSERT_NEAR(place(*cluster, BodyId{2}, 4).x(), 0.2 * tick, 1e-6) << "tick " << tick;
    }
    EXPECT_NEAR(cluster->body(BodyId{1})->state.linear_velocity[0], 30, 1e-4);
    cluster->step();
    EXPECT_NEAR(place(*cluster, BodyId{2}, 4).x(), 12, 1e-6) << "it stays where it was sent";
  }
}

// The same bits as a force that is given anew in each tick, until it ends.
TEST(Commands, ALastingForceActsInEachTick) {
  WorldBuilder builder(sectors_of(4));
  const auto ball = builder.shape(Sphere{0.5});
  builder.add("floor", builder.shape(Plane{}), 0, {0, 0, 0}).properties.motion = Motion::kStatic;
  builder.add("rocket", ball, 1, {0, 0, 0.5});
  builder.add("struck", ball, 1, {7, 0.2, 0.5});
  builder.add("pushed", ball, 1, {0, 6, 0.5}).properties.lasting = LastingForce{{{0, 3, 0}, {0, 0.1, 0}}};
  WorldDescription described = builder.world();
  described.bodies[3].properties.lasting.reset();
  const Wrench thrust{{8, 1, 2}, {0, 0, 0.5}};
  for (const std::uint32_t partitions : {1u, 3u}) {
    auto lasting = cluster_of(builder.world(), partitions);
    auto each = cluster_of(described, partitions);
    for (int tick = 0; tick < 240; ++tick) {
      std::vector<Command> once;
      std::vector<Command> again{ApplyForce{BodyId{4}, {{0, 3, 0}, {0, 0.1, 0}}}};
      if (tick == 10) once = {SetForce{BodyId{2}, LastingForce{thrust}}};
      if (tick == 150) once = {SetForce{BodyId{2}, {}}};
      if (tick >= 10 && tick < 150) again.push_back(ApplyForce{BodyId{2}, thrust});
      lasting->step(once);
      each->step(again);
      ASSERT_EQ(lasting->hash(), each->hash()) << "tick " << tick << " on " << partitions;
    }
    EXPECT_GT(place(*lasting, BodyId{2}, 4).x(), 8);
  }
}

// Turns with the body: v = F / (m w) (sin wt, 1 - cos wt), of a body that turns at w.
TEST(Commands, AThrusterTurnsWithItsBody) {
  WorldDescription world = lopsided_box();
  world.settings.time_step = 1.0 / 240;
  BodyDescription& box = world.bodies[0];
  box.linear_velocity.setZero();
  box.angular_velocity = {0, 0, 2};
  box.properties.lasting = LastingForce{{{0, -3, 0}, {}}, /*turns_along=*/true};  // of the turned frame: x
  auto cluster = cluster_of(world, 2);
  for (int tick = 0; tick < 240; ++tick) cluster->step();
  const BodyState after = cluster->body(BodyId{1})->state;
  EXPECT_NEAR(after.linear_velocity[0], 1.5 * std::sin(2), 0.02);
  EXPECT_NEAR(after.linear_velocity[1], 1.5 * (1 - std::cos(2)), 0.02);
  EXPECT_EQ(after.linear_velocity[2], 0);
}

// What leans on a wall, asleep, goes on once the wall is gone.
TEST(Commands, ALastingForceLastsWhileItsBodySleeps) {
  WorldBuilder builder(sectors_of(16));
  builder.add("floor", builder.shape(Plane{}), 0, {0, 0, 0}).properties.motion = Motion::kStatic;
  builder.add("wall", builder.shape(Box{{1, 4, 4}}), 0, {1, 0, 2}).properties.motion = Motion::kStatic;
  BodyDescription& box = builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {0, 0, 0.5});
  box.properties.lasting = LastingForce{{{20, 0, 0}, {}}};
  for (const std::uint32_t partitions : {1u, 2u}) {
    auto cluster = cluster_of(builder.world(), partitions);
    for (int tick = 0; tick < 400; ++tick) cluster->step();  // long enough to be packed
    EXPECT_EQ(cluster->body(BodyId{3})->state.activity, Activity::kAsleep);
    const std::vector<Command> opened{RemoveBody{BodyId{2}}};
    cluster->step(opened);
    for (int tick = 1; tick < 60; ++tick) cluster->step();
    EXPECT_NEAR(cluster->body(BodyId{3})->state.linear_velocity[0], 20 - 0.5 * 9.81, 0.05);
  }
}

// A body that is moved a little, with the impulses of its contacts or without.
TEST(Commands, ContactsAreKeptWhereABodyIsPlacedAnew) {
  WorldBuilder builder(sectors_of(16));
  const auto cube = builder.shape(Box{{1, 1, 1}});
  builder.add("floor", builder.shape(Plane{}), 0, {0, 0, 0}).properties.motion = Motion::kStatic;
  for (int n = 0; n < 6; ++n) builder.add("box", cube, 1, {7.5, 0, 0.5 + n}).name += std::to_string(n);
  const auto hash_after = [&](std::uint32_t partitions, const std::optional<bool>& keeps) {
    auto cluster = cluster_of(builder.world(), partitions);
    for (int tick = 0; tick < 20; ++tick) cluster->step();
    std::vector<Command> commands;
    if (keeps) {
      const BodyRecord low = cluster->body(BodyId{3}).value();
      Teleport jump{low.id, low.home, low.state};
      jump.keeps_contacts = *keeps;
      commands = {jump};
    }
    cluster->step(commands);
    return cluster->hash();
  };
  const auto untouched = hash_after(1, std::nullopt);
  EXPECT_EQ(hash_after(1, true), untouched) << "to where it is";
  EXPECT_EQ(hash_after(3, true), untouched);
  EXPECT_NE(hash_after(1, false), untouched) << "a tower takes some ticks to bear its weight again";
  EXPECT_EQ(hash_after(3, false), hash_after(1, false));
}

TEST(Commands, AKinematicTargetWithoutARotationKeepsIt) {
  WorldDescription world = lopsided_box();
  world.bodies[0].properties.motion = Motion::kKinematic;
  world.bodies[0].linear_velocity.setZero();
  auto cluster = cluster_of(world, 2);
  const BodyState before = cluster->body(BodyId{1})->state;
  KinematicTarget target{BodyId{1}, {}, {}, true};
  target.state.position = {0.1, 0, 0};
  const std::vector<Command> commands{target};
  cluster->step(commands);
  const BodyState after = cluster->body(BodyId{1})->state;
  EXPECT_LT(quaternion_of(after).angularDistance(quaternion_of(before)), 1e-6);
  EXPECT_NEAR(after.position[0], 0.1, 1e-6);
  EXPECT_NEAR(after.position[1], 0.3, 1e-6);
}

TEST(Commands, AJointMayHoldABodyFromTheTickOfItsTeleportOn) {
  WorldBuilder builder(sectors_of(4));
  const auto ball = builder.shape(Sphere{0.5});
  builder.add("high", ball, 1, {0, 0, 0});
  builder.add("low", ball, 1, {20, 0, 0});
  BodyState state;
  state.position = {0, 0, 2};
  JointRecord joint;
  joint.id = JointId{1};
  joint.properties.type = JointType::kBall;
  joint.properties.parent = BodyId{1};
  joint.properties.child = BodyId{2};
  joint.properties.in_parent.position = {0, 0, -1};
  joint.properties.in_child.position = {0, 0, 1};
  joint.parent_motion = Motion::kDynamic;
  const std::vector<Command> commands{Teleport{BodyId{2}, {0, 0, -1}, state}, AddJoint{joint},
                                      ApplyImpulse{BodyId{2}, {3, 0, 0}, {}}};
  auto one = cluster_of(builder.world(), 1);
  auto three = cluster_of(builder.world(), 3);
  for (int tick = 0; tick < 60; ++tick) {
    one->step(tick == 5 ? commands : std::vector<Command>());
    three->step(tick == 5 ? commands : std::vector<Command>());
    ASSERT_EQ(one->hash(), three->hash()) << "tick " << tick;
    if (tick < 5) continue;
    ASSERT_NEAR((place(*one, BodyId{1}, 4) - place(*one, BodyId{2}, 4)).norm(), 2, 0.02) << "tick " << tick;
  }
}

// No coordinate of the place is a float: the clones of the tick must not be nearer to it than the body
// itself.
TEST(Commands, ATeleportIntoOthersAcrossSeamsGivesTheSameBitsOnOnePartitionAndOnThree) {
  const WorldDescription world = pile_world(sectors_of(8), 40);
  BodyState state;
  state.position = {3.2135660283676728, -3.6648533471311309, -1.827331013592072};
  const Command jump = Teleport{BodyId{10}, {0, 1, 1}, state};
  auto one = cluster_of(world, 1);
  auto three = cluster_of(world, 3);
  for (int tick = 1; tick <= 15; ++tick) {
    const std::vector<Command> commands(tick == 12 ? 1 : 0, jump);
    one->step(commands);
    three->step(commands);
    ASSERT_EQ(one->hash(), three->hash()) << "tick " << tick;
    if (tick == 12) {
      EXPECT_EQ(three->counts().islands_shipped, 1u);
    }
  }
}

// A floor, and on it what commands change: piles over borders, a hinge whose parent is one of them, and, far
// away, a tower of which all is packed.
WorldDescription changing_world() {
  WorldDescription world = pile_world(sectors_of(4), 60);
  WorldBuilder builder(world.settings);
  builder.world() = world;
  const ShapeId cube = builder.shape(Box{{0.5, 0.5, 0.5}});
  for (int n = 0; n < 3; ++n) builder.add("far" + std::to_string(n), cube, 1, {18.2, 0, 0.5 * n + 1.25});
  builder.add("post", cube, 1, {7.7, 7, 1.25});
  builder.add("door", cube, 1, {8.7, 7, 1.25});
  builder.tie("hinge", JointType::kRevolute, "post", "door", {8.2, 7, 1.25}, {0, 1, 0});
  return builder.world();
}

BodyId id_of(const WorldDescription& world, const std::string& name) {
  for (std::size_t n = 0; n < world.bodies.size(); ++n) {
    if (world.bodies[n].name == name) return BodyId{n + 1};
  }
  ADD_FAILURE() << name;
  return {};
}

std::vector<Command> changes_at(const WorldDescription& world, int tick) {
  const std::vector<BodyRecord> records = *records_of(world);
  const auto changed = [&](BodyId id, const auto& change) -> Command {
    SetProperties command{id, records.at(id.value - 1).properties};
    change(command.properties);
    return command;
  };
  switch (tick) {
    case 40:
      return {changed(BodyId{7}, [](BodyProperties& p) { p.mass *= 8; }),
              changed(BodyId{12}, [](BodyProperties& p) { p.motion = Motion::kKinematic; }),
              changed(id_of(world, "post"), [](BodyProperties& p) { p.motion = Motion::kKinematic; })};
    case 60:
      return {ApplyRadialImpulse{{0, 0, 0}, {2, 2.25, 1}, 6, 12}};
    case 80:
      return {changed(BodyId{1}, [](BodyProperties& p) { p.friction = 0.01; })};  // the floor
    case 100:
      return {changed(BodyId{12}, [](BodyProperties& p) { p.gravity = false; }),
              changed(id_of(world, "post"), [](BodyProperties&) {}),
              ApplyImpulse{id_of(world, "post"), {3, 1, 2}, {}}};
    case 120:
      return {SetVelocity{id_of(world, "post"), {-30, 20, 10}, {}}};
    case 400:
      return {ApplyRadialImpulse{{4, 0, 0}, {1, 0, 1}, 3, -2}};  // what sleeps
    case 420:
      return {changed(BodyId{1}, [](BodyProperties& p) { p.mask = 0; })};  // all falls through
    default:
      break;
  }
  // As it passes over borders, too.
  if (tick < 120 || tick > 160) return {};
  return {changed(id_of(world, "post"), [&](BodyProperties& p) {
    p.motion = tick % 3 == 0 ? Motion::kKinematic : Motion::kDynamic;
  })};
}

struct RunOfChanges {
  std::uint32_t partitions = 1;
  std::uint64_t shuffle = 0;
  bool packs = false;
  bool all_linked = true;
  SeamPolicy seams = SeamPolicy::kIsland;
};

std::vector<WorldHash> hashes_of(const RunOfChanges& run) {
  WorldDescription world = changing_world();
  world.settings.sleep_after = 0.1;
  world.settings.shuffle = run.shuffle;
  world.settings.seams = run.seams;
  auto cluster = cluster_of(world, run.partitions);
  for (Rank rank = 0; rank < run.partitions; ++rank) {
    if (run.packs) cluster->partition(rank).pack_after = 1;
    if (!run.all_linked) cluster->partition(rank).all_linked_max = 1;
  }
  std::vector<WorldHash> hashes;
  for (int tick = 0; tick < 460; ++tick) {
    std::size_t packed = 0;
    for (Rank rank = 0; rank < run.partitions; ++rank)
      packed += cluster->partition(rank).packed.counts().bodies;
    if (tick == 400 && run.packs) {
      EXPECT_GE(packed, 3u) << "the tower is far from all else";
    }
    cluster->step(changes_at(world, tick));
    for (Rank rank = 0; rank < run.partitions; ++rank) check_invariants(cluster->partition(rank));
    hashes.push_back(cluster->hash());
  }
  return hashes;
}

TEST(Commands, PropertiesAndRadialImpulsesGiveTheSameBitsOnAnyNumberOfPartitions) {
  const std::vector<WorldHash> one = hashes_of({});
  for (const RunOfChanges& run :
       {RunOfChanges{.packs = true}, RunOfChanges{.partitions = 2, .packs = true},
        RunOfChanges{.partitions = 4}, RunOfChanges{.partitions = 4, .all_linked = false},
        RunOfChanges{.partitions = 4, .shuffle = 3, .packs = true}}) {
    EXPECT_EQ(first_difference(one, hashes_of(run)), one.size())
        << run.partitions << " partitions, shuffle " << run.shuffle << ", packs " << run.packs
        << ", all linked " << run.all_linked;
  }
  EXPECT_EQ(first_difference(hashes_of({.seams = SeamPolicy::kClone}),
                             hashes_of({.partitions = 3, .seams = SeamPolicy::kClone})),
            one.size());
}

TEST(Commands, ABodyInTheAirFallsOnceItFeelsGravityAndRestsOnceItIsHeavy) {
  WorldBuilder builder(sectors_of(8));
  builder.add_floor(20, 0);
  builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {0, 0, 3}).properties.gravity = false;
  builder.add("light", builder.shape(Sphere{0.5}), 1, {5, 0, 0.5});
  auto cluster = cluster_of(builder.world(), 2);
  for (int tick = 0; tick < 100; ++tick) cluster->step();
  EXPECT_EQ(place(*cluster, BodyId{2}, 8).z(), 3);
  SetProperties fall{BodyId{2}, cluster->body(BodyId{2})->properties};
  fall.properties.gravity = true;
  SetProperties heavy{BodyId{3}, cluster->body(BodyId{3})->properties};
  heavy.properties.mass = 100;
  cluster->step(std::vector<Command>{fall, heavy, ApplyImpulse{BodyId{3}, {0, 0, 100}, {}}});
  EXPECT_NEAR(cluster->body(BodyId{3})->state.linear_velocity[2], 1, 0.2) << "100 N s on 100 kg";
  for (int tick = 1; tick < 30; ++tick) cluster->step();
  EXPECT_NEAR(place(*cluster, BodyId{2}, 8).z(), 3 - 9.81 / 2 * 0.25, 0.1) << "half a second of fall";
}

TEST(Commands, ABodyWhoseSupportIsTakenAwayWakesAndFalls) {
  WorldBuilder builder(sectors_of(8));
  builder.add_floor(20, 0);
  builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {0, 0, 0.5});
  auto cluster = cluster_of(builder.world(), 1);
  for (int tick = 0; tick < 200; ++tick) cluster->step();
  ASSERT_EQ(cluster->counts().bodies_awake, 0u);
  const std::vector<Command> remove_floor{RemoveBody{BodyId{1}}};
  cluster->step(remove_floor);
  for (int tick = 0; tick < 60; ++tick) cluster->step();
  EXPECT_LT(place(*cluster, BodyId{2}, 8).z(), -3);
}

TEST(Sleep, AStackAcrossASeamSleepsAndIsWokenFromTheOtherSide) {
  for (const std::uint32_t partitions : {1u, 2u}) {
    auto cluster = cluster_of(tower_world(sectors_of(4), 6, {0, 0, -1}), partitions);
    int tick = 0;
    for (; tick < 1200 && (tick == 0 || cluster->counts().bodies_awake > 0); ++tick) cluster->step();
    ASSERT_LT(tick, 1200) << "the stack never came to rest";
    cluster->step();
    cluster->step();
    EXPECT_EQ(cluster->counts().sectors_awake, 0u) << "at rest, nothing is stepped";
    const std::vector<Command> push{ApplyImpulse{BodyId{7}, {6, 0, 0}, {}}};  // the topmost box
    cluster->step(push);
    cluster->step();
    EXPECT_GT(cluster->counts().bodies_awake, 3u) << "the whole island wakes, beyond the seam too";
  }
}

TEST(Kinematics, APusherMovesABoxAcrossASeamAlikeOnAnyNumberOfPartitions) {
  WorldBuilder builder(sectors_of(8));
  builder.add_floor(30, -2);
  builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {2, 0, -1.5});
  builder.add("pusher", builder.shape(Box{{0.5, 3, 1}}), 1, {1, 0, -1.4}, Motion::kKinematic)
      .linear_velocity = {1, 0, 0};
  auto one = cluster_of(builder.world(), 1);
  auto two = cluster_of(builder.world(), 2);
  for (int tick = 0; tick < 300; ++tick) {
    one->step();
    two->step();
    ASSERT_EQ(one->hash(), two->hash()) << "tick " << tick;
  }
  EXPECT_NEAR(place(*one, BodyId{3}, 8).x(), 6, 0.01);
  EXPECT_GT(place(*one, BodyId{2}, 8).x(), 6.5);
}

// Begin and end of every contact alternate, and persist comes between; so nothing is reported twice or
// missed.
TEST(Events, EachContactIsReportedOnce) {
  for (const SeamPolicy policy : {SeamPolicy::kIsland, SeamPolicy::kClone}) {
    WorldSettings settings = sectors_of(8);
    settings.seams = policy;
    std::vector<std::vector<Ids>> begun(2);
    for (const std::uint32_t partitions : {1u, 3u}) {
      auto cluster = cluster_of(pile_world(settings, 40), partitions);
      for (Rank rank = 0; rank < partitions; ++rank) report_contacts(cluster->partition(rank), true);
      std::set<Ids> open;
      for (int tick = 0; tick < 150; ++tick) {
        cluster->step();
        std::set<Ids> seen;
        for (Rank rank = 0; rank < partitions; ++rank) {
          for (const ContactEvent& event : cluster->machine(rank).contact_events()) {
            const Ids ids{event.a.value, event.b.value};
            EXPECT_LT(ids.first, ids.second);
            if (!seen.insert(ids).second) {
              EXPECT_NE(event.phase, ContactPhase::kEnd) << "twice in tick " << tick;
              continue;  // another patch
            }
            EXPECT_EQ(event.phase == ContactPhase::kBegin, !open.contains(ids)) << "tick " << tick;
            if (event.phase == ContactPhase::kBegin) begun[partitions > 1].push_back(ids);
            if (event.phase == ContactPhase::kEnd) {
              open.erase(ids);
            } else {
              open.insert(ids);
            }
          }
        }
      }
      EXPECT_FALSE(open.empty());
    }
    for (auto& list : begun) std::sort(list.begin(), list.end());
    EXPECT_EQ(begun[0], begun[1]);
  }
}

TEST(Raycast, FindsTheNearestBodyThroughManySectorsInAnyPartition) {
  WorldBuilder builder(sectors_of(8));
  builder.add_floor(40, -2);
  builder.add("near", builder.shape(Sphere{0.5}), 1, {20, 0, 1});
  builder.add("far", builder.shape(Sphere{0.5}), 1, {30, 0, 1});
  for (const std::uint32_t partitions : {1u, 2u}) {
    auto cluster = cluster_of(builder.world(), partitions);
    const auto cast = [&](const Eigen::Vector3d& direction, double length) {
      std::optional<RayAnswer> nearest;
      for (Rank rank = 0; rank < partitions; ++rank) {
        const auto answer = raycast(cluster->partition(rank), {{}, {0, 0, 1}}, direction, length, ~0u);
        if (answer && (!nearest || answer->distance < nearest->distance)) nearest = answer;
      }
      return nearest;
    };
    const auto ahead = cast({1, 0, 0}, 100);
    ASSERT_TRUE(ahead.has_value());
    EXPECT_EQ(ahead->body, BodyId{2});
    EXPECT_NEAR(ahead->distance, 19.5, 1e-4);
    EXPECT_NEAR(ahead->normal.x(), -1, 1e-4);
    const auto down = cast({0, 0, -1}, 100);
    ASSERT_TRUE(down.has_value());
    EXPECT_EQ(down->body, BodyId{1}) << "static bodies count";
    EXPECT_NEAR(down->distance, 3, 1e-4);
    EXPECT_FALSE(cast({0, 0, 1}, 100).has_value());
    EXPECT_FALSE(cast({1, 0, 0}, 15).has_value()) << "the ray ends before it";
  }
}

TEST(Near, FindsShapesAcrossSectorsWithTheSameDistancesInAnyPartitions) {
  WorldBuilder builder(sectors_of(8));
  builder.add_floor(40, -2);
  builder.add("ball", builder.shape(Sphere{0.5}), 1, {5, 0, 1});
  builder.add("box", builder.shape(Box{{1, 1, 1}}), 1, {-6, 0, 1});
  builder.add("can", builder.shape(Cylinder{0.5, 2}), 1, {0, 9, 1});
  using Pairs = std::vector<std::pair<std::uint64_t, double>>;
  const auto look = [&](std::uint32_t partitions, const Geometry& probe, const Eigen::Vector3d& at,
                        double reach) {
    auto cluster = cluster_of(builder.world(), partitions);
    Pairs found;
    for (Rank rank = 0; rank < partitions; ++rank) {
      for (const NearBody& near : bodies_near(cluster->partition(rank), probe,
                                              {{{}, at}, Eigen::Quaterniond::Identity()}, reach, ~0u)) {
        found.push_back({near.body.value, near.distance});
      }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end(), [](auto& a, auto& b) { return a.first == b.first; }),
                found.end());
    return found;
  };
  const Pairs one = look(1, Sphere{0.1}, {0, 0, 1}, 20);
  ASSERT_EQ(one.size(), 4u);
  const double expected[] = {2.9, 4.4, 5.4, 8.4};  // floor, ball, box, can
  for (std::size_t n = 0; n < 4; ++n)
    EXPECT_NEAR(one[n].second, expected[n], 2e-3) << "body " << one[n].first;
  EXPECT_EQ(one, look(3, Sphere{0.1}, {0, 0, 1}, 20));
  const Pairs overlapping = look(2, Box{{20, 1, 0.5}}, {0, 0, 1}, 0);
  ASSERT_EQ(overlapping.size(), 2u);
  EXPECT_EQ(overlapping[0], (std::pair<std::uint64_t, double>(2, 0)));
  EXPECT_EQ(overlapping[1], (std::pair<std::uint64_t, double>(3, 0)));
}

TEST(Edges, ABodyAtTheLastSectorStopsThere) {
  WorldDescription world = tower_world(sectors_of(8), 1, {0, 0, -1});
  world.bodies[1].linear_velocity = {200, 0, 50};
  constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
  ASSERT_TRUE(move_by(world, {kLast - 3, 0, 0}).ok());
  auto cluster = cluster_of(world, 2);
  std::uint64_t stopped = 0;
  for (int tick = 0; tick < 60; ++tick) {
    cluster->step();
    stopped += cluster->counts().diverged;
    if (cluster->body(BodyId{2})->home.i < kLast) continue;
    const auto restored = PartitionCluster::restore(cluster->snapshot(), 1);
    ASSERT_TRUE(restored.ok()) << "tick " << tick << ": " << restored.status();
    EXPECT_EQ((*restored)->hash(), cluster->hash()) << "tick " << tick;
  }
  EXPECT_GT(stopped, 0u);
  EXPECT_EQ(cluster->body(BodyId{2})->home.i, kLast);
}

}  // namespace
}  // namespace tessera
