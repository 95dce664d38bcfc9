// How the coordinators of a cluster detect each other.
#pragma once

#include <absl/status/status.h>

#include <chrono>
#include <cstdint>
#include <string>

#include "transport/link.h"

namespace tessera {

struct BeaconOptions {
  std::string cluster;
  NodeId node;
  std::uint64_t session = 0;
  std::string endpoint;
  // How long to look for other coordinators.
  std::chrono::milliseconds discovery{500};
};

// Publishes a beacon for as long as DDS participant `participant` lives, unless another coordinator is there:
// see DdsLink::announce_coordinator().
absl::Status announce_beacon(std::int32_t participant, const BeaconOptions& options);

}  // namespace tessera
