// How often to sample a world for a real-time display.
#pragma once

#include <cstdint>

#include "client_sdk/live/cluster_monitor.h"

namespace tessera::live {

// The interval in ticks for about `frames_per_second` frames a second. For a paused world, which is stepped
// by hand, every tick.
std::uint32_t ticks_between_frames(const ClusterReport& report, double frames_per_second);

// A factor of two is not worth a new subscription.
bool is_far_from(std::uint32_t a, std::uint32_t b);

}  // namespace tessera::live
