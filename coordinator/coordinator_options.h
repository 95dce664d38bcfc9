// What a coordinator is told when it starts. Apart from it, since programs' options need nothing else.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "coordinator/balance_policy.h"
#include "coordinator/limits.h"
#include "daemon/log_line.h"
#include "proto/server_traits.h"

namespace tessera {

class WorldStore;
namespace v1 {
class RecordedInput;
}

using Nanoseconds = std::chrono::nanoseconds;  // since an arbitrary start; never goes back

// Receives everything that determines the state of a world, in the order in which it takes effect.
using InputSink = std::function<void(const v1::RecordedInput&)>;

struct CoordinatorOptions {
  std::uint32_t servers_wanted = 0;  // a world is loaded on this many of its precision; 0: on all
  Labels required_labels;            // of its servers
  // Silence after which a server counts as lost, and, once the transport has lost contact with it, how long
  // it may take to come back. A server that stalls for less time loses nothing.
  Nanoseconds server_timeout = std::chrono::seconds(10);
  Nanoseconds contact_timeout = std::chrono::seconds(1);
  // How often a running world's state is taken down, so that it survives the loss of servers; 0: never, and a
  // world ends with any of its servers, which may then be out of contact for server_timeout.
  Nanoseconds checkpoint_every{0};
  // How often a running world is divided anew where its servers have unequal work; 0: only when it is asked
  // for. By the work that there will be in so many seconds, if bodies go on as they do.
  Nanoseconds balance_every{0};
  Nanoseconds balance_ahead{0};
  BalancePolicy balance_policy = BalancePolicy::kCurve;
  Nanoseconds join_timeout = std::chrono::seconds(20);  // how long a load waits for the servers it needs
  std::uint32_t grant_window = 32;                      // ticks granted ahead of the slowest server
  // The part of the time of the coordinator and of any server that clients of role observe may take, all
  // together, while a world ticks; above 0, at most 1. By this clock, which measures work; empty: by none.
  double observe_share = kObserveShare;
  std::function<Nanoseconds()> work_clock;
  std::size_t shape_bytes_max = kShapeBytesMax;  // of all shapes of a world, beyond which spawns are refused
  // The numbers of worlds that an earlier coordinator of the cluster gave: servers ignore what is older than
  // what they have.
  std::uint64_t worlds_before = 0;
  // Servers that have had worlds above this one had them of other coordinators, against which larger numbers
  // would not be right.
  std::uint64_t worlds_max = (std::uint64_t{1} << 62) - 1;
  // Where the world is kept, so that it outlives this process; null: nowhere. Needs checkpoints.
  WorldStore* store = nullptr;
  // While the store cannot be written (its disk is full, or fails): whether the world waits, so that nothing
  // is ever told that could be lost. Otherwise it goes on, and what comes meanwhile is stored once that is
  // possible.
  bool wait_for_store = true;
  InputSink inputs;  // empty: inputs are not reported and ticks are not hashed
  LogSink log;       // events for the operator; may be empty
};

}  // namespace tessera
