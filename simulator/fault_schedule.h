// The faults of a simulated cluster, drawn from a seed before anything runs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "transport/link.h"

namespace tessera {

// Times count from SimulatedCluster::meet().
struct FaultSchedule {
  // The link between two nodes is interrupted; messages sent meanwhile arrive later.
  struct Cut {
    NodeId node;
    NodeId peer;
    std::uint64_t begin_ns = 0;
    std::uint64_t end_ns = 0;
  };
  // A server ends without a message, and another one starts in its place.
  struct Crash {
    NodeId node;
    std::uint64_t time_ns = 0;
    std::uint64_t restart_ns = 0;  // from then on
  };

  // The coordinator ends without a message, and another one takes its place.
  struct CoordinatorCrash {
    std::uint64_t time_ns = 0;
    std::uint64_t restart_ns = 0;
  };

  std::vector<Cut> cuts;
  std::vector<Crash> crashes;
  std::vector<CoordinatorCrash> coordinator_crashes;  // one after the other
};

struct FaultOptions {
  std::uint32_t cuts =
      0;  // each of a different link, at most all links; a quarter of them outlast every time-out
  std::uint32_t crashes = 0;  // each of a different server, at most all servers
  std::uint32_t coordinator_crashes = 0;
  std::uint64_t begin_ns_max = 0;  // latest begin of a fault
};

FaultSchedule draw_faults(std::uint64_t seed, const FaultOptions& options, std::span<const NodeId> servers);

}  // namespace tessera
