// What clients can take of a daemon that serves gRPC.
#pragma once

#include <grpcpp/server_builder.h>

#include <chrono>
#include <cstddef>

namespace tessera {

// A client that has not been heard of for kClientSilenceMax is asked, and is disconnected unless it answers
// within kClientAnswerMax, so that nothing is kept for one whose host is gone or that has stopped.
inline constexpr std::chrono::milliseconds kClientSilenceMax{20'000};
inline constexpr std::chrono::milliseconds kClientAnswerMax{10'000};
// So long may a client take until its connection is one of gRPC, and so long may it have no call.
inline constexpr std::chrono::milliseconds kClientHandshakeMax{10'000};
inline constexpr std::chrono::milliseconds kClientIdleMax{60'000};
// Clients of several coordinators look so often, at most, whether the one that leads is still there.
inline constexpr std::chrono::milliseconds kClientAsksMin{1'000};
inline constexpr int kCallsPerConnectionMax = 1024;  // further ones wait at the client
inline constexpr std::size_t kMessagesInFlightBytesMax = std::size_t{4} << 30;  // of all clients

// `threads_max`: how many calls that have a thread each are served at a time. Compressed requests end with
// UNIMPLEMENTED.
void limit_clients(grpc::ServerBuilder& builder, int threads_max);

}  // namespace tessera
