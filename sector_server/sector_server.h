// The sector server as a state machine: its partition of a world, driven by grants and by its peers'
// messages.
//
// It takes messages and returns messages, never blocks, and uses no socket or thread: the shell
// (sector_server/main.cc) or a simulation provides these. Messages may arrive in any order.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cluster.pb.h"
#include "daemon/log_line.h"
#include "lpss/tick/tick_machine.h"
#include "proto/server_traits.h"
#include "sector_server/sector_server_options.h"
#include "sector_server/world_run.h"
#include "transport/link.h"

namespace tessera {

class SectorServer {
 public:
  struct Outgoing {
    NodeId to;
    std::string payload;  // a serialised v1::ClusterMessage
  };

  // Called after each completed tick and after a load (with its tick), from within receive(): for streams.
  using TickObserver = std::function<void(Tick tick, TickMachine& machine)>;

  // `make_engine` loads the engine of a world; `clock` only measures work for reports; no decision depends on
  // it.
  SectorServer(const SectorServerOptions& options,
               std::function<absl::StatusOr<std::unique_ptr<Engine>>(const EngineSettings&)> make_engine,
               std::function<Nanoseconds()> clock, TickObserver observer);
  ~SectorServer();

  // Says hello to the coordinator. `self` is this process's address.
  void start(NodeId self, Nanoseconds now);

  // Accepts one message without processing it. While work_left(), the shell calls proceed(), which does one
  // round of one tick, and sends the resulting messages: so they leave as early as possible.
  void receive(NodeId from, v1::ClusterMessage message, Nanoseconds now);
  bool work_left() const;
  void proceed(Nanoseconds now);

  // Whether a tick is under way that goes on with messages of other servers.
  bool awaits_peers() const;

  // Does some of what needs nobody: worth a call once messages have been sent and before others are awaited.
  void work_while_waiting();

  void advance(Nanoseconds now);  // heartbeats, deadlines
  // The transport has lost contact with a process, which may have ended or only stalled.
  void suspect(NodeId node, Nanoseconds now);
  void leave(const std::string& reason);  // says goodbye; the server must end afterwards
  std::optional<Nanoseconds> next_deadline() const;

  std::vector<Outgoing> take_messages();

  // The machine of the loaded world while no tick is under way, for streams that begin; otherwise nullptr.
  TickMachine* machine_between_ticks();
  Tick tick() const;  // completed

  // Whether a coordinator has welcomed this server and responds.
  bool joined() const;
  // The report of the last tick of the loaded world; null before the first tick. Until the next call of
  // another function.
  const v1::TickReport* last_tick() const;
  WorldRun::Traffic traffic() const;  // with other servers, for the loaded world

  // Set when the server must end: OK after an orderly goodbye, otherwise the reason.
  const std::optional<absl::Status>& finished() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
