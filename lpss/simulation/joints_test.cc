// Joints and changes of authority: neither may notice a border, a server or a change of either.
#include <absl/strings/str_cat.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"

namespace tessera {
namespace {

// Where a body is, in metres from the centre of the anchor's sector.
Eigen::Vector3d place(const PartitionCluster& cluster, const WorldDescription& world, std::uint64_t id) {
  const BodyRecord record = *cluster.body(BodyId{id});
  return metres_between(world.anchor, record.home, world.settings.sector_size) +
         Eigen::Vector3d(record.state.position.data());
}

WorldDescription with_shuffle(WorldDescription world, std::uint64_t seed) {
  world.settings.shuffle = seed;
  return world;
}

std::size_t records_of_joints(PartitionCluster& cluster) {
  std::size_t sum = 0;
  for (Rank rank = 0; rank < cluster.size(); ++rank) sum += cluster.partition(rank).joints.records();
  return sum;
}

const JointRecord& record_of(PartitionCluster& cluster, JointId id) {
  Rank rank = 0;
  while (cluster.partition(rank).joints.record(id) == nullptr) ++rank;
  return *cluster.partition(rank).joints.record(id);
}

TEST(Joints, AChainOverManySectorsSwingsAsInOne) {
  const WorldDescription small = chain_world(sectors_of(2), 10, {0.3, 0.2, 0.4});
  const WorldDescription large = chain_world(sectors_of(128), 10, {0.3, 0.2, 0.4});
  auto over_seams = cluster_of(small, 1);
  auto in_one = cluster_of(large, 1);
  std::uint64_t across = 0;
  for (int t = 0; t < 60; ++t) {
    over_seams->step();
    in_one->step();
    across = std::max(across, over_seams->counts().islands_across_seams);
  }
  EXPECT_EQ(across, 1u);
  for (std::uint64_t id = 1; id <= 10; ++id) {
    EXPECT_LT((place(*over_seams, small, id) - place(*in_one, large, id)).norm(), 1e-4) << "link " << id;
  }
}

TEST(Joints, AChainIsTheSameOnAnyNumberOfPartitions) {
  const WorldDescription world = chain_world(sectors_of(2), 20, {0.3, 0.2, 0.4});
  const std::vector<WorldHash> one = run(world, 1, 1, 300);
  EXPECT_EQ(first_difference(one, run(world, 2, 1, 300)), 300u);
  EXPECT_EQ(first_difference(one, run(world, 4, 1, 300)), 300u);
}

TEST(Joints, ALongChainComesToRestAndSleepsAsOne) {
  WorldDescription world = chain_world(sectors_of(2), 4, {0.3, 0.2, 0.4});
  for (BodyDescription& body : world.bodies)
    body.properties.linear_damping = body.properties.angular_damping = 0.9;
  auto cluster = cluster_of(world, 2);
  int t = 0;
  while (t < 3000 && (t == 0 || cluster->counts().bodies_awake > 0)) {
    cluster->step();
    ++t;
  }
  EXPECT_LT(t, 3000);
  // What wakes one link wakes the others.
  const std::vector<Command> push{ApplyImpulse{BodyId{4}, {0.5, 0, 0}, {}}};
  cluster->step(push);
  cluster->step();
  EXPECT_EQ(cluster->counts().bodies_awake, 4u);
}

TEST(Joints, CommandsAddDriveAndRemoveThemInEveryPartition) {
  WorldDescription world = chain_world(sectors_of(2), 4, {0.3, 0.2, 0.4});
  JointRecord weld = (*joint_records_of(world))[0];
  std::vector<std::vector<WorldHash>> runs;
  for (const std::uint32_t partitions : {1u, 3u}) {
    auto cluster = cluster_of(world, partitions);
    std::vector<WorldHash> hashes;
    for (int t = 0; t < 120; ++t) {
      std::vector<Command> commands;
      if (t == 20) commands.push_back(RemoveJoint{JointId{3}});
      if (t == 40) {
        JointRecord joint = weld;
        joint.id = JointId{5};
        joint.properties.type = JointType::kRevolute;
        commands.push_back(AddJoint{joint});
      }
      if (t == 60) commands.push_back(SetDrives{JointId{5}, {JointDrive{DriveMode::kVelocity, 2}, {}}});
      if (t == 80) commands.push_back(RemoveBody{BodyId{2}});
      cluster->step(commands);
      hashes.push_back(cluster->hash());
    }
    EXPECT_EQ(records_of_joints(*cluster), 3u);
    runs.push_back(std::move(hashes));
  }
  EXPECT_EQ(first_difference(runs[0], runs[1]), 120u);
}

// Two arms that no body connects: each swings on a spring and lives in sectors of its own. One follows the
// other, which a servo moves.
WorldDescription followers_world() {
  WorldBuilder builder(sectors_of(4));
  const ShapeId arm = builder.shape(Box{{2, 0.2, 0.2}});
  for (const auto& [name, x] : {std::pair{"leader", -9.0}, std::pair{"follower", 9.0}}) {
    const std::string near = absl::StrCat(name, "_near");
    const std::string far = absl::StrCat(name, "_far");
    builder.add(near, arm, 2, {x + 1, 0, 0});
    builder.add(far, arm, 1, {x + 3.1, 0, 0});
    builder.tie(absl::StrCat(name, "_shoulder"), JointType::kRevolute, "", near, {x, 0, 0},
                Eigen::Vector3d::UnitY());
    JointAxis& elbow = builder
                           .tie(absl::StrCat(name, "_elbow"), JointType::kRevolute, near, far,
                                {x + 2.05, 0, 0}, Eigen::Vector3d::UnitY())
                           .properties.axes[0];
    elbow.spring_stiffness = 40;
    elbow.spring_reference = 0.3;
    elbow.damping = 0.2;
  }
  WorldDescription world = builder.world();
  world.joints[0].drives[0] = {DriveMode::kServo, -0.4, 300, 30};
  world.joints[2].properties.axes[0].mimic = {JointId{1}, 0, -0.5, 0.1, 0.05};
  return world;
}

TEST(Joints, WhatFollowsIsTheSameOnAnyNumberOfPartitions) {
  const WorldDescription world = followers_world();
  const std::vector<WorldHash> one = run(world, 1, 1, 240);
  EXPECT_EQ(first_difference(one, run(world, 2, 1, 240)), 240u);
  EXPECT_EQ(first_difference(one, run(world, 3, 1, 240)), 240u);
  EXPECT_EQ(first_difference(one, run(with_shuffle(world, 7), 3, 1, 240)), 240u);
}

TEST(Joints, WhatFollowsMovesUntilItsLeaderIsRemoved) {
  const WorldDescription world = followers_world();
  std::vector<std::vector<WorldHash>> runs;
  for (const std::uint32_t partitions : {1u, 3u}) {
    auto cluster = cluster_of(world, partitions);
    std::vector<WorldHash> hashes;
    for (int t = 0; t < 120; ++t) {
      std::vector<Command> commands;
      if (t == 60) commands.push_back(RemoveJoint{JointId{1}});
      cluster->step(commands);
      hashes.push_back(cluster->hash());
      EXPECT_EQ(record_of(*cluster, JointId{3}).properties.axes[0].mimic.is_set(), t < 60);
    }
    runs.push_back(std::move(hashes));
  }
  EXPECT_EQ(first_difference(runs[0], runs[1]), 120u);
}

// Trains of jointed boxes, three abreast, roll over the borders of many sectors; what follows something does
// so from train to train. On the way, joints are driven, added and removed, with a leader and with a body.
WorldDescription trains_world() {
  WorldDescription world;
  WorldBuilder builder(sectors_of(4));
  const ShapeId box = builder.shape(Box{{0.8, 0.4, 0.4}});
  for (int train = 0; train < 3; ++train) {
    for (int n = 0; n < 6; ++n) {
      const std::string name = absl::StrCat("t", train, "_", n);
      const Eigen::Vector3d place{-12 + 1.1 * n, -1 + 3.0 * train, 0.5};
      builder.add(name, box, 1, place).linear_velocity = {6, train == 1 ? 1.0 : 0.0, 0};
      if (n == 0) continue;
      builder.tie(absl::StrCat("j", train, "_", n), JointType::kRevolute,
                  absl::StrCat("t", train, "_", n - 1), name, place - Eigen::Vector3d(0.55, 0, 0),
                  Eigen::Vector3d::UnitZ());
    }
  }
  world = builder.world();
  world.settings.gravity = UniformGravity{Eigen::Vector3d::Zero()};
  // The second and third trains follow the first; the last joint of all follows one of the second.
  for (const int n : {0, 1, 2}) {
    world.joints[5 + n].properties.axes[0].mimic = {JointId{1u + n}, 0, 0.5, 0, 0};
    world.joints[10 + n].properties.axes[0].mimic = {JointId{1u + n}, 0, -0.5, 0, 0};
  }
  world.joints[14].properties.axes[0].mimic = {JointId{7}, 0, 1, 0, 0};
  return world;
}

std::vector<Command> commands_for_trains(const WorldDescription& world, int tick) {
  if (tick == 20) return {SetDrives{JointId{1}, {JointDrive{DriveMode::kServo, 0.4, 200, 20}, {}}}};
  if (tick == 60) return {SetDrives{JointId{2}, {JointDrive{DriveMode::kPosition, -0.3}, {}}}};
  if (tick == 90) return {RemoveJoint{JointId{1}}};
  if (tick == 120) return {RemoveBody{BodyId{4}}};
  if (tick == 140) {
    const JointRecord leader = joint_records_of(world)->at(9);
    JointRecord joint = joint_records_of(world)->at(0);
    joint.id = JointId{16};
    joint.properties.axes[0].mimic = {leader.id, 0, 1, 0, 0};
    return {AddJoint{joint, {tie_of(leader)}}};
  }
  if (tick == 160) return {SetDrives{JointId{10}, {JointDrive{DriveMode::kServo, -0.5, 200, 20}, {}}}};
  return {};
}

TEST(Joints, AreKnownWhereTheirBodiesLiveOnTheirWay) {
  std::vector<std::vector<WorldHash>> runs;
  for (const SeamPolicy seams : {SeamPolicy::kIsland, SeamPolicy::kClone}) {
    for (const std::uint64_t shuffle : {0u, 5u}) {
      for (const std::uint32_t partitions : {1u, 2u, 5u}) {
        WorldDescription world = with_shuffle(trains_world(), partitions == 1 ? 0 : shuffle);
        world.settings.seams = seams;
        auto cluster = cluster_of(world, partitions);
        std::vector<WorldHash> hashes;
        std::size_t most = 0;
        for (int t = 0; t < 240; ++t) {
          cluster->step(commands_for_trains(world, t));
          for (Rank rank = 0; rank < partitions; ++rank) {
            check_invariants(cluster->partition(rank));
            most = std::max(most, cluster->partition(rank).joints.size());
          }
          EXPECT_EQ(records_of_joints(*cluster), t < 90 ? 15u : t < 120 ? 14u : t < 140 ? 12u : 13u);
          hashes.push_back(cluster->hash());
        }
        if (!runs.empty() && partitions > 1) {
          EXPECT_EQ(first_difference(runs.back(), hashes), 240u)
              << partitions << " partitions, shuffle " << shuffle << ", seams " << name_of(seams);
        } else {
          runs.push_back(std::move(hashes));
        }
      }
    }
  }
}

TEST(Joints, AKinematicParentLeadsFromAnySector) {
  WorldBuilder builder(sectors_of(4));
  const ShapeId box = builder.shape(Box{{0.5, 0.5, 0.5}});
  builder.add("leader", box, 1, {1.5, 0, 0}, Motion::kKinematic).linear_velocity = {0.5, 0, 0};
  builder.add("follower", box, 1, {2.5, 0, 0});
  builder.tie("rod", JointType::kFixed, "leader", "follower", {2, 0, 0});
  const WorldDescription world = builder.world();
  auto cluster = cluster_of(world, 3);
  for (int t = 0; t < 600; ++t) cluster->step();
  EXPECT_NEAR(place(*cluster, world, 1).x(), 1.5 + 5, 1e-3);
  EXPECT_NEAR(place(*cluster, world, 2).x(), 2.5 + 5, 1e-2);  // it follows a tick behind
  EXPECT_EQ(first_difference(run(world, 1, 1, 300), run(world, 3, 1, 300)), 300u);
}

TEST(Shuffle, SectorsThatChangeServersAtRandomChangeNoBit) {
  for (const WorldDescription& world :
       {tower_world(sectors_of(4), 10, {0, 0, -1}), chain_world(sectors_of(2), 12, {0.3, 0.2, 0.4}),
        pile_world(sectors_of(8), 80)}) {
    const std::vector<WorldHash> still = run(world, 1, 1, 240);
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      EXPECT_EQ(first_difference(still, run(with_shuffle(world, seed), 3, 1, 240)), 240u) << "seed " << seed;
    }
  }
}

TEST(Rest, AWorldAtRestSaysNothingUntilSomethingIsAsked) {
  auto cluster = cluster_of(tower_world(sectors_of(4), 3, {0, 0, -1}), 2);
  int t = 0;
  while (t < 1000 && (t == 0 || cluster->counts().bodies_awake > 0)) {
    cluster->step();
    ++t;
  }
  ASSERT_LT(t, 1000);
  for (int n = 0; n < 3; ++n) cluster->step();
  EXPECT_FALSE(cluster->machine(0).begin_tick({}).has_value());
  EXPECT_FALSE(cluster->machine(1).begin_tick({}).has_value());
  const WorldHash at_rest = cluster->hash();
  cluster->step(std::vector<Command>{ApplyImpulse{BodyId{3}, {0, 0, 2}, {}}});
  EXPECT_NE(cluster->hash(), at_rest);
}

}  // namespace
}  // namespace tessera
