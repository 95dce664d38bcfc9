// The sector servers of the cluster: which may join, and which have fallen silent.
#pragma once

#include <absl/status/status.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cluster.pb.h"
#include "lpss/model/world_description.h"
#include "proto/server_traits.h"
#include "transport/link.h"

namespace tessera {

// A server that has joined, with its latest report.
struct Server {
  NodeId node;
  Precision precision = Precision::kFloat32;
  std::uint32_t threads = 0;
  double capacity = 1;  // how much of a world it takes, by comparison with others
  Labels labels;
  std::string stream_address;
  std::chrono::nanoseconds last_heard{};
  std::chrono::nanoseconds patience{};          // how long it may be silent
  std::chrono::nanoseconds contact_patience{};  // how long it may be out of contact
  bool drained = false;                         // is to host nothing
  // When the transport lost contact; none while the server responds.
  std::optional<std::chrono::nanoseconds> suspect_since;
  // When it said first that it does not hear the coordinator; none while it does. It is lost when it says so
  // for longer than contact_patience: one that only stands still has said so once.
  std::optional<std::chrono::nanoseconds> deaf_since;

  // When it counts as lost unless it responds before then.
  std::chrono::nanoseconds deadline() const;

  std::uint64_t tick = 0;
  std::uint64_t map_epoch = 0;  // in effect at this server, of the world that it takes part in
  std::uint64_t bodies = 0;
  std::uint64_t peak_rss_bytes = 0;
  std::uint64_t exchange_bytes = 0;
  std::uint64_t exchange_messages = 0;
  v1::GroundTiles ground;
};

class Membership {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  // A server is lost after `timeout` of silence, or `contact_timeout` after the transport has lost contact.
  Membership(Nanoseconds timeout, Nanoseconds contact_timeout)
      : timeout_(timeout), contact_timeout_(contact_timeout) {}

  // Lets a server join; a member may say hello again. FAILED_PRECONDITION, with its value and ours, for
  // another protocol, layout or arithmetic; INVALID_ARGUMENT for an invalid hello; RESOURCE_EXHAUSTED beyond
  // kServersMax.
  absl::Status admit(NodeId node, const v1::Hello& hello, Nanoseconds now);

  // Null for a node that is not a member. Valid until the next admit() or remove().
  Server* find(NodeId node);
  const Server* find(NodeId node) const;

  void remove(NodeId node);

  // In the order in which they joined.
  const std::vector<Server>& servers() const { return servers_; }
  // Those of this precision that have all these labels, without drained ones.
  std::vector<NodeId> nodes_of(Precision precision, const Labels& required) const;

  // Gives every server at least until `time`.
  void spare_until(Nanoseconds time);

  // The servers whose deadlines have passed, and the next deadline.
  std::vector<NodeId> silent(Nanoseconds now) const;
  std::optional<Nanoseconds> next_deadline() const;

  Nanoseconds timeout() const { return timeout_; }
  Nanoseconds contact_timeout() const { return contact_timeout_; }

 private:
  Nanoseconds timeout_;
  Nanoseconds contact_timeout_;
  std::vector<Server> servers_;
};

// The name of a server in messages: its address in the cluster and that of its streams.
std::string title_of(const Server& server);

}  // namespace tessera
