// What keeps a world alive when servers are lost: checkpoints, and going on from one on those that are there,
// which repeat the ticks since. The state is a function of a checkpoint and of the commands
// since, so nothing that clients were told becomes untrue.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "coordinator/coordinator_impl.h"
#include "coordinator/limits.h"

namespace tessera {
void Coordinator::Impl::tend_checkpoints(Nanoseconds now) {
  ActiveWorld& world = *world_;
  if (!world.checkpoints) return world.registry.shapes().drop_before(world.sequencer.certain());
  if (auto fresh = std::exchange(world.fresh_checkpoint, std::nullopt)) {
    const KeptChunks& changes =
        world.checkpoints->add(fresh->tick, std::move(fresh->chunks), fresh->are_all, now);
    if (stores()) store_checkpoint(changes, fresh->position);
  } else {
    world.checkpoints->settle(now);
  }
  world.sequencer.forget_past(world.checkpoints->earliest());
  world.registry.shapes().drop_before(world.checkpoints->earliest());
  if (may_ask_for_checkpoint() && now >= world.next_checkpoint) {
    world.next_checkpoint = now + options_.checkpoint_every;
    ask_for_checkpoint();
  }
}

// Whether none is under way, and the world has gone on since the last.
bool Coordinator::Impl::may_ask_for_checkpoint() const {
  return world_->checkpoints && !world_->recovering() && !world_->awaits_checkpoint &&
         world_->sequencer.certain() > world_->checkpoints->latest();
}

void Coordinator::Impl::ask_for_checkpoint() {
  ActiveWorld* world = world_.get();
  if (!world->queries.room().ok()) return;
  world->awaits_checkpoint = true;
  FreshCheckpoint next;
  next.tick = world->sequencer.certain();
  next.are_all = !world->servers_keep_up;
  if (stores()) {
    take_down_catalogue();
    next.position = stored_position();
  }
  v1::SnapshotQuery query;
  query.set_keeps(true);
  query.set_anew(next.are_all);
  // The world calls this, so `world` exists.
  world->sequencer.ask_first(world->queries.snapshot(
      query, [world, left = world->left_servers, next = std::move(next)](
                 const absl::Status& status, std::vector<v1::SnapshotChunk> chunks) mutable {
        world->awaits_checkpoint = false;
        if (!status.ok()) return;
        // One that has left meanwhile does not tell what has become of its sectors since.
        world->servers_keep_up = left == world->left_servers;
        next.chunks = std::move(chunks);
        world->fresh_checkpoint = std::move(next);
      }));
}

// Waits a moment for more servers than have come.
void Coordinator::Impl::gather(Nanoseconds now) {
  const std::size_t servers = chosen_nodes(world_->settings.precision).size();
  if (servers == 0) return;
  if (options_.servers_wanted > 0 && servers == options_.servers_wanted) {
    recover();
  } else if (!world_->gathers_until) {
    world_->gathers_until = now + kGatherServers;
  }
}

// Goes on from the earliest checkpoint on the servers that are there, or waits for one.
void Coordinator::Impl::recover() {
  ActiveWorld& world = *world_;
  world.gathers_until.reset();
  std::vector<NodeId> before = std::exchange(world.nodes, ranked(chosen_nodes(world.settings.precision)));
  if (world.guest) before.push_back(world.guest->node);
  world.guest.reset();
  world.leaving.reset();
  world.unfit.clear();
  world.shares_left = 0;
  world.awaits_load = false;
  world.fresh_load.reset();
  for (const NodeId node : before) {
    const bool stays = std::find(world.nodes.begin(), world.nodes.end(), node) != world.nodes.end();
    if (!stays && members_.find(node) != nullptr) send(node).mutable_unload_world()->set_world(world.number);
  }
  const Tick tick = world.checkpoints->earliest();
  const std::size_t servers = world.nodes.size();
  world.number = ++worlds_;
  world.ready.assign(servers, false);
  world.servers_keep_up = false;
  world.sequencer.rewind(world.number, servers, tick);
  world.statistics.restart(world.nodes);
  const absl::Status sorry =
      absl::UnavailableError("the world was set back, for its servers have changed: ask again");
  for (v1::Query& query : world.queries.restart(sorry)) world.sequencer.ask(std::move(query));
  if (servers == 0) {
    log(absl::StrCat("the world '", world.name, "' waits for a server of ",
                     described_servers(world.settings.precision)),
        Severity::kWarning);
    return;
  }
  absl::StatusOr<Placement> placement = world.checkpoints->place_earliest(
      world.number, world.settings, world.anchor, world.registry.shapes().at(tick), hosts(world.nodes),
      world.map.epoch() + 1, options_.balance_policy);
  if (!placement.ok()) {
    fail_world(absl::StrCat("it cannot go on from tick ", tick, ": ", placement.status().message()),
               placement.status().code(), {});
    return;
  }
  world.map = placement->map;
  hand_over_streams(*placement);
  send_loads(*std::move(placement), tick);
  log(absl::StrCat("the world '", world.name, "' goes on from tick ", tick, " on ", servers, " servers"));
}

// The streams that clients have at any server of the world go on at all that it has now.
void Coordinator::Impl::hand_over_streams(Placement& placement) {
  const v1::Subscriptions all = all_subscriptions();
  world_->subscriptions.clear();
  for (std::size_t rank = 0; rank < world_->nodes.size(); ++rank) {
    *placement.loads[rank].mutable_subscriptions() = all.all();
    world_->subscriptions[world_->nodes[rank]] = all;
  }
}

void Coordinator::Impl::go_on_again() {
  ++world_->recoveries;
  log(absl::StrCat("the world '", world_->name, "' is on ", world_->nodes.size(), " servers, which repeat ",
                   world_->sequencer.certain() - world_->checkpoints->earliest(), " ticks"));
  answer_drains();
}

// A world that loses servers again and again at the same place would do so for ever.
bool Coordinator::Impl::may_recover() {
  ActiveWorld& world = *world_;
  if (world.loading() || !world.checkpoints) return false;
  if (world.sequencer.completed() > world.last_loss) world.losses_in_place = 0;
  world.last_loss = world.sequencer.completed();
  return ++world.losses_in_place <= kLossesInPlaceMax;
}

}  // namespace tessera
