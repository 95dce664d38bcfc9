// A sector that changes servers takes all that its server keeps of it along.
#include "lpss/partition/moved_sector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/partition/replicas.h"
#include "lpss/partition/sectors.h"
#include "lpss/partition/test_moved_sector.h"
#include "lpss/partition/test_partition.h"

namespace tessera {
namespace {

using testing::IsEmpty;

// A sector with something of everything: contacts (one of them with a clone), sleepers, a body that leaves,
// one with a target, and a replica that has no clone.
void fill(Partition& partition) {
  add_body(partition, moving(box(1, kLow, {0, 0, 0}), {1, 2, 3}));
  add_body(partition, in_state(box(2, kLow, {0.984375, 0, 0}), Activity::kWantsSleep));
  add_body(partition, in_state(box(3, kLow, {0, 5, 0}, Motion::kKinematic), Activity::kAsleep));
  add_body(partition, box(4, kLow, kBeforeBorder));
  body(partition, 1).next_home = kHigh;
  body(partition, 1).replicated_in.insert(1, 0, 0);
  partition.leaving.push_back(BodyId{1});
  body(partition, 2).dirty = false;
  body(partition, 3).known_everywhere = true;
  body(partition, 3).kinematic_target = box(3, kLow, {0, 6, 0}).state;
  for (const std::uint64_t id : {5, 6}) {
    const BodyRecord other = box(id, kHigh, kBehindBorder + Eigen::Vector3d(0, id == 5 ? 0 : 4, 0));
    Replica& replica = introduce(partition, {other.id, other.properties});
    ReplicaUpdate update{other.id, kHigh, id == 5 ? kHigh : kLow, {}, other.state};
    update.replicated_in.insert(-1, 0, 0);
    revise(replica, update);
    list_clones(partition, replica);
    if (id == 6) partition.moving_replicas.push_back(replica.id);
  }
  Sector& low = sector(partition, kLow);
  place_clone(partition, *low.clones.at(BodyId{5}));
  low.clones.at(BodyId{5})->fresh = false;
  low.world->detect(partition.dt());
  low.touching = {{BodyId{1}, BodyId{2}}, {BodyId{4}, BodyId{5}}};
  low.parts_reported = true;
  low.static_region.extend(Eigen::Vector3d(20, 0, 0));
}

TEST(MovedSector, IsAtTheNewServerWhatItWasAtTheOldOne) {
  TestPartition giver;
  fill(*giver);
  check_invariants(*giver);
  const MovedSector moved = pack_sector(*giver, sector(*giver, kLow));
  EXPECT_EQ(moved.bodies.size(), 4u);
  EXPECT_EQ(moved.clones.size(), 2u);
  EXPECT_EQ(moved.manifolds.size(), 2u);

  TestPartition taker;
  unpack_sector(*taker, moved);
  expect_equal(pack_sector(*taker, sector(*taker, kLow)), moved);
  check_invariants(*taker);
  EXPECT_THAT(taker->leaving, testing::ElementsAre(BodyId{1}));
  EXPECT_THAT(taker->moving_replicas, testing::ElementsAre(BodyId{6}));
  EXPECT_EQ(sector(*taker, kLow).placed.size(), 1u);
}

TEST(MovedSector, LeavesNothingBehindThatOnlyItNeeded) {
  TestPartition giver;
  fill(*giver);
  add_body(*giver, box(7, kHigh, {0, 0, 0}));
  forget_sector(*giver, sector(*giver, kLow));
  check_invariants(*giver);
  EXPECT_EQ(giver->bodies.size(), 1u);
  EXPECT_EQ(giver->sectors.size(), 1u);
  EXPECT_EQ(giver->world_count, 1u);
  EXPECT_THAT(giver->replicas, IsEmpty());
  EXPECT_THAT(giver->leaving, IsEmpty());
  EXPECT_THAT(giver->moving_replicas, IsEmpty());
}

}  // namespace
}  // namespace tessera
