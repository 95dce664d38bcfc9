// Requests of clients about a loaded world.
#include <absl/strings/str_cat.h>

#include <iterator>
#include <span>
#include <utility>

#include "coordinator/command_checks.h"
#include "coordinator/coordinator_impl.h"
#include "coordinator/limits.h"
#include "coordinator/recording.h"
#include "proto/convert.h"
#include "proto/snapshot.h"

namespace tessera {
namespace {

// Adapts a reply with nothing but a tick to the sequencer's kind of reply.
template <typename Answer>
Sequencer::Reply with_tick(std::function<void(absl::Status, const Answer&)> reply) {
  return [reply = std::move(reply)](const absl::Status& status, Tick tick) {
    Answer answer;
    if (status.ok()) answer.set_tick(tick);
    reply(status, answer);
  };
}

}  // namespace

absl::StatusOr<ActiveWorld*> Coordinator::Impl::live_world() const {
  if (world_ && !world_->loading()) return world_.get();
  if (world_ || waiting_load_) return absl::FailedPreconditionError("the world is being loaded");
  if (failed_) return absl::UnavailableError(failed_->failure());
  return absl::FailedPreconditionError("no world is loaded");
}

void Coordinator::Impl::on(Call<v1::SpawnRequest, v1::SpawnReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  Sequencer& sequencer = (*world)->sequencer;
  const std::size_t shape_bytes = call.request.shape().ByteSizeLong();
  if (absl::Status status = room_for_command(sequencer, shape_bytes); !status.ok())
    return call.reply(status, {});
  absl::StatusOr<WorldRegistry::Spawned> spawned =
      (*world)->registry.spawn(call.request, sequencer.next_command_tick(), options_.shape_bytes_max);
  if (!spawned.ok()) return call.reply(spawned.status(), {});
  const BodyId id = spawned->record.id;
  const Tick at =
      sequencer.submit(SpawnBody{spawned->record}, std::move(spawned->new_shape),
                       [id, reply = std::move(call.reply)](const absl::Status& status, Tick tick) {
                         v1::SpawnReply answer;
                         if (status.ok()) {
                           answer.set_id(id.value);
                           answer.set_tick(tick);
                         }
                         reply(status, answer);
                       });
  store_command(call.request, at, id.value, call.id);
}

void Coordinator::Impl::on(Call<v1::AddJointRequest, v1::AddJointReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  Sequencer& sequencer = (*world)->sequencer;
  if (absl::Status status = room_for_command(sequencer, 0); !status.ok()) return call.reply(status, {});
  const absl::StatusOr<JointRecord> joint = (*world)->registry.add_joint(call.request);
  if (!joint.ok()) return call.reply(joint.status(), {});
  const Tick at = sequencer.submit(
      (*world)->registry.addition_of(*joint), std::nullopt,
      [id = joint->id, reply = std::move(call.reply)](const absl::Status& status, Tick tick) {
        v1::AddJointReply answer;
        if (status.ok()) {
          answer.set_id(id.value);
          answer.set_tick(tick);
        }
        reply(status, answer);
      });
  store_command(call.request, at, joint->id.value, call.id);
}

template <typename Request>
void Coordinator::Impl::on(Call<Request, v1::CommandReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  Sequencer& sequencer = (*world)->sequencer;
  if (absl::Status status = room_for_command(sequencer, 0); !status.ok()) return call.reply(status, {});
  absl::StatusOr<Command> command = checked(call.request, (*world)->registry);
  if (!command.ok()) return call.reply(command.status(), {});
  (*world)->registry.apply(*command, sequencer.next_command_tick());
  const Tick at = sequencer.submit(*std::move(command), std::nullopt, with_tick(std::move(call.reply)));
  store_command(call.request, at, 0, call.id);
}

void Coordinator::Impl::on(Call<v1::PauseRequest, v1::PauseReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  (*world)->sequencer.pause(with_tick(std::move(call.reply)));
}

void Coordinator::Impl::on(Call<v1::ResumeRequest, v1::ResumeReply>& call, Nanoseconds now) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  Sequencer& sequencer = (*world)->sequencer;
  const absl::Status status = sequencer.resume(call.request.real_time_factor(), now);
  if (status.ok()) (*world)->meter.start(sequencer.completed(), now);
  with_tick(std::move(call.reply))(status, sequencer.completed());
}

void Coordinator::Impl::on(Call<v1::StepRequest, v1::StepReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  (*world)->sequencer.step(call.request.ticks(), with_tick(std::move(call.reply)));
}

void Coordinator::Impl::on(Call<v1::HashRequest, v1::HashReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  Queries& queries = (*world)->queries;
  if (absl::Status status = queries.room(); !status.ok()) return call.reply(status, {});
  (*world)->sequencer.ask(queries.hash(
      [reply = std::move(call.reply)](const absl::Status& status, Tick tick, const WorldHash& hash) {
        v1::HashReply answer;
        if (status.ok()) {
          answer.set_tick(tick);
          answer.set_hash(hash.to_string());
        }
        reply(status, answer);
      }));
}

// With the name, too.
WorldCatalogue Coordinator::Impl::with_held(const ActiveWorld& world, WorldCatalogue catalogue) {
  catalogue.name = world.name;
  const ShapeTable& shapes = world.registry.shapes();
  for (Sequencer::Held& batch : world.sequencer.held()) {
    WorldCatalogue::HeldBatch& held = catalogue.held.emplace_back();
    held.commands = std::move(batch.commands);
    for (const v1::NumberedShape& shape : batch.new_shapes)
      held.new_shapes.push_back({shape.id(), shapes.ref(shape.id())});
  }
  return catalogue;
}

// What is held is taken down as it is now, and the servers are asked before they are granted any of it.
void Coordinator::Impl::on(Call<v1::SnapshotRequest, SnapshotChunks>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> live = live_world();
  if (!live.ok()) return call.reply(live.status(), {});
  ActiveWorld& world = **live;
  if (absl::Status status = world.queries.room(); !status.ok()) return call.reply(status, {});
  const Tick tick = world.sequencer.certain();
  SnapshotChunks chunks = head_chunks(with_held(world, world.registry.catalogue()), world.settings,
                                      world.anchor, tick, world.registry.shapes().at(tick));
  world.sequencer.ask_first(world.queries.snapshot(
      v1::SnapshotQuery(),
      [chunks = std::move(chunks), reply = std::move(call.reply)](
          const absl::Status& status, std::vector<v1::SnapshotChunk> of_servers) mutable {
        if (!status.ok()) return reply(status, {});
        std::move(of_servers.begin(), of_servers.end(), std::back_inserter(chunks));
        chunks.push_back(end_chunk(chunks.size()));
        reply(status, chunks);
      }));
}

void Coordinator::Impl::on(Call<v1::RaycastRequest, v1::RaycastReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> live = live_world();
  if (!live.ok()) return call.reply(live.status(), {});
  ActiveWorld* world = *live;
  if (absl::Status status = world->queries.room(); !status.ok()) return call.reply(status, {});
  const absl::StatusOr<v1::RayQuery> ray = checked(call.request, world->registry);
  if (!ray.ok()) return call.reply(ray.status(), {});
  // The world calls this, so `world` exists.
  world->sequencer.ask(
      world->queries.ray(*ray, [world, ray = *ray, reply = std::move(call.reply)](
                                   const absl::Status& status, const Queries::RayResult& result) {
        v1::RaycastReply answer;
        if (!status.ok()) return reply(status, answer);
        answer.set_tick(result.tick);
        answer.set_hit(result.body.has_value());
        if (result.body) {
          answer.set_body(result.body->value);
          if (const auto* entry = world->registry.find(*result.body)) answer.set_name(entry->name);
          answer.set_distance(result.distance);
          *answer.mutable_normal() = result.normal;
          const Eigen::Vector3d way = result.distance * from_proto(ray.direction());
          const WorldPosition origin = from_proto(ray.origin());
          const auto position = canonical(origin.sector, origin.local + way, world->settings.sector_size);
          if (position.ok()) *answer.mutable_position() = to_proto(*position);
        }
        reply(absl::OkStatus(), answer);
      }));
}

void Coordinator::Impl::on(Call<v1::NearRequest, v1::NearReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> live = live_world();
  if (!live.ok()) return call.reply(live.status(), {});
  ActiveWorld* world = *live;
  if (absl::Status status = world->queries.room(); !status.ok()) return call.reply(status, {});
  const absl::StatusOr<v1::NearQuery> near = checked(call.request, world->registry);
  if (!near.ok()) return call.reply(near.status(), {});
  const std::uint64_t wanted = call.request.limit() == 0 ? kFoundBodiesDefault : call.request.limit();
  world->sequencer.ask(world->queries.near(
      *near, [world, limit = std::min(wanted, kFoundBodiesMax), reply = std::move(call.reply)](
                 const absl::Status& status, const Queries::NearResult& result) {
        v1::NearReply answer;
        if (!status.ok()) return reply(status, answer);
        answer.set_tick(result.tick);
        std::vector<std::pair<double, BodyId>> nearest;
        for (const auto& [body, distance] : result.distances) nearest.emplace_back(distance, body);
        std::sort(nearest.begin(), nearest.end());
        answer.set_truncated(nearest.size() > limit);
        if (nearest.size() > limit) nearest.resize(limit);
        for (const auto& [distance, body] : nearest) {
          v1::NearReply::Found& found = *answer.add_bodies();
          found.set_id(body.value);
          found.set_distance(distance);
          if (const auto* entry = world->registry.find(body)) found.set_name(entry->name);
        }
        reply(absl::OkStatus(), answer);
      }));
}

void Coordinator::Impl::on(Call<v1::FindBodiesRequest, v1::FindBodiesReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  call.reply(absl::OkStatus(), (*world)->registry.find_bodies(call.request));
}

void Coordinator::Impl::on(Call<v1::ListJointsRequest, v1::ListJointsReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  call.reply(absl::OkStatus(), (*world)->registry.list_joints(call.request));
}

void Coordinator::Impl::on(Call<v1::ListFramesRequest, v1::ListFramesReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> world = live_world();
  if (!world.ok()) return call.reply(world.status(), {});
  call.reply(absl::OkStatus(), (*world)->registry.list_frames(call.request));
}

void Coordinator::Impl::on(Call<v1::ShutdownRequest, v1::ShutdownReply>& call, Nanoseconds) {
  shut_down("the cluster is shutting down");
  call.reply(absl::OkStatus(), {});
}

template void Coordinator::Impl::on(Call<v1::RemoveRequest, v1::CommandReply>&, Nanoseconds);
template void Coordinator::Impl::on(Call<v1::SetVelocityRequest, v1::CommandReply>&, Nanoseconds);
template void Coordinator::Impl::on(Call<v1::ApplyImpulseRequest, v1::CommandReply>&, Nanoseconds);
template void Coordinator::Impl::on(Call<v1::ApplyForceRequest, v1::CommandReply>&, Nanoseconds);
template void Coordinator::Impl::on(Call<v1::TeleportRequest, v1::CommandReply>&, Nanoseconds);
template void Coordinator::Impl::on(Call<v1::SurfaceMotionRequest, v1::CommandReply>&, Nanoseconds);
template void Coordinator::Impl::on(Call<v1::KinematicTargetRequest, v1::CommandReply>&, Nanoseconds);
template void Coordinator::Impl::on(Call<v1::RemoveJointRequest, v1::CommandReply>&, Nanoseconds);
template void Coordinator::Impl::on(Call<v1::SetJointDrivesRequest, v1::CommandReply>&, Nanoseconds);

}  // namespace tessera
