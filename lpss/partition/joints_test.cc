// What a server knows of joints: the records of those whose children live there, and ties of what these, and
// its other bodies, hang together with.
#include "lpss/partition/joints.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/partition/moved_sector.h"
#include "lpss/partition/test_moved_sector.h"
#include "lpss/partition/test_partition.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

JointRecord joint_between(std::uint64_t id, std::uint64_t parent, std::uint64_t child) {
  JointRecord record;
  record.id = JointId{id};
  record.properties.type = JointType::kRevolute;
  record.properties.parent = BodyId{parent};
  record.properties.child = BodyId{child};
  record.parent_motion = parent == 0 ? Motion::kStatic : Motion::kDynamic;
  return record;
}

JointRecord that_follows(JointRecord record, std::uint64_t leader) {
  record.properties.axes[0].mimic.leader = JointId{leader};
  return record;
}

std::vector<std::uint64_t> ties(const Partition& partition) {
  std::vector<std::uint64_t> ids;
  partition.joints.for_each([&](const JointTie& tie) { ids.push_back(tie.id.value); });
  return ids;
}

std::vector<std::uint64_t> records(const Partition& partition) {
  std::vector<std::uint64_t> ids;
  partition.joints.for_each([&](const JointTie& tie) {
    if (partition.joints.record(tie.id) != nullptr) ids.push_back(tie.id.value);
  });
  return ids;
}

// Bodies 1 and 2 live at the first server, 3, 4 and 5 at the second.
class TwoServers {
 public:
  explicit TwoServers(const WorldSettings& settings = test_settings())
      : low_(settings, 2, 0), high_(settings, 2, 1) {
    for (TestPartition* partition : {&low_, &high_}) {
      for (const std::uint64_t id : {1, 2})
        add_body(**partition, box(id, kLow, Eigen::Vector3d(2 * id, 0, 0)));
      for (const std::uint64_t id : {3, 4, 5})
        add_body(**partition, box(id, kHigh, Eigen::Vector3d(2 * id - 14, 0, 0)));
    }
  }

  void load(const std::vector<JointRecord>& joints) {
    for (TestPartition* partition : {&low_, &high_}) add_joints(**partition, joints);
    check();
  }

  void remove(std::uint64_t joint) {
    for (TestPartition* partition : {&low_, &high_}) remove_joint(**partition, JointId{joint});
    check();
  }

  // A body of the first server goes to the second.
  void move_up(std::uint64_t id) {
    const BodyJoints joints = joints_of(low(), BodyId{id});
    BodyRecord record = remove_home(low(), body(low(), id));
    record.home = kHigh;
    take_joints(high(), joints);
    add_home(high(), record);
    review_joints(low());
    review_joints(high());
    check();
  }

  void check() {
    for (TestPartition* partition : {&low_, &high_}) check_invariants(**partition);
  }

  Partition& low() { return *low_; }
  Partition& high() { return *high_; }

 private:
  TestPartition low_;
  TestPartition high_;
};

TEST(KnownJoints, AreThoseOfBodiesThatLiveHere) {
  TwoServers world;
  world.load(
      {joint_between(1, 1, 2), joint_between(2, 2, 3), joint_between(3, 3, 4), joint_between(4, 0, 5)});
  EXPECT_THAT(ties(world.low()), ElementsAre(1, 2));
  EXPECT_THAT(records(world.low()), ElementsAre(1));
  EXPECT_THAT(ties(world.high()), ElementsAre(2, 3, 4));
  EXPECT_THAT(records(world.high()), ElementsAre(2, 3, 4));
}

TEST(KnownJoints, AreThoseThatAreCoupledWithRecordsHere) {
  TwoServers world;
  world.load({that_follows(joint_between(1, 0, 1), 2), joint_between(2, 0, 3), joint_between(3, 0, 4),
              that_follows(joint_between(4, 0, 5), 3)});
  EXPECT_THAT(ties(world.low()), ElementsAre(1, 2));
  EXPECT_THAT(records(world.low()), ElementsAre(1));
  EXPECT_THAT(ties(world.high()), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(records(world.high()), ElementsAre(2, 3, 4));
  std::vector<std::uint64_t> tied;
  const auto note = [&](BodyId body) { tied.push_back(body.value); };
  for_each_tied(world.low().joints, *world.low().joints.find(JointId{1}), BodyId{1}, note);
  EXPECT_THAT(tied, ElementsAre(0, 3));
}

TEST(KnownJoints, ARecordMovesWithItsChild) {
  TwoServers world;
  world.load({joint_between(1, 1, 2), that_follows(joint_between(2, 0, 2), 3), joint_between(3, 0, 4)});
  const JointDrives drives{JointDrive{DriveMode::kVelocity, 3}, {}};
  set_drives(world.low(), JointId{1}, drives);
  set_drives(world.high(), JointId{1}, drives);
  world.move_up(2);
  EXPECT_THAT(ties(world.low()), ElementsAre(1)) << "the parent still lives here";
  EXPECT_THAT(records(world.low()), IsEmpty());
  EXPECT_TRUE(body(world.low(), 1).jointed);
  EXPECT_THAT(records(world.high()), ElementsAre(1, 2, 3));
  EXPECT_EQ(world.high().joints.record(JointId{1})->drives, drives);
  EXPECT_THAT(world.high().joints.coupled(JointId{2}), ElementsAre(JointId{3}));
  world.move_up(1);
  EXPECT_THAT(ties(world.low()), IsEmpty());
  EXPECT_TRUE(world.low().joints.empty());
}

TEST(KnownJoints, ARemovedLeaderIsForgottenByWhatFollowed) {
  TwoServers world;
  world.load({that_follows(joint_between(1, 0, 1), 3), that_follows(joint_between(2, 0, 5), 3),
              joint_between(3, 0, 3)});
  remove_joints_of(world.low(), BodyId{3});
  remove_joints_of(world.high(), BodyId{3});
  world.check();
  EXPECT_THAT(ties(world.low()), ElementsAre(1));
  EXPECT_FALSE(world.low().joints.record(JointId{1})->properties.axes[0].mimic.is_set());
  EXPECT_FALSE(world.high().joints.record(JointId{2})->properties.axes[0].mimic.is_set());
  EXPECT_THAT(world.low().joints.coupled(JointId{1}), IsEmpty());
}

TEST(KnownJoints, AFollowerThatIsRemovedLeavesNoTieBehind) {
  TwoServers world;
  world.load({that_follows(joint_between(1, 0, 1), 2), joint_between(2, 0, 3)});
  world.remove(1);
  EXPECT_THAT(ties(world.low()), IsEmpty());
  EXPECT_THAT(ties(world.high()), ElementsAre(2));
}

TEST(KnownJoints, ANewOneComesWithThoseThatItFollows) {
  TwoServers world;
  const JointRecord leader = joint_between(1, 0, 3);
  world.load({leader, joint_between(2, 0, 4)});
  const JointRecord follower = that_follows(joint_between(3, 0, 1), 1);
  const std::vector<JointTie> leaders{tie_of(leader)};
  add_joint(world.low(), follower, leaders);
  add_joint(world.high(), follower, leaders);
  world.check();
  EXPECT_THAT(ties(world.low()), ElementsAre(1, 3));
  EXPECT_THAT(ties(world.high()), ElementsAre(1, 2, 3));
  EXPECT_THAT(world.high().joints.coupled(JointId{1}), ElementsAre(JointId{3}));
}

TEST(KnownJoints, ASectorThatChangesServersTakesThemAlong) {
  TwoServers world;
  world.load({joint_between(1, 1, 2), joint_between(2, 2, 3), that_follows(joint_between(3, 0, 1), 4),
              joint_between(4, 0, 5)});
  const MovedSector moved = pack_sector(world.low(), sector(world.low(), kLow));
  forget_sector(world.low(), sector(world.low(), kLow));
  review_joints(world.low());
  EXPECT_TRUE(world.low().joints.empty());
  TestPartition taker;
  unpack_sector(*taker, moved);
  check_invariants(*taker);
  expect_equal(pack_sector(*taker, sector(*taker, kLow)), moved);
  EXPECT_THAT(ties(*taker), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(records(*taker), ElementsAre(1, 3));
}

// Clones collide with each other there, wherever they are.
TEST(KnownJoints, AreAllThatThereAreUnderThePolicyClone) {
  TwoServers world(clone_settings(2));
  world.load({joint_between(1, 1, 2), joint_between(2, 3, 4), joint_between(3, 0, 5)});
  EXPECT_THAT(ties(world.low()), ElementsAre(1, 2, 3));
  EXPECT_THAT(records(world.low()), ElementsAre(1));
  EXPECT_THAT(ties(world.high()), ElementsAre(1, 2, 3));
  world.move_up(2);
  EXPECT_THAT(ties(world.low()), ElementsAre(1, 2, 3));
  EXPECT_THAT(records(world.low()), IsEmpty());
  world.remove(1);
  EXPECT_THAT(ties(world.low()), ElementsAre(2, 3));
}

}  // namespace
}  // namespace tessera
