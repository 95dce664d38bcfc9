// Messages between the processes of a cluster: the only interface through which state machines communicate.
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>
#include <string>
#include <vector>

namespace tessera {

// The address of a process in its cluster. The coordinator is always kCoordinatorNode; a sector server draws
// its own at start.
struct NodeId {
  std::uint64_t value = 0;

  friend auto operator<=>(const NodeId&, const NodeId&) = default;

  template <typename H>
  friend H AbslHashValue(H h, const NodeId& node) {
    return H::combine(std::move(h), node.value);
  }
};

inline constexpr NodeId kCoordinatorNode{1};

struct Delivery {
  NodeId from;
  std::string payload;
};

// One process's end of the network. Every message that is sent arrives exactly once while both processes
// live; messages may overtake each other. send() and receive() belong to one thread; wake() to any.
class Link {
 public:
  virtual ~Link() = default;

  virtual NodeId self() const = 0;

  // Queues `payload` for delivery. Never waits for the receiver: a message to a process that does not exist
  // yet is kept until it appears.
  virtual void send(NodeId to, std::string payload) = 0;

  // The messages that have arrived, in order of arrival. Waits for one until `deadline` or until wake() is
  // called. May return nothing.
  virtual std::vector<Delivery> receive(std::chrono::steady_clock::time_point deadline) = 0;

  // Ends the current receive(), or else the next one, immediately.
  virtual void wake() = 0;
};

}  // namespace tessera
