// The faults of a simulated cluster, drawn from a seed before anything runs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "transport/link.h"

namespace tessera {

enum class FaultKind {
  kCut,               // of a link between two processes: packets wait, and are lost if it lasts
  kLastingCut,        // of links, for good: one way or both, from one other process or from all other servers
  kBreak,             // of a connection, which is made anew: packets under way are lost or not
  kStop,              // of a process with all of its threads, as by SIGSTOP
  kSlow,              // a server takes long for each message
  kClockJump,         // the clock of a process jumps ahead, and the calendar of its host anywhere
  kCrash,             // of a server, which another one replaces
  kCoordinatorCrash,  // another one takes its place; it ends at any moment, also while it writes
  kPowerLoss,         // likewise, with the host: what was not synced is lost or torn
  kCrashInRecovery,   // of a server or of the coordinator, while a world goes on from a checkpoint
  kDiskFull,          // of the coordinator's store
  kDiskFailing,       // reads, writes and syncs have errors
  // Not faults, but what operators do.
  kJoin,   // a server comes to the running world
  kDrain,  // one is emptied, and ends once it is
};
inline constexpr std::size_t kFaultKinds = 14;

// One list for options, reports and schedules, in the order of FaultKind.
struct FaultName {
  const char* option;  // "cuts"
  const char* help;
};
inline constexpr std::array<FaultName, kFaultKinds> kFaultNames = {{
    {"cuts", "links between two processes that are cut for a while; one in four outlasts the time-outs"},
    {"lasting-cuts",
     "links that are cut for good, one way or both: between two servers, between a server and the "
     "coordinator, or "
     "between a server and all others"},
    {"breaks", "connections that break, with packets lost, and are made anew at once"},
    {"stops", "processes that stand still for a while; one in four outlasts the time-outs"},
    {"slow-servers", "servers that take long for each message, for a while"},
    {"clock-jumps", "clocks that jump ahead, and calendars that jump anywhere"},
    {"crashes", "servers that end without a word; each time, another one joins some seconds later"},
    {"coordinator-crashes", "ends of the coordinator at any moment; another one takes its place"},
    {"power-losses", "likewise, with what was not synced to disk lost or torn"},
    {"crashes-in-recovery", "ends of a process while the world goes on from a checkpoint"},
    {"full-disks", "times in which the store finds no room"},
    {"failing-disks", "times in which reads, writes and syncs of the store fail"},
    {"joins", "servers that come while the world runs"},
    {"drains", "servers that are emptied while the world runs, and end once they are"},
}};

// How many of each kind.
using FaultNumbers = std::array<std::uint32_t, kFaultKinds>;

// Which links are cut for good; by Fault::amount.
enum class LastingCut : std::uint8_t {
  kToServer,         // one way
  kBetweenServers,   // both ways
  kToAllServers,     // a server that only the coordinator hears
  kFromAllServers,   // one that only hears the coordinator
  kOfAllServers,     // both
  kFromCoordinator,  // unless fewer than two servers hear it, and are heard by it
  kToCoordinator,    // likewise
};
inline constexpr std::uint64_t kLastingCuts = 7;

// Times count from SimulatedCluster::meet(). What is hit is drawn when it happens, by `pick`, among what is
// there; unless it is named.
struct Fault {
  FaultKind kind = FaultKind::kCut;
  std::uint64_t begin_ns = 0;
  std::uint64_t end_ns = 0;  // of a crash: when another process takes the place of the one that ended
  std::uint64_t pick = 0;
  // Operations on the disk that a crash waits for; ns of a jump, or for a message; which LastingCut.
  std::uint64_t amount = 0;
  NodeId node{};
  NodeId peer{};
};
using FaultSchedule = std::vector<Fault>;

// In their order of begin, none of which is later than `begin_ns_max`.
FaultSchedule draw_faults(std::uint64_t seed, const FaultNumbers& numbers, std::uint64_t begin_ns_max);

}  // namespace tessera
