// What a gateway takes of its clients, and asks of the daemons behind it.
#pragma once

#include <chrono>
#include <cstddef>

namespace tessera {

// Calls under way, of all clients and of each address that they come from; further ones end with
// RESOURCE_EXHAUSTED. Of each, one message at most is on its way in either direction.
inline constexpr std::size_t kGatewayCallsMax = 16'384;
inline constexpr std::size_t kGatewayCallsPerClientMax = 4096;

// Of the coordinator: larger requests are refused there.
inline constexpr int kGatewayMessageBytesMax = 1 << 30;

// Calls to a daemon share connections, up to so many each; daemons take kCallsPerConnectionMax.
inline constexpr int kCallsPerLine = 256;

// How long a call waits until a coordinator leads, and how long each is asked, and how often.
inline constexpr std::chrono::seconds kRouteWaitMax{10};
inline constexpr std::chrono::seconds kAskMax{1};
inline constexpr std::chrono::milliseconds kAskEvery{50};

}  // namespace tessera
