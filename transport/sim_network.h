// A simulated network in one process: virtual time and a seed determine when each message arrives, so that a
// whole cluster runs in one thread and any failure can be replayed exactly.
//
// Messages travel as they do over DDS: in packets of a PeerStream, over connections that keep order and lose
// nothing while they stand. When one breaks, each packet under way is lost or not, and an end may miss the
// break.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "transport/link.h"

namespace tessera {

struct SimOptions {
  // Each message has its own delay, drawn uniformly from this range, including both ends, once the connection
  // stands. The range must not be empty.
  std::uint64_t delay_ns_min = 20'000;
  std::uint64_t delay_ns_max = 2'000'000;

  // True: a message may overtake another of the same pair of nodes, as Link permits. False: each pair keeps
  // its order.
  bool reorder = true;

  // How long a node must be unreachable, cut off, stopped or dead, before its peers are notified
  // (SimEvent::kLoss), and before its connections break. 0: never.
  std::uint64_t lease_ns = 0;
  std::uint64_t connection_ns = 10'000'000'000;

  // One in so many packets arrives twice; 0: none does.
  std::uint64_t duplicates_one_in = 0;
};

// What happened to packets so far.
struct SimCounts {
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;
  std::uint64_t duplicated = 0;
};

// An event in virtual time: a message reached the inbox of `node`, its timer expired, or it has lost contact
// with `peer`.
struct SimEvent {
  enum class Kind { kDelivery, kTimer, kLoss };

  std::uint64_t time_ns = 0;
  NodeId node;
  Kind kind = Kind::kDelivery;
  NodeId peer{};  // of kLoss

  friend bool operator==(const SimEvent&, const SimEvent&) = default;
};

// The network and its clock. One thread uses it and all of its links; they may be destroyed in any order.
// Two networks with the same seed, options and calls behave identically.
class SimNetwork {
 public:
  explicit SimNetwork(std::uint64_t seed, SimOptions options = {});
  ~SimNetwork();

  SimNetwork(const SimNetwork&) = delete;
  SimNetwork& operator=(const SimNetwork&) = delete;

  // Starts a process at address `node`: it gets the messages sent to that address before it first appeared. A
  // killed node may start again: it gets the messages that were sent once the loss of its predecessor had
  // been noticed. The predecessor's link stays dead. Destroying the link kills its node. A node must not be
  // started twice at a time.
  //
  // receive() of such a link never waits, whatever its deadline: it returns what step() has put into the
  // inbox.
  std::unique_ptr<Link> connect(NodeId node);

  // Processes the next event, sets the clock to its time and returns it: the caller then runs that node.
  // Nothing, with the clock unchanged, if no event is pending.
  std::optional<SimEvent> step();

  // Virtual time since the network began, in nanoseconds.
  std::uint64_t now_ns() const;

  // Lets step() return a timer event for `node` at `time_ns`, or immediately if that is past. Each call sets
  // a separate timer; those of a killed node never expire.
  void set_timer(NodeId node, std::uint64_t time_ns);

  // As DdsLink::forget().
  void forget(NodeId node, NodeId peer);

  // Stops `node`, as kill -9 would: messages to it are lost, and of those from it that are under way the
  // first ones arrive.
  void kill(NodeId node);

  // Cuts the link between two nodes in both directions, or what one sends to the other: packets are kept, and
  // sent again once the link is healed, unless the connection breaks before. Whoever hears nothing is
  // notified of the loss if it is not healed before. Cutting a cut link and healing a whole one do nothing.
  void cut(NodeId a, NodeId b);
  void cut_one_way(NodeId from, NodeId to);
  void heal(NodeId a, NodeId b);

  // Breaks the connection between two nodes, which is made anew at once.
  void break_connection(NodeId a, NodeId b);

  // Until `until_ns`, no events come for `node`: it stands still with all of its threads, as after SIGSTOP,
  // or it is only busy, which peers do not notice.
  void stop(NodeId node, std::uint64_t until_ns);
  void keep_busy(NodeId node, std::uint64_t until_ns);

  const SimCounts& counts() const;

 private:
  class State;
  class SimLink;

  std::shared_ptr<State> state_;
};

}  // namespace tessera
