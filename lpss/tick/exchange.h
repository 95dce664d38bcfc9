// Exchange: servers tell each other of the bodies near their seams.
#pragma once

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"
#include "lpss/tick/parallel.h"

namespace tessera {

// Writes what others must know of bodies that moved, or that other sectors need now; by rank.
void tell_of_replicas(Partition& partition, std::vector<Exchange>& outbox, const ParallelFor& parallel = {});

// Brings the replicas up to date with what all servers told, this one included.
void take_replicas(Partition& partition, std::vector<Exchange>& inbox, const ParallelFor& parallel = {});

// Those of bodies that go far (Replica::goes_far()) get their clones, once it is known who lives where.
void list_far_clones(Partition& partition);

}  // namespace tessera
