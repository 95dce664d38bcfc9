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
};

// An event in virtual time: a message reached the inbox of `node`, or one of its timers expired.
struct SimEvent {
  enum class Kind { kDelivery, kTimer };

  std::uint64_t time_ns = 0;
  NodeId node;
  Kind kind = Kind::kDelivery;

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

  // Advances to the next event, sets the clock to its time and returns it: the caller then lets that node
  // run. Returns nullopt, without changing the clock, if no message or timer is pending.
  std::optional<SimEvent> step();

  // Virtual time since the network began, in nanoseconds.
  std::uint64_t now_ns() const;

  // Lets step() return a timer event for `node` at `time_ns`, or immediately if that is past. Each call sets
  // a separate timer; those of a killed node never expire.
  void set_timer(NodeId node, std::uint64_t time_ns);

  // Stops `node`, like kill -9: messages in transit from it or to it vanish, and so do messages sent to it
  // until it starts again.
  void kill(NodeId node);

  // Cuts the link between two nodes in both directions: messages are kept, not lost, and sent again, with new
  // delays, once the link is healed. Cutting a cut link or healing a whole one has no effect.
  void cut(NodeId a, NodeId b);
  void heal(NodeId a, NodeId b);

 private:
  class State;
  class SimLink;

  std::shared_ptr<State> state_;
};

}  // namespace tessera
