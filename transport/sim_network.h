// A simulated network in one process: virtual time and a seed decide when each message arrives, so that a
// whole cluster runs in one thread and a fault found there replays exactly.
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

  // How long a node is out of reach of another, cut off or dead, until that one is told (SimEvent::kLoss).
  // 0: it never is.
  std::uint64_t lease_ns = 0;
};

// What happened at a moment of virtual time: a message reached the inbox of `node`, a timer of it ran out, or
// it misses signs of life of `peer`.
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

  // Goes on to the next event, sets the clock to its time and says what it was: the caller then lets that
  // node run. Nothing, and the clock stays, when nothing is under way.
  std::optional<SimEvent> step();

  // Virtual time since the network began, in nanoseconds.
  std::uint64_t now_ns() const;

  // Lets step() return a timer event for `node` at `time_ns`, or immediately if that is past. Each call sets
  // a separate timer; those of a killed node never expire.
  void set_timer(NodeId node, std::uint64_t time_ns);

  // Stops `node`, as kill -9 would: what is on its way from it or to it vanishes, and so does what others
  // send to it until it starts anew. Nodes that run then are told of the loss, even if it starts anew before.
  void kill(NodeId node);

  // Cuts the link between two nodes in both directions: messages are kept, not lost, and set out again, with
  // new delays, once the link is healed. Both nodes are told of the loss if it is not healed before. Both are
  // no errors when the link is cut or whole already.
  void cut(NodeId a, NodeId b);
  void heal(NodeId a, NodeId b);

 private:
  class State;
  class SimLink;

  std::shared_ptr<State> state_;
};

}  // namespace tessera
