// What goes wrong in a simulated cluster, and when: drawn from a seed before anything runs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "transport/link.h"

namespace tessera {

// Times count from the moment at which a cluster meets the schedule.
struct FaultSchedule {
  // The link between two nodes carries nothing for a while; what was sent meanwhile arrives later.
  struct Cut {
    NodeId node;
    NodeId peer;
    std::uint64_t begin_ns = 0;
    std::uint64_t end_ns = 0;
  };
  // A server ends without a word, for good.
  struct Crash {
    NodeId node;
    std::uint64_t time_ns = 0;
  };

  std::vector<Cut> cuts;
  std::vector<Crash> crashes;

  // The servers that the coordinator gives up: those that crash, and those that it cannot hear for longer
  // than its time-out. Any of them ends the world; all else changes nothing but time. A cut must be clearly
  // shorter or longer than the time-out.
  std::vector<NodeId> lost_servers() const;
};

struct FaultOptions {
  std::uint32_t cuts =
      0;  // each of another link; a quarter of them outlast every time-out; at most all links
  std::uint32_t crashes = 0;       // each of another server; at most all servers
  std::uint64_t begin_ns_max = 0;  // when the last of them begins
};

FaultSchedule draw_faults(std::uint64_t seed, const FaultOptions& options, std::span<const NodeId> servers);

}  // namespace tessera
