// Reports worlds that clients load, and what becomes of them, to whoever records that.
#pragma once

#include <utility>
#include <variant>

#include "coordinator/coordinator.h"
#include "coordinator/stored_inputs.h"
#include "coordinator/tick_statistics.h"
#include "recording.pb.h"

namespace tessera {

// Makes the call report the world that it loads to `record` once it is answered with OK. Other calls load
// none.
template <typename Request, typename Answer>
void record_on_reply(ClientCall<Request, Answer>&, const InputSink&) {}

inline void record_on_reply(ClientCall<v1::LoadRequest, v1::LoadReply>& call, const InputSink& record) {
  call.reply = [record, world = call.request.world(), reply = std::move(call.reply)](
                   const absl::Status& status, const v1::LoadReply& answer) {
    if (status.ok()) {
      v1::RecordedInput input;
      *input.mutable_world() = world;
      record(input);
    }
    reply(status, answer);
  };
}

inline void record_on_reply(ClientCall<RestoreChunks, v1::LoadReply>& call, const InputSink& record) {
  call.reply = [record, chunks = call.request.chunks, reply = std::move(call.reply)](
                   const absl::Status& status, const v1::LoadReply& answer) {
    for (const v1::SnapshotChunk& chunk : status.ok() ? chunks : SnapshotChunks()) {
      v1::RecordedInput input;
      *input.mutable_snapshot() = chunk;
      record(input);
    }
    reply(status, answer);
  };
}

inline v1::RecordedInput recorded(v1::RecordedCommands commands) {
  v1::RecordedInput input;
  *input.mutable_commands() = std::move(commands);
  return input;
}

// A world that begins anew, with other inputs than were recorded.
inline void record_anew(const StoredWorld& stored, const GivenInputs& inputs, const InputSink& record) {
  v1::RecordedInput input;
  if (const auto* world = std::get_if<v1::World>(&stored.state)) {
    *input.mutable_world() = *world;
    record(input);
  } else {
    for (const v1::SnapshotChunk& chunk : std::get<SnapshotChunks>(stored.state)) {
      *input.mutable_snapshot() = chunk;
      record(input);
    }
  }
  for (const v1::RecordedCommands* commands : inputs.given) record(recorded(*commands));
}

// The hash of a tick that all servers have reported.
inline v1::RecordedInput recorded(const TickSums& tick) {
  v1::RecordedInput input;
  input.mutable_hash()->set_tick(tick.tick);
  input.mutable_hash()->set_hash(tick.hash.to_string());
  if (tick.programs != WorldHash()) input.mutable_hash()->set_programs(tick.programs.to_string());
  return input;
}

}  // namespace tessera
