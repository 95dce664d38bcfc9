// How often to sample a world for those who look at it in real time.
#pragma once

#include <cstdint>

#include "client_sdk/live/cluster_monitor.h"

namespace tessera::live {

// So that about `frames_per_second` frames come in a second; every tick of a world that stands still, which
// is stepped by hand.
std::uint32_t ticks_between_frames(const ClusterReport& report, double frames_per_second);

// A factor of two is not worth a new subscription.
bool is_far_from(std::uint32_t a, std::uint32_t b);

}  // namespace tessera::live
