// A world that was sent to servers, as the coordinator keeps it while it is loaded.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/coordinator.h"
#include "coordinator/questions.h"
#include "coordinator/roster.h"
#include "coordinator/sequencer.h"
#include "coordinator/tick_statistics.h"
#include "coordinator/world_registry.h"
#include "coordinator/world_to_load.h"
#include "lpss/grid/sector_map.h"
#include "tessera.pb.h"
#include "transport/link.h"

namespace tessera {

// What all that tends it has in common.
struct ActiveWorld {
  const std::uint64_t load;  // counts loads and restores of clients
  std::uint64_t number;      // of the message by which its servers got it: other ones when it is set back
  const std::string name;
  const SectorIndex anchor;
  SectorMap map;
  std::size_t sectors = 0;  // at the load
  WorldRegistry registry;
  Sequencer sequencer;
  Questions questions;
  TickStatistics statistics;
  RealTimeMeter meter;
  Roster servers;

  // The call that waits for the first time that all servers have it.
  using Load = std::function<void(const absl::Status&, const v1::LoadReply&)>;
  std::optional<Load> being_loaded;

  const WorldSettings& settings() const { return registry.settings(); }
  bool loading() const { return being_loaded.has_value(); }
  bool recovering() const { return !loading() && (!servers.hosts() || sequencer.replaying()); }
};

// Of a world as it was given, which none of these servers has yet. `keeps_past`: it may be set back.
ActiveWorld active_world(const WorldToLoad& from, std::uint64_t load, std::uint64_t number,
                         std::vector<NodeId> nodes, std::uint32_t grant_window, bool keeps_past);

// The catalogue with what only the sequence knows, and the world's name.
WorldCatalogue with_held(const ActiveWorld& world, WorldCatalogue catalogue);

}  // namespace tessera
