// What clients do to a world, on the way to whoever writes it down.
#pragma once

#include <utility>

#include "coordinator/coordinator.h"
#include "coordinator/tick_statistics.h"
#include "recording.pb.h"

namespace tessera {

// Puts a request into the place that is meant for it.
inline void put(const v1::SpawnRequest& from, v1::RecordedCommand& to) { *to.mutable_spawn() = from; }
inline void put(const v1::RemoveRequest& from, v1::RecordedCommand& to) { *to.mutable_remove() = from; }
inline void put(const v1::SetVelocityRequest& from, v1::RecordedCommand& to) {
  *to.mutable_set_velocity() = from;
}
inline void put(const v1::ApplyImpulseRequest& from, v1::RecordedCommand& to) {
  *to.mutable_apply_impulse() = from;
}
inline void put(const v1::ApplyForceRequest& from, v1::RecordedCommand& to) {
  *to.mutable_apply_force() = from;
}
inline void put(const v1::TeleportRequest& from, v1::RecordedCommand& to) { *to.mutable_teleport() = from; }
inline void put(const v1::KinematicTargetRequest& from, v1::RecordedCommand& to) {
  *to.mutable_kinematic_target() = from;
}
inline void put(const v1::AddJointRequest& from, v1::RecordedCommand& to) { *to.mutable_add_joint() = from; }
inline void put(const v1::RemoveJointRequest& from, v1::RecordedCommand& to) {
  *to.mutable_remove_joint() = from;
}
inline void put(const v1::SetJointDrivesRequest& from, v1::RecordedCommand& to) {
  *to.mutable_set_joint_drives() = from;
}

template <typename Request>
concept CommandRequest = requires(const Request& request, v1::RecordedCommand& command) {
  put(request, command);
};

// From now on the call tells `record` what it asked for, once it is answered with OK. The sequencer answers
// commands in the order in which they take effect.
template <typename Request, typename Answer>
void record_on_reply(ClientCall<Request, Answer>& call, const InputSink& record) {
  if constexpr (CommandRequest<Request>) {
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

// Likewise a world that is loaded.
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

// The hash of a tick that all servers have reported.
inline v1::RecordedInput recorded(const TickSums& tick) {
  v1::RecordedInput input;
  input.mutable_hash()->set_tick(tick.tick);
  input.mutable_hash()->set_hash(tick.hash.to_string());
  return input;
}

}  // namespace tessera
