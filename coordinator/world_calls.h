// Calls of clients about a world that is loaded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "coordinator/active_world.h"
#include "coordinator/command_checks.h"
#include "coordinator/context.h"
#include "coordinator/coordinator.h"

namespace tessera {

// Each function answers one call, at once or when its world has come to it: what waits is answered before the
// world ends.
class WorldCalls {
 public:
  template <typename Request, typename Answer>
  using Call = ClientCall<Request, Answer>;

  WorldCalls(const CoordinatorContext& context, ActiveWorld& world, Nanoseconds now)
      : context_(context), world_(world), now_(now) {}

  // Commands: checked, applied to the registry, sequenced and added to the journal.
  void on(Call<v1::SpawnRequest, v1::SpawnReply>& call);
  void on(Call<v1::AddJointRequest, v1::AddJointReply>& call);
  template <typename Request>
  void on(Call<Request, v1::CommandReply>& call);

  void on(Call<v1::PauseRequest, v1::PauseReply>& call);
  void on(Call<v1::ResumeRequest, v1::ResumeReply>& call);
  void on(Call<v1::StepRequest, v1::StepReply>& call);

  // Questions that servers answer.
  void on(Call<v1::SnapshotRequest, SnapshotChunks>& call);
  void on(Call<v1::HashRequest, v1::HashReply>& call);
  void on(Call<v1::RaycastRequest, v1::RaycastReply>& call);
  void on(Call<v1::NearRequest, v1::NearReply>& call);

  // Questions that the registry answers.
  void on(Call<v1::FindBodiesRequest, v1::FindBodiesReply>& call);
  void on(Call<v1::ListJointsRequest, v1::ListJointsReply>& call);
  void on(Call<v1::ListFramesRequest, v1::ListFramesReply>& call);

 private:
  absl::Status room_for_command(std::size_t shape_bytes) const;
  // `id`: of the object that the command creates, or 0.
  template <typename Request, typename Answer>
  void give(Call<Request, Answer>& call, Command command, std::optional<v1::NumberedShape> new_shape,
            std::uint64_t id);

  const CoordinatorContext& context_;
  ActiveWorld& world_;
  const Nanoseconds now_;
};

template <typename Request>
void WorldCalls::on(Call<Request, v1::CommandReply>& call) {
  if (absl::Status status = room_for_command(0); !status.ok()) return call.reply(status, {});
  absl::StatusOr<Command> command = checked(call.request, world_.registry);
  if (!command.ok()) return call.reply(command.status(), {});
  world_.registry.apply(*command, world_.sequencer.next_command_tick());
  give(call, *std::move(command), std::nullopt, 0);
}

template <typename Request, typename Answer>
void WorldCalls::give(Call<Request, Answer>& call, Command command,
                      std::optional<v1::NumberedShape> new_shape, std::uint64_t id) {
  const Tick at =
      world_.sequencer.submit(std::move(command), std::move(new_shape),
                              [id, reply = std::move(call.reply)](const absl::Status& status, Tick tick) {
                                Answer answer;
                                if (status.ok()) {
                                  answer.set_tick(tick);
                                  if constexpr (requires { answer.set_id(id); }) answer.set_id(id);
                                }
                                reply(status, answer);
                              });
  context_.journal.add(call.request, at, id, call.id);
}

}  // namespace tessera
