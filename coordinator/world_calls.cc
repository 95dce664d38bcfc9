#include "coordinator/world_calls.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "coordinator/limits.h"
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

// As that of the sequencer, and of the journal.
absl::Status WorldCalls::room_for_command(std::size_t shape_bytes) const {
  absl::Status status = context_.journal.room();
  return status.ok() ? world_.sequencer.room_for_command(shape_bytes) : status;
}

void WorldCalls::on(Call<v1::SpawnRequest, v1::SpawnReply>& call) {
  absl::Status room = room_for_command(call.request.shape().ByteSizeLong());
  if (!room.ok()) return call.reply(room, {});
  absl::StatusOr<WorldRegistry::Spawned> spawned = world_.registry.spawn(
      call.request, world_.sequencer.next_command_tick(), context_.options.shape_bytes_max);
  if (!spawned.ok()) return call.reply(spawned.status(), {});
  give(call, SpawnBody{spawned->record}, std::move(spawned->new_shape), spawned->record.id.value);
}

void WorldCalls::on(Call<v1::AddJointRequest, v1::AddJointReply>& call) {
  if (absl::Status status = room_for_command(0); !status.ok()) return call.reply(status, {});
  const absl::StatusOr<JointRecord> joint = world_.registry.add_joint(call.request);
  if (!joint.ok()) return call.reply(joint.status(), {});
  give(call, world_.registry.addition_of(*joint), std::nullopt, joint->id.value);
}

void WorldCalls::on(Call<v1::PauseRequest, v1::PauseReply>& call) {
  world_.sequencer.pause(with_tick(std::move(call.reply)));
}

void WorldCalls::on(Call<v1::ResumeRequest, v1::ResumeReply>& call) {
  Sequencer& sequencer = world_.sequencer;
  const absl::Status status = sequencer.resume(call.request.real_time_factor(), now_);
  if (status.ok()) world_.meter.start(sequencer.completed(), now_);
  with_tick(std::move(call.reply))(status, sequencer.completed());
}

void WorldCalls::on(Call<v1::StepRequest, v1::StepReply>& call) {
  world_.sequencer.step(call.request.ticks(), with_tick(std::move(call.reply)));
}

void WorldCalls::on(Call<v1::HashRequest, v1::HashReply>& call) {
  if (absl::Status status = world_.queries.room(); !status.ok()) return call.reply(status, {});
  world_.sequencer.ask(world_.queries.hash(
      [reply = std::move(call.reply)](const absl::Status& status, Tick tick, const WorldHash& hash) {
        v1::HashReply answer;
        if (status.ok()) {
          answer.set_tick(tick);
          answer.set_hash(hash.to_string());
        }
        reply(status, answer);
      }));
}

// What is held is taken down as it is now, and the servers are asked before they are granted any of it.
void WorldCalls::on(Call<v1::SnapshotRequest, SnapshotChunks>& call) {
  if (absl::Status status = world_.queries.room(); !status.ok()) return call.reply(status, {});
  const Tick tick = world_.sequencer.certain();
  SnapshotChunks chunks = head_chunks(with_held(world_, world_.registry.catalogue()), world_.settings,
                                      world_.anchor, tick, world_.registry.shapes().at(tick));
  world_.sequencer.ask_first(world_.queries.snapshot(
      v1::SnapshotQuery(),
      [chunks = std::move(chunks), reply = std::move(call.reply)](
          const absl::Status& status, std::vector<v1::SnapshotChunk> of_servers) mutable {
        if (!status.ok()) return reply(status, {});
        std::move(of_servers.begin(), of_servers.end(), std::back_inserter(chunks));
        chunks.push_back(end_chunk(chunks.size()));
        reply(status, chunks);
      }));
}

void WorldCalls::on(Call<v1::RaycastRequest, v1::RaycastReply>& call) {
  if (absl::Status status = world_.queries.room(); !status.ok()) return call.reply(status, {});
  const absl::StatusOr<v1::RayQuery> ray = checked(call.request, world_.registry);
  if (!ray.ok()) return call.reply(ray.status(), {});
  // The world calls this, so `world` exists.
  world_.sequencer.ask(
      world_.queries.ray(*ray, [&world = world_, ray = *ray, reply = std::move(call.reply)](
                                   const absl::Status& status, const Queries::RayResult& result) {
        v1::RaycastReply answer;
        if (!status.ok()) return reply(status, answer);
        answer.set_tick(result.tick);
        answer.set_hit(result.body.has_value());
        if (result.body) {
          answer.set_body(result.body->value);
          if (const auto* entry = world.registry.find(*result.body)) answer.set_name(entry->name);
          answer.set_distance(result.distance);
          *answer.mutable_normal() = result.normal;
          const Eigen::Vector3d way = result.distance * from_proto(ray.direction());
          const WorldPosition origin = from_proto(ray.origin());
          const auto position = canonical(origin.sector, origin.local + way, world.settings.sector_size);
          if (position.ok()) *answer.mutable_position() = to_proto(*position);
        }
        reply(absl::OkStatus(), answer);
      }));
}

void WorldCalls::on(Call<v1::NearRequest, v1::NearReply>& call) {
  if (absl::Status status = world_.queries.room(); !status.ok()) return call.reply(status, {});
  const absl::StatusOr<v1::NearQuery> near = checked(call.request, world_.registry);
  if (!near.ok()) return call.reply(near.status(), {});
  const std::uint64_t wanted = call.request.limit() == 0 ? kFoundBodiesDefault : call.request.limit();
  world_.sequencer.ask(world_.queries.near(
      *near, [&world = world_, limit = std::min(wanted, kFoundBodiesMax), reply = std::move(call.reply)](
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
          if (const auto* entry = world.registry.find(body)) found.set_name(entry->name);
        }
        reply(absl::OkStatus(), answer);
      }));
}

void WorldCalls::on(Call<v1::FindBodiesRequest, v1::FindBodiesReply>& call) {
  call.reply(absl::OkStatus(), world_.registry.find_bodies(call.request));
}

void WorldCalls::on(Call<v1::ListJointsRequest, v1::ListJointsReply>& call) {
  call.reply(absl::OkStatus(), world_.registry.list_joints(call.request));
}

void WorldCalls::on(Call<v1::ListFramesRequest, v1::ListFramesReply>& call) {
  call.reply(absl::OkStatus(), world_.registry.list_frames(call.request));
}

}  // namespace tessera
