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
  SectorIndex next_home;          // where it will live from the next tick on; the home itself if it stays
  OffsetSet replicated_in;        // relative to `home`: the sectors that must have a clone
  BodyState state;                // relative to the centre of `home`
  bool known_everywhere = false;  // by all servers, whether or not a sector of theirs needs a clone
  bool jointed = false;           // some joint has it as parent or child
  double surge = 0;               // m, SectorWorld::surge() in this tick
};

// The replica of that body, made if there is none yet.
Replica& introduce(Partition& partition, const ReplicaIntroduction& news);

void revise(Replica& replica, const ReplicaUpdate& update);

ReplicaIntroduction introduction_of(const Replica& replica);
ReplicaUpdate update_of(const Replica& replica);

// Lists a replica whose home changes at the next tick, once.
void note_moving(Partition& partition, const Replica& replica);

// The replica's clone in that sector of the partition, made and listed if there is none yet.
Clone& clone_in(Partition& partition, Replica& replica, const SectorIndex& index);

// Has the clones set anew at the next detection, where that is all that there is to do: false if they are not
// listed as the replica says, or if a sector of theirs becomes active. Changes nothing but the clones.
bool refresh_listed(Replica& replica);

// Lists clones of the replica in the sectors that need it, and none in those that no longer do. Of one that
// goes far, once bodies are in their homes of this tick.
void list_clones(Partition& partition, Replica& replica);

// Likewise, but only takes clones off the list. One that goes far needs it before a body is at home where it
// had a clone.
void unlist_left_clones(Partition& partition, Replica& replica);

// Nothing happens where there is no such replica.
void forget_replica(Partition& partition, BodyId id);

// Wakes what touches clones of the body and takes them out of the engine worlds: it is about to go away, or
// to be somewhere else.
void lift_clones(Partition& partition, BodyId id);

// The body as its sector sees it: relative to the centre of that.
BodyState state_of(const Clone& clone);

// Into its sector's engine world, and out of it. unplace_clone() activates the sector; both leave the clone
// listed.
void place_clone(const Partition& partition, Clone& clone);
void remove_clone(Clone& clone);
void unplace_clone(Partition& partition, Clone& clone);

// Tells the engine what it foresees with of a clone: as of its original.
void foresee_clone(const Partition& partition, const Clone& clone);

}  // namespace tessera
