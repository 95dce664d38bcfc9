// The status of the coordinator, its servers and its world.
#include "coordinator/coordinator_impl.h"
#include "proto/convert.h"
#include "proto/convert_counts.h"

namespace tessera {

void Coordinator::Impl::on(Call<v1::StatusRequest, v1::StatusReply>& call, Nanoseconds now) {
  call.reply(absl::OkStatus(), status(now));
}

const char* Coordinator::Impl::state() const {
  if (world_) {
    if (world_->loading()) return "loading";
    if (world_->recovering()) return "recovering";
    return world_->sequencer.paused() ? "paused" : "running";
  }
  if (waiting_load_) return "loading";
  return failed_ ? "failed" : "empty";
}

v1::StatusReply Coordinator::Impl::status(Nanoseconds now) const {
  v1::StatusReply reply;
  if (world_) {
    describe_world(reply, now);
  } else if (failed_ && !waiting_load_) {
    reply = *failed_;
    reply.clear_servers();
  } else if (waiting_load_) {
    reply.set_world(waiting_load_->world.name());
  }
  reply.set_state(state());
  reply.set_store_failure(store_.failure.empty() ? store_.state_failure : store_.failure);
  reply.set_waits_for_store(waits_for_store());
  for (const Server& server : members_.servers()) describe_server(server, *reply.add_servers());
  return reply;
}

void Coordinator::Impl::describe_world(v1::StatusReply& reply, Nanoseconds now) const {
  const TickStatistics& statistics = world_->statistics;
  const TickSums& last = statistics.last();
  const Tick tick = world_->sequencer.completed();
  reply.set_world(world_->name);
  reply.set_tick(tick);
  reply.set_time(static_cast<double>(tick) * world_->settings.time_step);
  reply.set_real_time_factor(world_->meter.factor(world_->settings.time_step, now));
  reply.set_bodies(world_->registry.body_count());
  TickCounts counts = last.counts;
  if (last.tick == 0) counts.sectors = world_->sectors;
  write(counts, *reply.mutable_counts());
  write(statistics.counts_since_load(), *reply.mutable_counts_since_load());
  write(statistics.durations().times(), *reply.mutable_tick_ms());
  for (const Divergence& divergence : statistics.divergences()) {
    v1::Divergence& told = *reply.add_divergences();
    told = to_proto(divergence);
    if (const auto* body = world_->registry.find(divergence.body)) told.set_body_name(body->name);
    if (const auto* joint = world_->registry.joints().find(divergence.joint))
      told.set_joint_name(joint->name);
  }
  reply.set_map_epoch(world_->map.epoch());
  reply.set_moved_sectors(world_->moved_sectors);
  reply.set_moved_bodies(world_->moved_bodies);
  reply.set_joined_servers(world_->joined_servers);
  reply.set_left_servers(world_->left_servers);
  reply.set_load(world_->load);
  reply.set_recoveries(world_->recoveries);
  if (world_->checkpoints) reply.set_checkpoint_tick(world_->checkpoints->latest());
  *reply.mutable_settings() = to_proto(world_->settings);
  *reply.mutable_anchor() = to_proto(world_->anchor);
}

void Coordinator::Impl::describe_server(const Server& server, v1::ServerStatus& status) const {
  status.set_node(server.node.value);
  status.set_stream_address(server.stream_address);
  status.set_precision(to_proto(server.precision));
  status.set_threads(server.threads);
  status.set_capacity(server.capacity);
  status.mutable_labels()->Add(server.labels.begin(), server.labels.end());
  status.set_peak_rss_bytes(server.peak_rss_bytes);
  const std::optional<std::size_t> rank = world_ ? world_->rank_of(server.node) : std::nullopt;
  status.set_suspect(server.suspect_since.has_value());
  status.set_takes_part(rank.has_value());
  status.set_drained(server.drained);
  if (!rank) return;
  const v1::TickReport& last = world_->statistics.last_of(server.node);
  status.set_tick(server.tick);
  status.set_bodies(server.bodies);
  write(counts_from(last.counts()), *status.mutable_counts());
  write(world_->statistics.durations_of(server.node).times(), *status.mutable_tick_ms());
  status.set_exchange_bytes(server.exchange_bytes);
  status.set_exchange_messages(server.exchange_messages);
  if (server.ground.tiles() > 0) *status.mutable_ground() = server.ground;
  status.set_own_ms(world_->statistics.own_ms_of(server.node));
  status.set_slow(world_->statistics.slow() == server.node);
}

}  // namespace tessera
