// Replicas: what a partition knows of bodies near its seams, and the clones of them in its engine worlds.
#pragma once

#include "lpss/partition/partition.h"

namespace tessera {

// The properties of a body that the receiver has not heard of yet.
struct ReplicaIntroduction {
  BodyId id;
  BodyProperties properties;
};

// A body near a seam, as of the beginning of the tick. Sent while the body is awake, once more when it has
// fallen asleep, and then not until something changes.
struct ReplicaUpdate {
  BodyId id;
  SectorIndex home;
  SectorIndex next_home;    // where it will live from the next tick on; the home itself if it stays
  OffsetSet replicated_in;  // relative to `home`: the sectors that must have a clone
  BodyState state;          // relative to the centre of `home`
};

// The replica of that body, made if there is none yet.
Replica& introduce(Partition& partition, const ReplicaIntroduction& news);

void revise(Replica& replica, const ReplicaUpdate& update);

// Puts the replica on the lists of the sectors that need it, and off those that no longer do.
void place_replica(Partition& partition, Replica& replica);

// Nothing happens where there is no such replica.
void forget_replica(Partition& partition, BodyId id);

// Wakes what touches clones of the body and takes them out of the engine worlds: it is about to go away, or
// to be somewhere else.
void lift_clones(Partition& partition, BodyId id);

// A replica's body as the sector sees it: its state relative to the centre of the sector.
BodyState seen_in(const Partition& partition, const Sector& sector, const Replica& replica);

// Into the sector's engine world, and out of it. unplace_clone() activates the sector; both leave the clone
// listed.
void place_clone(Partition& partition, Sector& sector, Clone& clone);
void remove_clone(Sector& sector, Clone& clone);
void unplace_clone(Partition& partition, Sector& sector, Clone& clone);

// Policy clone: clones are solved where they are, and fall as their originals do.
void pull_clone(const Partition& partition, const Sector& sector, const Clone& clone);

}  // namespace tessera
