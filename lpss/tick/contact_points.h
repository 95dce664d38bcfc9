// Contact points: they follow their pair to the sector that detects it, so that warm starting never breaks.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

// Sends on the points of pairs that another sector detects from this tick on. Before homes change.
void send_contact_points(Partition& partition, std::vector<Exchange>& outbox);

// Sends on the points of pairs both of whose bodies go to another frame, to homes of the same one; along its
// axes. Before they leave. `homes`: where they go.
void send_contacts_along(Partition& partition, const absl::flat_hash_map<BodyId, SectorIndex>& homes,
                         std::vector<Exchange>& outbox);

// Takes over what came in, where the sector has a world. After bodies and clones are in place.
void take_contact_points(Partition& partition, std::vector<Exchange>& inbox);

}  // namespace tessera
