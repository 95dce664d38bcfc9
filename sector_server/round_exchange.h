// Messages between the servers of a world.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/status/statusor.h>

#include <compare>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cluster.pb.h"
#include "lpss/tick/tick_machine.h"
#include "transport/link.h"

namespace tessera {

// A tick is done in rounds: in each, a server sends some others a message, and waits for those of some. They
// may arrive in any order, and ahead of their time.
class RoundExchange {
 public:
  using Send = std::function<void(NodeId, const v1::ClusterMessage&)>;

  // Which round it is.
  struct Key {
    Tick tick = 0;
    std::uint64_t map_epoch = 0;  // of the map where sectors change servers before the tick; else 0
    std::uint32_t number = 0;

    auto operator<=>(const Key&) const = default;
  };

  // With other servers, by the kind of round.
  struct Traffic {
    TrafficByRound sent{};
    TrafficByRound received{};

    RoundTraffic all_sent() const;
  };

  RoundExchange(std::uint64_t world, NodeId node, std::vector<NodeId> nodes, Send send);

  // The servers, by rank, and the rank of this one: nodes().size() where it is a guest.
  const std::vector<NodeId>& nodes() const { return nodes_; }
  Rank self() const { return self_; }
  bool takes_part() const { return self_ < nodes_.size(); }
  void change_nodes(std::vector<NodeId> nodes);

  // A guest is there, and may be among the servers soon.
  void welcome(NodeId guest);

  // A message for a tick after `done`. INVALID_ARGUMENT from a stranger, INTERNAL if it is late or comes
  // twice, RESOURCE_EXHAUSTED if too many wait for their turn; it is ignored.
  absl::Status take(NodeId from, v1::Round round, Tick done);

  void send(const Round& round, const Key& key);
  // Whether all messages that the round waits for have arrived.
  bool has_all(const Round& round, const Key& key) const;
  // From whom they have not.
  std::vector<NodeId> missing(const Round& round, const Key& key) const;
  // These, by rank, with the own one, once it has; errors for those that cannot be read, or that `machine`
  // does not wait for.
  absl::StatusOr<std::vector<std::optional<RoundMessage>>> collect(Round& round, const Key& key,
                                                                   const TickMachine& machine);
  // Forgets those that nobody needs any more: of ticks that are done, or of a change of the map.
  void end_tick(Tick done) { inboxes_.erase(inboxes_.begin(), inboxes_.lower_bound({done + 1, 0, 0})); }
  void end_move(Tick tick, std::uint64_t map_epoch) {
    inboxes_.erase(inboxes_.lower_bound({tick, map_epoch, 0}),
                   inboxes_.upper_bound({tick, map_epoch, UINT32_MAX}));
  }

  const Traffic& traffic() const { return traffic_; }

 private:
  using Inbox = absl::flat_hash_map<std::uint64_t, std::string>;  // by the node that sent it

  const std::uint64_t world_;
  const NodeId node_;  // this server's
  std::vector<NodeId> nodes_;
  Rank self_ = 0;
  std::vector<NodeId> guests_;  // that were welcome last
  const Send send_;
  absl::btree_map<Key, Inbox> inboxes_;
  Traffic traffic_;
};

}  // namespace tessera
