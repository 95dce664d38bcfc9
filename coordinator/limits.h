// Named limits of the coordinator: how much clients may queue, and how large a message may be.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace tessera {

// Commands and shapes that wait for a tick, queries that wait for servers, and calls that wait for the world
// to pause. Beyond these limits, clients get RESOURCE_EXHAUSTED.
inline constexpr std::size_t kHeldCommandsMax = 262'144;
inline constexpr std::size_t kPastCommandsMax = 1'048'576;  // since the last checkpoint
inline constexpr std::size_t kHeldShapeBytesMax = std::size_t{1} << 30;
inline constexpr std::size_t kShapeBytesMax = std::size_t{4} << 30;  // of all shapes of a world; by default
inline constexpr std::size_t kOpenQuestionsMax = 4096;
inline constexpr std::size_t kWaitingCallsMax = 4096;
inline constexpr std::size_t kQueuedRequestsMax = 4096;           // from gRPC's threads to the state machine
inline constexpr std::size_t kQueuedRequestsPerClientMax = 1024;  // of a connection
// The state machine takes requests for so long at a stretch, and at least one; then servers have their turn.
inline constexpr std::chrono::milliseconds kRequestsTurnMax{5};
// Clients of role observe, all together, may take a share of the time of the coordinator and of any server
// while a world ticks: by default so much, of which what was not used is saved for so long. Of it, no more at
// a stretch, and one query at least: of the coordinator for a request, of a server for all between two ticks.
inline constexpr double kObserveShare = 0.2;
inline constexpr double kObserveShareMin = 0.001;
inline constexpr std::chrono::milliseconds kObserveSavedMax{250};
inline constexpr std::chrono::milliseconds kObserveStretchMax{10};
inline constexpr std::size_t kQueuedRequestBytesMax = std::size_t{2} << 30;  // of them all; by default
// Clients whose replies are remembered, and how many replies of each that it has not taken, so that a request
// that is made again is carried out once. Larger replies are remembered without results.
inline constexpr std::size_t kSessionsMax = 1024;
inline constexpr std::size_t kUnansweredMax = 4096;
inline constexpr std::size_t kCallsAgainMax = 8;
inline constexpr std::size_t kKeptReplyBytesMax = 64 << 10;
// Requests of a stream whose replies its client has not read: no more are read from it until it has.
inline constexpr std::size_t kStreamRequestsMax = 256;
inline constexpr int kSnapshotCallsMax = 2;  // at a time: the coordinator holds all of a world for each
inline constexpr std::size_t kReplyShapeBytesMax = std::size_t{256}
                                                   << 20;  // of find, with shapes; then it is cut off

// Elements of a request.
inline constexpr int kCommandsPerListMax = 100'000;
inline constexpr int kQueriesPerListMax = 100'000;
inline constexpr std::uint64_t kRaysPerRequestMax = 100'000;  // that queries have in columns
inline constexpr std::uint64_t kIdsPerRequestMax = 262'144;   // that queries name, of bodies and joints
inline constexpr std::uint64_t kWaySectorsPerRequestMax =
    262'144;  // that rays and sweeps pass through, in all
inline constexpr std::size_t kResultBytesMax = std::size_t{512} << 20;  // and one query's at least
// The assemblies of models that are spawned are numbered from here on: apart from those of any file.
inline constexpr std::uint64_t kSpawnedAssemblies = std::uint64_t{1} << 62;

inline constexpr std::uint64_t kStepTicksMax = 1'000'000'000;
inline constexpr double kRealTimeFactorMin = 1e-3;
inline constexpr double kRealTimeFactorMax = 1e6;
inline constexpr double kRaySectorsMax = 65'536;  // that a ray may pass through
inline constexpr double kReachMax = 4;            // sectors: how far from a probe `near` searches for bodies
inline constexpr std::size_t kDynamicsBodiesMax = 256;  // of an assembly whose dynamics are asked for
inline constexpr int kDynamicsPointsMax = 256;          // of it, for Jacobians
inline constexpr std::uint64_t kFoundBodiesDefault = 1000;
inline constexpr std::uint64_t kFoundBodiesMax = 100'000;

inline constexpr int kClientMessageBytesMax = 1 << 30;
inline constexpr std::size_t kSnapshotBytesMax = std::size_t{64} << 30;  // of one that is restored
// protobuf serialises up to 2^31 - 1 bytes; the rest is room for the envelope.
inline constexpr std::size_t kLoadMessageBytesMax = (std::size_t{1} << 31) - (std::size_t{1} << 20);

// A server may be silent for longer while it loads a world than while it runs one.
inline constexpr std::chrono::minutes kLoadSilenceMax{10};
// The transport sees whether such a server is alive; if not, it has this long to come back where the world
// ends with it.
inline constexpr std::chrono::minutes kStallMax{1};
inline constexpr int kSubscriptionsMax = 4096;  // streams of clients that go on at other servers
// A world without servers waits for others so long once one has come.
inline constexpr std::chrono::milliseconds kGatherServers{300};
// Sectors and bodies that change servers in one tick, for that must not be late.
inline constexpr std::uint64_t kMovedAtOnceMax = 4000;
// A world that loses a server so often without a tick in between has failed.
inline constexpr std::uint32_t kLossesInPlaceMax = 16;
// Lists that a world goes on without, as the status tells them, and of the commands of each.
inline constexpr std::size_t kLeftOutMax = 16;
inline constexpr std::size_t kLeftOutBytesMax = 1024;
inline constexpr int kLoadTriesMax = 3;  // of a load that loses servers
// Also of servers that are idle: whom another one misses counts as cut off only once it has reported.
inline constexpr std::chrono::milliseconds kHeartbeatMax{500};
// Two servers of a world of which one misses the other, while the network sees signs of life: a long message
// may take so much time.
inline constexpr std::chrono::seconds kLongMessageMax{10};
inline constexpr std::size_t kCutOffKept = 8;  // servers in the status
// A coordinator that is this late has stalled itself. The silence of servers then means nothing, and they get
// the full time again.
inline constexpr std::chrono::seconds kLateMax{1};
inline constexpr std::size_t kStreamAddressBytesMax = 1024;
// Unknown servers are remembered, so that each is notified once.
inline constexpr std::size_t kStrangersMax = 1024;
// How often a store that failed is tried again, and how much of what happens meanwhile is kept for it.
inline constexpr std::chrono::milliseconds kStoreRetry{1000};
inline constexpr std::size_t kUnstoredMax = 262'144;  // commands and changes of pace

}  // namespace tessera
