// All that lasts of a world from one tick to the next, apart from who hosts what: any number of partitions
// goes on from it with the same bits.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "lpss/partition/moved_sector.h"
#include "lpss/partition/partition.h"
#include "lpss/partition/replicas.h"

namespace tessera {

// A replica that all partitions have, because a joint leads from it to a body anywhere.
struct KnownReplica {
  ReplicaIntroduction introduction;
  ReplicaUpdate update;
};

// What all partitions of a world know alike, shapes and settings excepted.
struct SharedState {
  double radius_max = 0;            // m, of the largest body that can move that the world has ever had
  bool at_rest = false;             // nothing in the whole world moves
  std::vector<BodyRecord> statics;  // ascending by ids
  std::vector<JointTie> joints;     // of all of them where all partitions know them (joints.h); likewise
  std::vector<KnownReplica> known_replicas;  // likewise
  std::vector<Command> acts;                 // what programs do at the beginning of the next tick
  std::vector<CarriedFrame> carried;         // as Partition::carried
};

// Between ticks. The same from every partition of a world.
SharedState shared_state(const Partition& partition);

// Of that, what no command tells, but only what partitions have heard of each other.
SharedState lately_heard(const Partition& partition);
// Of a partition that has the rest, and hosts nothing.
void hear(Partition& partition, const SharedState& state);

// Ascending by ids.
std::vector<ShapeEntry> shapes_of(const Partition& partition);

// Calls `visit` for the sectors of a partition with their parts of islands, in ascending order: one at a
// time, since all together may be many times as large as those that are packed.
void for_each_sector(const Partition& partition, const std::function<void(MovedSector)>& visit);

// All of them.
std::vector<MovedSector> pack_sectors(const Partition& partition);

// Fills a new partition, which has the world's shapes, with the state and with those of `sectors` that it
// hosts. Sectors that the next tick does not look at have no components yet: see resume_components().
void restore(Partition& partition, const SharedState& state, std::span<const MovedSector> sectors);

}  // namespace tessera
