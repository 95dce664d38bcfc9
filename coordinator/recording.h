// Reports what clients do to a world to whoever records it.
#pragma once

#include <google/protobuf/descriptor.h>

#include <concepts>
#include <utility>

#include "coordinator/coordinator.h"
#include "coordinator/tick_statistics.h"
#include "lpss/base/invariant.h"
#include "recording.pb.h"

namespace tessera {

// For a command: the tick at whose beginning it takes effect, and the id of the object that it creates.
template <typename Answer>
concept CommandAnswer = std::same_as<Answer, v1::CommandReply> || requires(const Answer& answer) {
  answer.tick();
  answer.id();
};

// The field of a recorded command for a request of this type; null if there is none.
inline const google::protobuf::FieldDescriptor* field_for(const google::protobuf::Descriptor* request) {
  const google::protobuf::OneofDescriptor* fields =
      v1::RecordedCommand::descriptor()->FindOneofByName("request");
  for (int place = 0; place < fields->field_count(); ++place) {
    if (fields->field(place)->message_type() == request) return fields->field(place);
  }
  return nullptr;
}

template <typename Request>
void put(const Request& request, v1::RecordedCommand& command) {
  static const google::protobuf::FieldDescriptor* const field = field_for(Request::descriptor());
  invariant(field != nullptr, "every command can be recorded");
  command.GetReflection()->MutableMessage(&command, field)->CopyFrom(request);
}

// Makes the call report its request to `record` once it is answered with OK. The sequencer answers commands
// in the order in which they take effect.
template <typename Request, typename Answer>
void record_on_reply(ClientCall<Request, Answer>& call, const InputSink& record) {
  if constexpr (CommandAnswer<Answer>) {
    call.reply = [record, request = call.request, reply = std::move(call.reply)](const absl::Status& status,
                                                                                 const Answer& answer) {
      if (status.ok()) {
        v1::RecordedInput input;
        v1::RecordedCommand& command = *input.mutable_command();
        command.set_tick(answer.tick());
        if constexpr (requires { answer.id(); }) command.set_id(answer.id());
        put(request, command);
        record(input);
      }
      reply(status, answer);
    };
  }
}

// Likewise for a world that is loaded.
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

// The hash of a tick that all servers have reported.
inline v1::RecordedInput recorded(const TickSums& tick) {
  v1::RecordedInput input;
  input.mutable_hash()->set_tick(tick.tick);
  input.mutable_hash()->set_hash(tick.hash.to_string());
  return input;
}

}  // namespace tessera
