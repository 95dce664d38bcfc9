// Servers that begin to take part in a running world, and those that leave it: changes of the map between two
// ticks, as others, that nobody goes back for.
//
// One that is to take part gets ready beside the world: it loads what all servers know alike, as of the last
// checkpoint, and then follows the grants, without anything to do for their ticks (v1::Guest). A map with it
// among the servers makes it one of them, without sectors; the next maps give it its share. One that is to
// leave gives its sectors away, by as many maps as that takes, and a last map has it no longer. It is needed
// until all others have that: only then have they received all that it has sent.
//
// One change follows the other. Where a server that is needed is lost in between, the world goes back to a
// checkpoint as ever.
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "coordinator/coordinator_impl.h"
#include "coordinator/limits.h"
#include "proto/convert.h"

namespace tessera {
namespace {

// How often a world is divided anew, one time after the other, for a server that has joined.
constexpr std::uint32_t kSharesMax = 64;

bool is_in(const std::vector<NodeId>& nodes, NodeId node) {
  return std::find(nodes.begin(), nodes.end(), node) != nodes.end();
}

}  // namespace

void Coordinator::Impl::tend_servers(Nanoseconds now) {
  ActiveWorld& world = *world_;
  part_with_leaver(now);
  if (!world.checkpoints || world.recovering() || !has_last_map()) return;
  if (world.leaving && !world.leaving->until) {
    world.leaving->until = now + kStreamSlack;
    if (const Server* server = members_.find(world.leaving->node))
      log(absl::StrCat(title_of(*server), " takes no part in the world any more"));
  }
  const std::vector<NodeId> wanted = wanted_nodes();
  if (wanted.empty()) return;
  if (world.guest && !is_in(wanted, world.guest->node)) dismiss_guest();
  if (world.guest) {
    if (world.guest->is_ready) admit_guest();
    return;
  }
  for (const NodeId node : wanted) {
    if (!world.rank_of(node) && invite(node)) return;
  }
  for (std::size_t rank = 0; rank < world.nodes.size(); ++rank) {
    if (!world.leaving && !is_in(wanted, world.nodes[rank])) return empty(rank);
  }
}

// Those that are to take part, as far as they can.
std::vector<NodeId> Coordinator::Impl::wanted_nodes() const {
  std::vector<NodeId> nodes = chosen_nodes(world_->settings.precision);
  std::erase_if(nodes, [&](NodeId node) { return world_->unfit.contains(node); });
  return nodes;
}

// Whether the last change of the map is over for all servers.
bool Coordinator::Impl::has_last_map() {
  if (world_->sequencer.awaits_map()) return false;
  return std::all_of(world_->nodes.begin(), world_->nodes.end(), [&](NodeId node) {
    const Server* server = members_.find(node);
    return server != nullptr && server->map_epoch >= world_->map.epoch();
  });
}

// Whether what servers do may be divided anew among all of them: not where one is being emptied.
bool Coordinator::Impl::may_share_out() const {
  if (!world_->checkpoints) return true;
  const std::vector<NodeId> wanted = wanted_nodes();
  return std::all_of(world_->nodes.begin(), world_->nodes.end(),
                     [&](NodeId node) { return is_in(wanted, node); });
}

// Whether it gets ready.
bool Coordinator::Impl::invite(NodeId node) {
  ActiveWorld& world = *world_;
  Server& server = *members_.find(node);
  const Tick tick = world.checkpoints->latest();
  v1::LoadWorld load = world.checkpoints->guest_load(
      world.number, world.settings, world.anchor, world.registry.shapes().at(tick), world.nodes, world.map);
  for (v1::Grant& past : world.sequencer.granted_since(tick))
    *load.mutable_guest()->add_past() = std::move(past);
  load.mutable_guest()->set_serial(world.sequencer.next_serial());
  load.set_load(world.load);
  load.set_hash_ticks(static_cast<bool>(options_.inputs));
  if (const std::size_t bytes = load.ByteSizeLong(); bytes > kLoadMessageBytesMax) {
    world.unfit.insert(node);
    log(absl::StrCat(title_of(server), " cannot take part in the world, of which all servers have ", bytes,
                     " bytes, and may have at most ", kLoadMessageBytesMax),
        Severity::kWarning);
    return false;
  }
  server.patience = std::max<Nanoseconds>(members_.timeout(), kLoadSilenceMax);
  server.map_epoch = server.bodies = server.exchange_bytes = 0;
  server.tick = tick;
  *send(node).mutable_load_world() = std::move(load);
  world.guest = ActiveWorld::Guest{node};
  log(absl::StrCat(title_of(server), " is to take part in the world '", world.name, "'"));
  return true;
}

void Coordinator::Impl::guest_is_loaded(const v1::Loaded& loaded) {
  ActiveWorld& world = *world_;
  if (loaded.world() != world.number) return;
  Server& server = *members_.find(world.guest->node);
  server.patience = members_.timeout();
  world.guest->is_ready = loaded.error().empty();
  if (world.guest->is_ready) return;
  log(absl::StrCat(title_of(server), " cannot take part in the world: ", loaded.error()), Severity::kWarning);
  world.unfit.insert(server.node);
  world.guest.reset();
  answer_drains();
}

// It was told to leave before it took part.
void Coordinator::Impl::dismiss_guest() {
  const NodeId node = world_->guest->node;
  world_->guest.reset();
  world_->unfit.insert(node);  // it has heard of this world, and would not load it again
  if (Server* server = members_.find(node)) {
    server->patience = members_.timeout();
    send(node).mutable_unload_world()->set_world(world_->number);
  }
  answer_drains();
}

void Coordinator::Impl::admit_guest() {
  ActiveWorld& world = *world_;
  world.map = with_another(world.map);
  v1::SectorMap map = map_message(world.map);
  for (const NodeId node : world.nodes) map.add_nodes(node.value);
  map.add_nodes(world.guest->node.value);
  map.set_newcomers(1);
  *map.mutable_subscriptions() = all_subscriptions().all();
  world.sequencer.set_map(std::move(map));
  world.shares_left = world.settings.shuffle == 0 ? kSharesMax : 0;
}

// Gives the next part of what a server has to others; with the last part, it leaves.
void Coordinator::Impl::empty(std::size_t rank) {
  ActiveWorld& world = *world_;
  const auto messages = std::exchange(world.fresh_load, std::nullopt);
  if (!messages) return ask_for_load();
  const absl::StatusOr<std::vector<ServerLoad>> loads = checked_loads(*messages);
  if (!loads.ok()) return;  // it is asked again
  const auto leaver = static_cast<Rank>(rank);
  const DeparturePlan plan =
      plan_departure(world.map, *loads, leaver, options_.balance_policy, world.settings.shuffle != 0);
  set_map(plan.map, plan.moved_sectors, plan.moved_bodies);
  if (!plan.is_last) return;
  world.map = without(world.map, leaver);
  v1::SectorMap map = map_message(world.map);
  for (std::size_t other = 0; other < world.nodes.size(); ++other) {
    if (other != rank) map.add_nodes(world.nodes[other].value);
  }
  world.sequencer.set_map(std::move(map), rank);
}

// Once the world has done with it, and clients, too.
void Coordinator::Impl::part_with_leaver(Nanoseconds now) {
  std::optional<ActiveWorld::Leaving>& leaving = world_->leaving;
  if (!leaving || !leaving->until || now < *leaving->until) return;
  leaving.reset();
  answer_drains();
}

// The next ticks are those of other servers.
void Coordinator::Impl::change_servers(const v1::SectorMap& map) {
  ActiveWorld& world = *world_;
  std::vector<NodeId> nodes;
  for (const std::uint64_t node : map.nodes()) nodes.push_back(NodeId{node});
  for (const NodeId node : std::exchange(world.nodes, nodes)) {
    if (is_in(nodes, node)) continue;
    world.leaving = ActiveWorld::Leaving{node, std::nullopt};
    world.subscriptions.erase(node);
    world.servers_keep_up = false;
    ++world.left_servers;
  }
  if (map.newcomers() > 0) {
    log(absl::StrCat(title_of(*members_.find(nodes.back())), " takes part in the world '", world.name, "'"));
    world.subscriptions[nodes.back()].mutable_all()->CopyFrom(map.subscriptions());
    world.guest.reset();
    ++world.joined_servers;
  }
  world.ready.assign(nodes.size(), true);
  world.statistics.change_servers(map.since(), nodes);
}

// Of clients, at any server of the world.
v1::Subscriptions Coordinator::Impl::all_subscriptions() const {
  v1::Subscriptions all;
  std::set<std::string> known;
  for (const auto& [node, subscriptions] : world_->subscriptions) {
    for (const v1::Subscription& subscription : subscriptions.all()) {
      if (all.all_size() >= kSubscriptionsMax || !known.insert(subscription.SerializeAsString()).second)
        continue;
      *all.add_all() = subscription;
    }
  }
  return all;
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
    const std::vector<NodeId> others = fit_nodes(server->precision);
    if (std::all_of(others.begin(), others.end(), [&](NodeId node) { return node == server->node; })) {
      return call.reply(absl::FailedPreconditionError(absl::StrCat(
                            "no other server of ", described_servers(server->precision), " could take over")),
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
    const bool is_needed =
        world_ && (world_->rank_of(drain.node) || (world_->leaving && world_->leaving->node == drain.node) ||
                   (world_->guest && world_->guest->node == drain.node));
    if (is_needed) {
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
