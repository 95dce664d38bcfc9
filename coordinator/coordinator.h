// The coordinator as a state machine: membership, the sector map, the sequence of commands and ticks.
//
// It takes messages, requests of clients and the time, and gives back messages and replies. It never blocks
// and knows no socket, thread or clock; the shell (coordinator/main.cc) has those, and so does a simulation.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/container/flat_hash_map.h>
#include <absl/status/status.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "cluster.pb.h"
#include "daemon/log_line.h"
#include "lpss/grid/sector_map.h"
#include "lpss/model/world_description.h"
#include "lpss/tick/messages.h"
#include "recording.pb.h"
#include "tessera.pb.h"
#include "transport/link.h"

namespace tessera {

using Nanoseconds = std::chrono::nanoseconds;  // since an arbitrary start; never goes back

// What a client asked, in protobuf's types, and where the answer goes. `Reply` is called once, from within
// handle(), receive() or advance(), with a status and (where OK) the answer.
template <typename Request, typename Answer>
struct ClientCall {
  Request request;
  std::function<void(absl::Status, const Answer&)> reply;
};

using ClientRequest = std::variant<
    ClientCall<v1::LoadRequest, v1::LoadReply>, ClientCall<v1::UnloadRequest, v1::UnloadReply>,
    ClientCall<v1::SpawnRequest, v1::SpawnReply>, ClientCall<v1::RemoveRequest, v1::CommandReply>,
    ClientCall<v1::SetVelocityRequest, v1::CommandReply>,
    ClientCall<v1::ApplyImpulseRequest, v1::CommandReply>,
    ClientCall<v1::ApplyForceRequest, v1::CommandReply>, ClientCall<v1::TeleportRequest, v1::CommandReply>,
    ClientCall<v1::KinematicTargetRequest, v1::CommandReply>,
    ClientCall<v1::AddJointRequest, v1::AddJointReply>, ClientCall<v1::RemoveJointRequest, v1::CommandReply>,
    ClientCall<v1::SetJointDrivesRequest, v1::CommandReply>,
    ClientCall<v1::ListJointsRequest, v1::ListJointsReply>, ClientCall<v1::PauseRequest, v1::PauseReply>,
    ClientCall<v1::ResumeRequest, v1::ResumeReply>, ClientCall<v1::StepRequest, v1::StepReply>,
    ClientCall<v1::StatusRequest, v1::StatusReply>, ClientCall<v1::HashRequest, v1::HashReply>,
    ClientCall<v1::RaycastRequest, v1::RaycastReply>, ClientCall<v1::NearRequest, v1::NearReply>,
    ClientCall<v1::FindBodiesRequest, v1::FindBodiesReply>,
    ClientCall<v1::ShutdownRequest, v1::ShutdownReply>>;

struct OutgoingMessage {
  NodeId to;
  v1::ClusterMessage message;
};

// Told what the state of a world follows from, in the order in which it takes effect.
using InputSink = std::function<void(const v1::RecordedInput&)>;

struct CoordinatorOptions {
  std::uint32_t servers_wanted = 0;  // a world is loaded on this many of its precision; 0: on all there are
  // Silence after which a server counts as lost. One that stalls and is heard again before has lost nothing.
  Nanoseconds server_timeout = std::chrono::seconds(10);
  Nanoseconds join_timeout = std::chrono::seconds(20);  // how long a load waits for wanted servers
  std::uint32_t grant_window = 32;                      // ticks granted ahead of the slowest server
  InputSink inputs;                                     // empty: ticks are not hashed, and nobody is told
  LogSink log;                                          // told what an operator should know; empty: nobody is
};

class DurationHistogram;

class Coordinator {
 public:
  explicit Coordinator(const CoordinatorOptions& options);
  ~Coordinator();

  // Each may add to the outgoing messages, which the shell then takes and sends.
  void handle(ClientRequest request, Nanoseconds now);
  void receive(NodeId from, const v1::ClusterMessage& message, Nanoseconds now);
  // The transport misses signs of life of a server, which may have ended or only stalled: it is a suspect
  // until it is heard again or counts as lost. False where it is no server of the cluster (any more).
  bool suspect(NodeId server, Nanoseconds now);
  void advance(Nanoseconds now);  // deadlines and pacing

  // When advance() must be called next; nullopt: not before something arrives.
  std::optional<Nanoseconds> next_deadline() const;
  std::vector<OutgoingMessage> take_messages();
  bool finished() const;  // after Shutdown, once the servers were told

  // How long each tick of the loaded world took the slowest server; null without a world. Like all else for
  // the thread that owns the coordinator, which is also that of a reply.
  const DurationHistogram* tick_durations() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
