// The servers of a world: who hosts it, who is about to, and who has just left it.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "cluster.pb.h"
#include "transport/link.h"

namespace tessera {

class Roster {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  // A server that begins to take part. It gets ready first: see v1::Guest.
  struct Guest {
    NodeId node;
    bool is_ready = false;
    std::vector<NodeId> unheard;  // servers of the world that it cannot reach
  };
  // One that does not take part any more since the last map. Others may still need its messages until they
  // have that map, and then it has some time to send clients what it has for them.
  struct Leaver {
    NodeId node;
    std::optional<Nanoseconds> until;
  };

  // None of these has the world yet.
  explicit Roster(std::vector<NodeId> nodes) : nodes_(std::move(nodes)), ready_(nodes_.size()) {}

  // By rank, for the ticks that are granted next.
  const std::vector<NodeId>& nodes() const { return nodes_; }
  // The rank of a server, if it takes part.
  std::optional<std::size_t> rank_of(NodeId node) const;
  // Whether all of them have the world.
  bool hosts() const;
  void has_world(std::size_t rank);

  // One at a time each.
  const std::optional<Guest>& guest() const { return guest_; }
  const std::optional<Leaver>& leaver() const { return leaver_; }
  bool is_guest(NodeId node) const { return guest_ && guest_->node == node; }
  // Who hears of each grant: the servers, and the guest.
  std::vector<NodeId> listeners() const;
  // Whether the world, or its clients, still need a server; and whether others must have what it has sent.
  bool needs(NodeId node) const;
  bool cannot_lose(NodeId node) const;

  // Servers that could not, or cannot, get ready.
  const std::set<NodeId>& unfit() const { return unfit_; }
  void add_unfit(NodeId node) { unfit_.insert(node); }

  void invite(NodeId node);
  void guest_is_ready();
  void guest_awaits(std::vector<NodeId> unheard);
  void drop_guest() { guest_.reset(); }
  // All others have the map without the leaver, which clients may need until then.
  void release_leaver(Nanoseconds until);
  void drop_leaver() { leaver_.reset(); }

  // From the next grant on, the servers are those of the map: its newcomer was the guest.
  void change(const v1::SectorMap& map);
  // The world goes back to a checkpoint, on these. Returns those that had it and are to drop it.
  std::vector<NodeId> restart(std::vector<NodeId> nodes);

  // Since the load: servers that have begun to take part, and that have left.
  std::uint64_t joined() const { return joined_; }
  std::uint64_t left() const { return left_; }

  // The streams of clients at a server.
  void subscribe(NodeId node, v1::Subscriptions subscriptions);
  // At any server, each once; at most kSubscriptionsMax.
  v1::Subscriptions all_subscriptions() const;
  v1::Subscriptions take_subscriptions();

 private:
  std::vector<NodeId> nodes_;
  std::vector<bool> ready_;  // which have the world, by rank
  std::optional<Guest> guest_;
  std::optional<Leaver> leaver_;
  std::set<NodeId> unfit_;
  std::uint64_t joined_ = 0;
  std::uint64_t left_ = 0;
  std::map<NodeId, v1::Subscriptions> subscriptions_;
};

}  // namespace tessera
