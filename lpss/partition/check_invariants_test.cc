// A partition that contradicts itself stops the process, and says how.
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "lpss/partition/joints.h"
#include "lpss/partition/replicas.h"
#include "lpss/partition/sectors.h"
#include "lpss/partition/test_partition.h"

namespace tessera {
namespace {

// Two bodies in kLow, one of which leaves, one in kHigh, and in kLow a clone of it.
void furnish(Partition& partition) {
  add_body(partition, box(1, kLow, {0, 0, 0}));
  add_body(partition, box(2, kLow, {4, 0, 0}));
  const BodyRecord other = box(3, kHigh, {-7, 0, 0});
  add_body(partition, other);
  body(partition, 2).next_home = kHigh;
  partition.leaving = {BodyId{2}};
  Replica& replica = introduce(partition, {other.id, other.properties});
  ReplicaUpdate update{other.id, kHigh, kHigh, {}, other.state};
  update.replicated_in.insert(-1, 0, 0);
  revise(replica, update);
  list_clones(partition, replica);
  place_clone(partition, *sector(partition, kLow).clones.at(other.id));
}

struct Breach {
  std::string message;
  std::function<void(Partition&)> commit;
};

JointRecord joint_of(std::uint64_t child) {
  JointRecord joint;
  joint.id = JointId{1};
  joint.properties.type = JointType::kRevolute;
  joint.properties.child = BodyId{child};
  return joint;
}

const Breach kBreaches[] = {
    {"a sector is found under its index",
     [](Partition& p) {
       sector(p, kLow).index = {5, 5, 5};
     }},
    {"a partition has only sectors that the map gives to it",
     [](Partition& p) { p.map = SectorMap(kHigh, {kHigh}, 2); }},
    {"a sector without bodies and clones is gone",
     [](Partition& p) {
       sector_at(p, {5, 5, 5});
     }},
    {"a sector in which a body lives has an engine world",
     [](Partition& p) { sector(p, kHigh).world.reset(); }},
    {"an active sector is on the list", [](Partition& p) { sector(p, kLow).active = false; }},
    {"an active sector is on the list", [](Partition& p) { p.active.clear(); }},
    {"a sector is active once", [](Partition& p) { p.active.push_back(p.active.front()); }},
    {"in the order of their ids",
     [](Partition& p) { std::swap(sector(p, kLow).homes[0], sector(p, kLow).homes[1]); }},
    {"a sector lists bodies of its partition",
     [](Partition& p) { p.bodies.extract(BodyId{1}).mapped().release(); }},
    {"a body knows the sector that lists it", [](Partition& p) { body(p, 1).sector = &sector(p, kHigh); }},
    {"a body knows whether joints hold it", [](Partition& p) { body(p, 1).jointed = true; }},
    {"a partition lists bodies with joints", [](Partition& p) { p.jointed.insert(BodyId{1}); }},
    {"the record of a joint is where its child lives",
     [](Partition& p) {
       p.joints.add(tie_of(joint_of(9)));
       p.joints.keep(joint_of(9));
     }},
    {"a joint is known where a body of it lives", [](Partition& p) { p.joints.add(tie_of(joint_of(9))); }},
    {"what a joint follows is known with it",
     [](Partition& p) {
       JointRecord follower = joint_of(1);
       follower.properties.axes[0].mimic.leader = JointId{2};
       add_joint(p, follower);
     }},
    {"each body lives in one sector", [](Partition& p) { sector(p, kLow).homes.pop_back(); }},
    {"a body that changes home is listed as leaving", [](Partition& p) { p.leaving.clear(); }},
    {"a body that changes home is listed as leaving", [](Partition& p) { body(p, 2).next_home.reset(); }},
    {"a body leaves once", [](Partition& p) { p.leaving.push_back(BodyId{2}); }},
    {"a body that leaves lives here", [](Partition& p) { p.leaving.push_back(BodyId{9}); }},
    {"a clone copies a replica of its partition",
     [](Partition& p) { sector(p, kLow).clones.at(BodyId{3})->replica = nullptr; }},
    {"a clone knows the sector that lists it",
     [](Partition& p) { sector(p, kLow).clones.at(BodyId{3})->sector = &sector(p, kHigh); }},
    {"a replica has the clones that sectors list",
     [](Partition& p) {
       Replica& replica = *p.replicas.at(BodyId{3});
       replica.clones.push_back(std::make_unique<Clone>(*replica.clones.front()));
     }},
    {"a replica is found under its id", [](Partition& p) { p.replicas.at(BodyId{3})->id = BodyId{4}; }},
    {"a replica that moves is known", [](Partition& p) { p.moving_replicas.push_back(BodyId{9}); }},
    {"a sector lists the clones in its engine world", [](Partition& p) { sector(p, kLow).placed.clear(); }},
    {"a partition counts its engine worlds", [](Partition& p) { ++p.world_count; }},
};

TEST(CheckInvariants, HoldOfAPartitionThatTheFunctionsBesideItMade) {
  TestPartition partition;
  check_invariants(*partition);
  furnish(*partition);
  check_invariants(*partition);
}

TEST(CheckInvariantsDeathTest, EachContradictionStopsTheProcess) {
  for (const Breach& breach : kBreaches) {
    TestPartition partition;
    furnish(*partition);
    const auto break_and_check = [&] {
      breach.commit(*partition);
      check_invariants(*partition);
    };
    EXPECT_DEATH(break_and_check(), breach.message);
  }
}

}  // namespace
}  // namespace tessera
