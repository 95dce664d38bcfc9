// A simulated network in one process: virtual time and a seed determine when each message arrives, so that a
// whole cluster runs in one thread and any failure can be replayed exactly.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "transport/link.h"

namespace tessera {

struct SimOptions {
  // Each message has its own delay, drawn uniformly from this range, including both ends. The range must not
  // be empty.
  std::uint64_t delay_ns_min = 20'000;
  std::uint64_t delay_ns_max = 2'000'000;

  // True: a message may overtake another of the same pair of nodes, as Link permits. False: each pair keeps
  // its order.
  bool reorder = true;

  // How long a node must be unreachable, cut off or dead, before its peers are notified (SimEvent::kLoss).
  // 0: never.
  std::uint64_t lease_ns = 0;
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
  // killed node may start again and gets none of its predecessor's messages; the predecessor's link stays
  // dead. Destroying the link kills its node. A node must not be started twice at a time.
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

  // Stops `node`, as kill -9 would: messages in transit from it or to it are lost, and so are those sent to
  // it until it restarts. Running nodes are notified of the loss, even if it restarts before.
  void kill(NodeId node);

  // Cuts the link between two nodes in both directions: messages are kept, not lost, and sent again, with new
  // delays, once the link is healed. Both nodes are notified of the loss if it is not healed before. Cutting
  // a cut link and healing a whole one do nothing.
  void cut(NodeId a, NodeId b);
  void heal(NodeId a, NodeId b);

 private:
  class State;
  class SimLink;

  std::shared_ptr<State> state_;
};

}  // namespace tessera
