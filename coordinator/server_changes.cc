#include "coordinator/server_changes.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "coordinator/limits.h"
#include "lpss/base/invariant.h"

namespace tessera {
namespace {

bool is_in(const std::vector<NodeId>& nodes, NodeId node) {
  return std::find(nodes.begin(), nodes.end(), node) != nodes.end();
}

}  // namespace

void ServerChanges::tend(const Checkpoints& checkpoints, Nanoseconds now) {
  Roster& servers = world_.servers;
  if (const auto due = next_deadline(); due && now >= *due) servers.drop_leaver();
  if (world_.recovering() || !balancing_.has_settled()) return;
  if (servers.leaver() && !servers.leaver()->until) {
    servers.release_leaver(now + kStreamSlack);
    if (const Server* server = context_.members.find(servers.leaver()->node))
      context_.log(absl::StrCat(title_of(*server), " takes no part in the world any more"));
  }
  const std::vector<NodeId> wanted = context_.choice.chosen(world_.settings().precision, servers.unfit());
  if (wanted.empty()) return;
  if (servers.guest() && !is_in(wanted, servers.guest()->node)) dismiss_guest();
  if (servers.guest()) {
    if (servers.guest()->is_ready) {
      admit_guest();
    } else if (!servers.guest()->unheard.empty() && others_wait(wanted)) {
      dismiss_guest();
    }
    return;
  }
  for (const NodeId node : wanted) {
    if (!servers.rank_of(node) && invite(node, checkpoints)) return;
  }
  if (servers.leaver()) return;
  for (std::size_t rank = 0; rank < servers.nodes().size(); ++rank) {
    if (!is_in(wanted, servers.nodes()[rank])) return remove(rank);
  }
}

std::optional<Nanoseconds> ServerChanges::next_deadline() const {
  return world_.servers.leaver() ? world_.servers.leaver()->until : std::nullopt;
}

// Whether there is a change to be made once the guest is no longer there.
bool ServerChanges::others_wait(const std::vector<NodeId>& wanted) const {
  const Roster& servers = world_.servers;
  return std::ranges::any_of(
             wanted, [&](NodeId node) { return !servers.rank_of(node) && !servers.is_guest(node); }) ||
         std::ranges::any_of(servers.nodes(), [&](NodeId node) { return !is_in(wanted, node); });
}

void ServerChanges::guest_awaits(const std::vector<v1::Unheard>& unheard) {
  std::vector<NodeId> nodes;
  for (const v1::Unheard& one : unheard) {
    if (std::chrono::milliseconds(one.waited_ms()) >= context_.members.contact_timeout())
      nodes.push_back(NodeId{one.node()});
  }
  const Roster::Guest& guest = *world_.servers.guest();
  if (!nodes.empty() && guest.unheard.empty()) {
    const Server* const missed = context_.members.find(nodes.front());
    context_.log(
        absl::StrCat(title_of(*context_.members.find(guest.node)), " cannot take part in the world yet: ",
                     missed != nullptr ? title_of(*missed) : "a server", " does not answer it"),
        Severity::kWarning);
  }
  world_.servers.guest_awaits(std::move(nodes));
}

// Whether it gets ready.
bool ServerChanges::invite(NodeId node, const Checkpoints& checkpoints) {
  Server& server = *context_.members.find(node);
  const Tick tick = checkpoints.latest();
  v1::LoadWorld load =
      checkpoints.guest_load(world_.number, world_.settings(), world_.anchor,
                             world_.registry.shapes().at(tick), world_.servers.nodes(), world_.map);
  for (v1::Grant& past : world_.sequencer.granted_since(tick))
    *load.mutable_guest()->add_past() = std::move(past);
  load.mutable_guest()->set_serial(world_.sequencer.next_serial());
  load.set_load(world_.load);
  load.set_hash_ticks(static_cast<bool>(context_.options.inputs));
  if (const std::size_t bytes = load.ByteSizeLong(); bytes > kLoadMessageBytesMax) {
    world_.servers.add_unfit(node);
    context_.log(absl::StrCat(title_of(server), " cannot take part in the world, of which all servers have ",
                              bytes, " bytes, and may have at most ", kLoadMessageBytesMax),
                 Severity::kWarning);
    return false;
  }
  server.patience = std::max<Nanoseconds>(context_.members.timeout(), kLoadSilenceMax);
  server.map_epoch = server.bodies = server.exchange_bytes = 0;
  server.tick = tick;
  *context_.journal.send(node).mutable_load_world() = std::move(load);
  world_.servers.invite(node);
  context_.log(absl::StrCat(title_of(server), " is to take part in the world '", world_.name, "'"));
  return true;
}

void ServerChanges::guest_is_loaded(const v1::Loaded& loaded) {
  if (loaded.world() != world_.number) return;
  Server& server = *context_.members.find(world_.servers.guest()->node);
  server.patience = context_.members.timeout();
  if (loaded.error().empty()) return world_.servers.guest_is_ready();
  context_.log(absl::StrCat(title_of(server), " cannot take part in the world: ", loaded.error()),
               Severity::kWarning);
  world_.servers.add_unfit(server.node);
  world_.servers.drop_guest();
}

// It was told to leave before it took part.
void ServerChanges::dismiss_guest() {
  const NodeId node = world_.servers.guest()->node;
  world_.servers.drop_guest();
  world_.servers.add_unfit(node);  // it has heard of this world, and would not load it again
  Server* server = context_.members.find(node);
  if (server == nullptr) return;
  server->patience = context_.members.timeout();
  context_.journal.send(node).mutable_unload_world()->set_world(world_.number);
}

void ServerChanges::admit_guest() {
  world_.map = with_another(world_.map);
  v1::SectorMap map = map_message(world_.map);
  for (const NodeId node : world_.servers.listeners()) map.add_nodes(node.value);
  map.set_newcomers(1);
  *map.mutable_subscriptions() = world_.servers.all_subscriptions().all();
  world_.sequencer.set_map(std::move(map));
  balancing_.share_out();
}

// Gives the next part of what a server has to others; with the last part, it leaves.
void ServerChanges::remove(std::size_t rank) {
  const auto leaver = static_cast<Rank>(rank);
  if (!balancing_.empty(leaver)) return;
  world_.map = without(world_.map, leaver);
  v1::SectorMap map = map_message(world_.map);
  for (const NodeId node : world_.servers.nodes()) {
    if (world_.servers.rank_of(node) != rank) map.add_nodes(node.value);
  }
  world_.sequencer.set_map(std::move(map), rank);
}

void ServerChanges::change_servers(const v1::SectorMap& map) {
  if (map.newcomers() > 0) {
    const Server* newcomer = context_.members.find(NodeId{map.nodes(map.nodes_size() - 1)});
    invariant(newcomer != nullptr, "who begins to take part is a member");
    context_.log(absl::StrCat(title_of(*newcomer), " takes part in the world '", world_.name, "'"));
  }
  world_.servers.change(map);
  world_.statistics.change_servers(map.since(), world_.servers.nodes());
}

}  // namespace tessera
