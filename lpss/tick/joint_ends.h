// Who hosts what joints tie to the bodies of a server: joints reach anywhere, so this is found out in an
// agreement.
#pragma once

#include <absl/container/flat_hash_map.h>

#include <vector>

#include "lpss/partition/partition.h"
#include "lpss/tick/messages.h"

namespace tessera {

// The servers of bodies of others that joints tie to bodies that live here.
using JointHosts = absl::flat_hash_map<BodyId, Rank>;

// The ends of joints whose other ends are not known here, and those that part. Bodies of the outbox already
// count for their new server.
std::vector<JointEnd> joint_ends(const Partition& partition, const std::vector<Exchange>& outbox);

}  // namespace tessera
