// The coordinator as a state machine: membership, the sector map, the sequence of commands and ticks.
//
// It takes messages, requests of clients and the time, and returns messages and replies. It never blocks and
// uses no socket, thread or clock: the shell (coordinator/main.cc) or a simulation provides these.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "cluster.pb.h"
#include "coordinator/balance_policy.h"
#include "coordinator/coordinator_options.h"
#include "coordinator/limits.h"
#include "coordinator/role_work.h"
#include "coordinator/world_store.h"
#include "daemon/log_line.h"
#include "lpss/grid/sector_map.h"
#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"
#include "proto/server_traits.h"
#include "recording.pb.h"
#include "tessera.pb.h"
#include "transport/link.h"

namespace tessera {

// Which request of a client it is: one that is made again, since its reply was lost, has the same id. Session
// 0: none.
struct RequestId {
  std::uint64_t session = 0;  // drawn by the client
  std::uint64_t number = 0;   // counts its requests
};

// A client's request, in protobuf's types, and the receiver of its answer. `Reply` is called once, from
// within handle(), receive(), advance() or take_messages(), with a status and, if that is OK, the answer.
template <typename Request, typename Answer>
struct ClientCall {
  Request request;
  std::function<void(absl::Status, const Answer&)> reply;
  RequestId id = {};
  std::optional<ClientRole> role = {};  // of the client; none: the process itself asks
};

// What streams of chunks bring in and take out.
struct RestoreChunks {
  bool replace = false;
  bool replay = false;
  std::vector<v1::SnapshotChunk> chunks;
};
using SnapshotChunks = std::vector<v1::SnapshotChunk>;

using ClientRequest =
    std::variant<ClientCall<v1::SnapshotRequest, SnapshotChunks>, ClientCall<RestoreChunks, v1::LoadReply>,
                 ClientCall<v1::LoadRequest, v1::LoadReply>, ClientCall<v1::UnloadRequest, v1::UnloadReply>,
                 ClientCall<v1::Request, v1::Reply>, ClientCall<v1::PauseRequest, v1::PauseReply>,
                 ClientCall<v1::ResumeRequest, v1::ResumeReply>,
                 ClientCall<v1::StatusRequest, v1::StatusReply>, ClientCall<v1::DrainRequest, v1::DrainReply>,
                 ClientCall<v1::BalanceRequest, v1::BalanceReply>,
                 ClientCall<v1::ShutdownRequest, v1::ShutdownReply>>;

struct OutgoingMessage {
  NodeId to;
  v1::ClusterMessage message;
};

class DurationHistogram;

class Coordinator {
 public:
  explicit Coordinator(const CoordinatorOptions& options);
  ~Coordinator();

  // Goes on with the world that is stored, if there is one, as soon as servers have joined. Before all
  // others. Errors of reading it; then nothing has changed.
  absl::Status resume_stored();

  // Each call may add outgoing messages, which the shell then takes and sends.
  // Requests, until `next` has none: what they bring is stored, and goes out, together.
  void handle(const std::function<std::optional<ClientRequest>()>& next, Nanoseconds now);
  void handle(ClientRequest request, Nanoseconds now);
  void receive(NodeId from, v1::ClusterMessage message, Nanoseconds now);
  // The transport has lost contact with a server, which may have ended or only stalled: it is a suspect until
  // it responds again or counts as lost. False if it is not, or is no longer, a server of the cluster.
  bool suspect(NodeId server, Nanoseconds now);
  // The process of a server has ended.
  void ended(NodeId server, Nanoseconds now);
  void advance(Nanoseconds now);  // deadlines and pacing
  // Ends, and leaves a world that is stored to the coordinator that takes its place; without a store, as
  // after Shutdown.
  void retire();
  // Ends at once, without a word to servers: another coordinator leads. Calls that wait get UNAVAILABLE.
  void abandon();

  // When advance() must be called next; nullopt: not before a message arrives.
  std::optional<Nanoseconds> next_deadline() const;
  // May also answer calls that waited for the store.
  std::vector<OutgoingMessage> take_messages();
  // Where the servers of the cluster serve streams.
  std::map<NodeId, std::string> server_addresses() const;
  bool finished() const;  // after Shutdown, once the servers have been notified

  // The duration of each tick of the loaded world on its slowest server; null without a world. Like
  // everything else, only for the thread that owns the coordinator, which is also the thread of the replies.
  const DurationHistogram* tick_durations() const;
  // What the requests of clients have cost; likewise.
  const RoleWork::ByRole& costs_by_role() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
