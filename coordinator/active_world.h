// A world that was sent to servers, as the coordinator keeps it while it is loaded.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/queries.h"
#include "coordinator/sequencer.h"
#include "coordinator/tick_statistics.h"
#include "coordinator/world_registry.h"
#include "lpss/grid/sector_map.h"
#include "tessera.pb.h"
#include "transport/link.h"

namespace tessera {

struct ActiveWorld {
  std::uint64_t number = 0;
  std::string name;
  WorldSettings settings;
  SectorIndex anchor;
  SectorMap map;
  std::size_t sectors = 0;    // at the load
  std::vector<NodeId> nodes;  // by rank
  WorldRegistry registry;
  Sequencer sequencer;
  Queries queries;
  TickStatistics statistics;
  RealTimeMeter meter;

  // While it is being loaded: the servers (by rank) that are not ready yet, and the call that waits for them.
  std::vector<bool> ready;
  std::function<void(const absl::Status&, const v1::LoadReply&)> load_reply;
  bool replaced_another = false;

  bool loading() const { return static_cast<bool>(load_reply); }

  // The rank of a server in this world, if it takes part.
  std::optional<std::size_t> rank_of(NodeId node) const {
    const auto place = std::find(nodes.begin(), nodes.end(), node);
    if (place == nodes.end()) return std::nullopt;
    return static_cast<std::size_t>(place - nodes.begin());
  }
};

}  // namespace tessera
