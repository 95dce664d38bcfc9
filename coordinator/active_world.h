// A world that was sent to servers, as the coordinator keeps it while it is loaded.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/checkpoints.h"
#include "coordinator/consolidation.h"
#include "coordinator/coordinator.h"
#include "coordinator/queries.h"
#include "coordinator/sequencer.h"
#include "coordinator/tick_statistics.h"
#include "coordinator/world_registry.h"
#include "coordinator/world_store.h"
#include "lpss/grid/sector_map.h"
#include "proto/kept_chunks.h"
#include "tessera.pb.h"
#include "transport/link.h"

namespace tessera {

// One that has just come from the servers.
struct FreshCheckpoint {
  Tick tick = 0;
  bool are_all = false;        // the chunks; otherwise those that have changed since the one before
  std::uint64_t position = 0;  // of the inputs that it has
  std::vector<v1::SnapshotChunk> chunks;
};

struct ActiveWorld {
  std::uint64_t load = 0;    // counts loads and restores of clients
  std::uint64_t number = 0;  // of the message by which its servers got it: other ones when it is set back
  std::string name;
  WorldSettings settings;
  SectorIndex anchor;
  SectorMap map;
  std::size_t sectors = 0;    // at the load
  std::vector<NodeId> nodes;  // by rank, for the ticks that are granted next
  WorldRegistry registry;
  Sequencer sequencer;
  Queries queries;
  TickStatistics statistics;
  RealTimeMeter meter;

  // Which servers (by rank) have it, and the call that waits for the first time that all do.
  std::vector<bool> ready;
  std::function<void(const absl::Status&, const v1::LoadReply&)> load_reply;
  bool replaced_another = false;

  // Where it can be set back to; empty if it ends with any of its servers.
  std::optional<Checkpoints> checkpoints;
  std::optional<FreshCheckpoint> fresh_checkpoint;
  bool awaits_checkpoint = false;
  bool servers_keep_up = false;                // they know which chunks the last one had
  std::chrono::nanoseconds next_checkpoint{};  // the time
  // What has changed since the state that is stored, once the next checkpoint has come.
  StateChange unstored_state;
  ChunkChanges stored_head;       // of the state that is stored, with what is held
  ChunkChanges stored_catalogue;  // likewise, of names and properties
  // As of the registry, and the number of shapes.
  std::optional<std::pair<std::uint64_t, std::size_t>> stored_catalogue_changes;
  std::optional<std::chrono::nanoseconds> gathers_until;  // for servers, while it has none
  std::uint64_t recoveries = 0;
  std::map<NodeId, v1::Subscriptions> subscriptions;  // of clients, at each of its servers
  Tick last_loss = 0;                                 // completed when a server was lost
  std::uint32_t losses_in_place = 0;

  // One server at a time begins to take part. It gets ready first: see v1::Guest.
  struct Guest {
    NodeId node;
    bool is_ready = false;
  };
  std::optional<Guest> guest;
  std::set<NodeId> unfit;  // servers that could not get ready
  // One that does not take part any more since the last map. Others may still need its messages until they
  // have that map, and then it has some time to send clients what it has for them.
  struct Leaving {
    NodeId node;
    std::optional<std::chrono::nanoseconds> until;
  };
  std::optional<Leaving> leaving;
  std::uint64_t joined_servers = 0;
  std::uint64_t left_servers = 0;
  std::uint32_t shares_left =
      0;  // how often at most it is divided anew at once, for a server that has joined

  bool awaits_load = false;                               // of its servers, to divide it anew
  std::optional<std::vector<v1::ServerLoad>> fresh_load;  // that has just come
  std::chrono::nanoseconds next_balance{};                // the time
  Consolidation consolidation;
  std::uint64_t moved_sectors = 0;  // to other servers, as planned
  std::uint64_t moved_bodies = 0;

  std::optional<NodeId> told_slow;  // the server that was named as slow

  bool loading() const { return static_cast<bool>(load_reply); }
  // Whether all servers have it.
  bool hosted() const {
    return !ready.empty() && std::find(ready.begin(), ready.end(), false) == ready.end();
  }
  bool recovering() const { return !loading() && (!hosted() || sequencer.replaying()); }

  // The rank of a server in this world, if it takes part.
  std::optional<std::size_t> rank_of(NodeId node) const {
    const auto place = std::find(nodes.begin(), nodes.end(), node);
    if (place == nodes.end()) return std::nullopt;
    return static_cast<std::size_t>(place - nodes.begin());
  }
};

}  // namespace tessera
