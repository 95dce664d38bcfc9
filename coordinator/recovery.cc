// What keeps a world alive when servers are lost, join or are to leave: checkpoints, and going on from one on
// other servers, which repeat the ticks since. The state is a function of a checkpoint and of the commands
// since, so nothing that clients were told becomes untrue.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <string>
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
  if (!world.recovering() && wants_to_move()) {
    recover();
  } else if (may_ask_for_checkpoint() && now >= world.next_checkpoint) {
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
      query, [world, next = std::move(next)](const absl::Status& status,
                                             std::vector<v1::SnapshotChunk> chunks) mutable {
        world->awaits_checkpoint = false;
        if (!status.ok()) return;
        world->servers_keep_up = true;
        next.chunks = std::move(chunks);
        world->fresh_checkpoint = std::move(next);
      }));
}

// Whether other servers than those that host the world are there for it.
bool Coordinator::Impl::wants_to_move() const {
  const std::vector<NodeId> chosen = chosen_nodes(world_->settings.precision);
  return !chosen.empty() && chosen != world_->nodes;
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
  const std::vector<NodeId> before = std::exchange(world.nodes, chosen_nodes(world.settings.precision));
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
  world.statistics.restart(servers);
  const absl::Status sorry =
      absl::UnavailableError("the world was set back, for its servers have changed: ask again");
  for (v1::Query& query : world.queries.restart(servers, sorry)) world.sequencer.ask(std::move(query));
  if (servers == 0) {
    log(absl::StrCat("the world '", world.name, "' waits for a server of precision ",
                     name_of(world.settings.precision)),
        Severity::kWarning);
    return;
  }
  absl::StatusOr<Placement> placement = world.checkpoints->place_earliest(
      world.number, world.settings, world.anchor, world.registry.shapes().at(tick), world.nodes,
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
  v1::Subscriptions all;
  std::set<std::string> known;
  for (const auto& [node, subscriptions] : world_->subscriptions) {
    for (const v1::Subscription& subscription : subscriptions.all()) {
      if (all.all_size() >= kSubscriptionsMax || !known.insert(subscription.SerializeAsString()).second)
        continue;
      *all.add_all() = subscription;
    }
  }
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

void Coordinator::Impl::on(Call<v1::DrainRequest, v1::DrainReply>& call, Nanoseconds) {
  Server* server = members_.find(NodeId{call.request.node()});
  if (server == nullptr) {
    return call.reply(absl::NotFoundError(absl::StrCat("node ", absl::Hex(call.request.node()),
                                                       " is not a server of this cluster")),
                      {});
  }
  if (world_ && world_->rank_of(server->node)) {
    if (!world_->checkpoints) {
      return call.reply(absl::FailedPreconditionError(
                            "the world cannot move: the coordinator was started without checkpoints"),
                        {});
    }
    const std::vector<NodeId> others = members_.nodes_of(server->precision);
    if (std::all_of(others.begin(), others.end(), [&](NodeId node) { return node == server->node; })) {
      return call.reply(absl::FailedPreconditionError(absl::StrCat(
                            "no other server of precision ", name_of(server->precision), " could take over")),
                        {});
    }
  }
  if (drains_.size() >= kWaitingCallsMax) {
    return call.reply(
        absl::ResourceExhaustedError(absl::StrCat(drains_.size(), " calls wait for servers already")), {});
  }
  server->drained = true;
  drains_.push_back({server->node, std::move(call.reply)});
  answer_drains();
}

// Those whose servers host nothing.
void Coordinator::Impl::answer_drains() {
  std::vector<Drain> waiting;
  for (Drain& drain : std::exchange(drains_, {})) {
    if (world_ && world_->rank_of(drain.node)) {
      waiting.push_back(std::move(drain));
      continue;
    }
    v1::DrainReply reply;
    if (world_) reply.set_tick(world_->sequencer.completed());
    drain.reply(absl::OkStatus(), reply);
  }
  std::move(waiting.begin(), waiting.end(), std::back_inserter(drains_));
}

}  // namespace tessera
