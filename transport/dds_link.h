// The Link of a real cluster: over Cyclone DDS, between processes on one or many hosts.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "transport/dds_network.h"
#include "transport/link.h"

namespace tessera {

struct DdsOptions {
  // DDS domain: processes of different domains do not see each other. 0 to 232; those above 100 use port
  // numbers from Linux's ephemeral range.
  std::uint32_t domain = 0;
  // Clusters of different names share a domain without meeting. 1 to 64 bytes, any characters.
  std::string cluster = "tessera";
  DdsNetwork network;
  // Only one living process of a cluster may have this address.
  NodeId self;
};

// Between processes of one host and user, small messages go through shared memory (transport/host_lane.h),
// once DDS has introduced them. Messages of one pair of processes keep their order here. Sent messages are
// kept until the other process has taken them in receive(), so a connection that breaks and comes back, even
// after a long time, loses nothing.
//
// send(), receive() and the rest belong to one thread, which does not have to be the one that created the
// link; wake() belongs to any. Messages that have to wait, because their receiver is missing or too slow, are
// sent from within later calls of receive(). Destroying the link gives messages in transit a second to
// arrive.
//
// A failure of DDS itself during operation (out of memory, entities that cannot be created) ends the process
// with a message.
class DdsLink : public Link {
 public:
  // Settings come from CYCLONEDDS_URI if that environment variable is set, else from deploy/cyclonedds.xml as
  // built in, adapted to `network`. Errors: INVALID_ARGUMENT for a cluster name or domain out of bounds,
  // FAILED_PRECONDITION if other code has opened the domain, INTERNAL and RESOURCE_EXHAUSTED from DDS (no
  // network, no free port).
  static absl::StatusOr<std::unique_ptr<DdsLink>> create(const DdsOptions& options);

  ~DdsLink() override;

  NodeId self() const override;
  void send(NodeId to, std::string payload) override;
  std::vector<Delivery> receive(std::chrono::steady_clock::time_point deadline) override;
  // As above, but looks for `eager` at what comes from processes of this host before it sleeps: for answers
  // that are due within microseconds.
  std::vector<Delivery> receive(std::chrono::steady_clock::time_point deadline,
                                std::chrono::steady_clock::duration eager);
  void wake() override;

  // The processes we were connected to that have gone, or were replaced by others at the same address, since
  // the last call. A process that ends is noticed at once, one that is killed or cut off when its lease runs
  // out: after 1 to 1.4 s with the built-in settings. receive() then returns early: call this after
  // each receive().
  //
  // Messages sent to such a process, up to the receive() that noticed, arrive only if the same process
  // reappears (a reconnected cable); a successor at its address gets those sent afterwards.
  std::vector<NodeId> take_lost_peers();

  // Gives up the process that is, or last was, at address `peer`: drops messages kept for it, and ignores it
  // if it comes back. Messages sent to that address later are for its successor.
  void forget(NodeId peer);

  // Announces this process as the coordinator of the cluster, with `endpoint` for clients, unless another one
  // lives: ALREADY_EXISTS then names its endpoint. Waits for `discovery` to be sure. Of several that start at
  // the same time, the first wins. Effective until the link is destroyed; must not be called again after
  // success.
  absl::Status announce_coordinator(const std::string& endpoint,
                                    std::chrono::milliseconds discovery = std::chrono::milliseconds(500));

 private:
  class Impl;
  explicit DdsLink(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
