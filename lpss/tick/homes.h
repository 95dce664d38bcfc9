// Homes: bodies move to the sector that holds their centre of mass. A change is announced in one tick and
// carried out in the next, so that every server knows of it when it happens.
#pragma once

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/divergences.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// A body on its way to a new home. `handover.replicated_in` are the sectors that were told of it, relative to
// the old one; `handover.known_everywhere` is whether all servers are to know it from now on.
struct HomeChange {
  Handover handover;
  SectorIndex old_home;
  bool was_known_everywhere = false;
};

// Takes a body out of its home, for another one in which it has this state: as the engine rounds it, since
// its clones, and joints that it leads elsewhere, have to find it where it will be, to the bit. What else the
// handover says is relative to the old home.
HomeChange taken_to(Partition& partition, HomeBody& body, const SectorIndex& home, const BodyState& state);

// Of a body that goes away, or elsewhere: neither it nor its replica changes home as announced.
void forget_moves(Partition& partition, BodyId id);

// Carries out the changes that were announced in the last tick, and the `jumps` that commands asked for. The
// old home announces the body once more, since no other server knows who has replicas of it.
void change_homes(Partition& partition, std::vector<HomeChange> jumps, std::vector<Exchange>& outbox);

// Takes the bodies in that come to live here.
void take_homes(Partition& partition, std::vector<Exchange>& inbox);

// Decides which bodies change home at the next tick. Appends those that were stopped at the edge of the
// representable world instead.
void announce_home_changes(Partition& partition, std::vector<Stopped>& stopped,
                           const ParallelFor& parallel = {});

}  // namespace tessera
