// Named limits of the coordinator: what clients may pile up, and what a message may weigh.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace tessera {

// Commands and shapes that wait for a tick, queries that wait for servers, and calls that wait for the world
// to stand still. Beyond these, clients get RESOURCE_EXHAUSTED.
inline constexpr std::size_t kHeldCommandsMax = 262'144;
inline constexpr std::size_t kHeldShapeBytesMax = std::size_t{1} << 30;
inline constexpr std::size_t kOpenQueriesMax = 4096;
inline constexpr std::size_t kWaitingCallsMax = 4096;
inline constexpr std::size_t kQueuedRequestsMax = 4096;  // from gRPC's threads to the state machine

inline constexpr std::uint64_t kStepTicksMax = 1'000'000'000;
inline constexpr double kRealTimeFactorMin = 1e-3;
inline constexpr double kRealTimeFactorMax = 1e6;
inline constexpr double kReachMax = 4;  // sectors: how far from a probe bodies are looked for
inline constexpr std::uint64_t kFoundBodiesDefault = 1000;
inline constexpr std::uint64_t kFoundBodiesMax = 100'000;

inline constexpr int kClientMessageBytesMax = 1 << 30;
// protobuf serialises up to 2^31 - 1 bytes; the rest is room for the envelope.
inline constexpr std::size_t kLoadMessageBytesMax = (std::size_t{1} << 31) - (std::size_t{1} << 20);

// A server that loads a world may be silent for longer than one that runs it.
inline constexpr std::chrono::minutes kLoadSilenceMax{10};
// Of such a server, too, the transport hears signs of life; without any it has this long to come back.
inline constexpr std::chrono::minutes kStallMax{1};
inline constexpr std::chrono::milliseconds kHeartbeatMax{1000};
// A coordinator that is this late has stalled itself: then it is no sign of anything that servers were
// silent, and they get as long again to be heard.
inline constexpr std::chrono::seconds kLateMax{1};
inline constexpr std::size_t kStreamAddressBytesMax = 1024;
inline constexpr std::size_t kStrangersMax = 1024;  // unknown servers that are told so once

}  // namespace tessera
