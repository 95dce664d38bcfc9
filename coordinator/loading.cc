// Loading, replacing, unloading and failing of worlds.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <utility>

#include "coordinator/coordinator_impl.h"
#include "coordinator/limits.h"
#include "coordinator/placement.h"
#include "lpss/simulation/simulation.h"
#include "proto/convert.h"

namespace tessera {
absl::Status Coordinator::Impl::may_load(bool replace) const {
  if (waiting_load_ || (world_ && world_->loading())) {
    return absl::FailedPreconditionError("another world is being loaded");
  }
  if (world_ && !replace) {
    return absl::AlreadyExistsError(
        absl::StrCat("the world '", world_->name, "' is loaded; set `replace` to replace it"));
  }
  return absl::OkStatus();
}

void Coordinator::Impl::on(Call<v1::LoadRequest, v1::LoadReply>& call, Nanoseconds now) {
  if (absl::Status status = may_load(call.request.replace()); !status.ok()) {
    call.reply(status, {});
    return;
  }
  if (!call.request.has_world()) {
    call.reply(absl::InvalidArgumentError("world must be set"), {});
    return;
  }
  absl::StatusOr<WorldToLoad> world = described_world(call.request.world());
  if (!world.ok()) {
    call.reply(world.status(), {});
    return;
  }
  call.request = {};  // the description has everything, and the request may be large
  waiting_load_ = WaitingLoad{std::move(call.reply), *std::move(world), now + options_.join_timeout};
  try_start();
}

void Coordinator::Impl::on(Call<RestoreChunks, v1::LoadReply>& call, Nanoseconds now) {
  if (absl::Status status = may_load(call.request.replace); !status.ok()) {
    call.reply(status, {});
    return;
  }
  absl::StatusOr<ReadSnapshot> snapshot = from_chunks(call.request.chunks);
  if (!snapshot.ok()) {
    call.reply(snapshot.status(), {});
    return;
  }
  call.request = {};
  waiting_load_ = WaitingLoad{std::move(call.reply), {*std::move(snapshot)}, now + options_.join_timeout};
  try_start();
}

std::string Coordinator::Impl::missing_servers(const WaitingLoad& load) const {
  const Precision precision = load.world.settings().precision;
  const std::size_t wanted = std::max<std::size_t>(options_.servers_wanted, 1);
  return absl::StrCat("the world '", load.world.name(), "' needs ", wanted, " servers of ",
                      described_servers(precision), ", but there are ", fit_nodes(precision).size(),
                      " after waiting for ", std::chrono::duration<double>(options_.join_timeout).count(),
                      " s");
}

// Starts the waiting load if the servers that it needs have joined.
void Coordinator::Impl::try_start() {
  if (!waiting_load_) return;
  const std::vector<NodeId> nodes = chosen_nodes(waiting_load_->world.settings().precision);
  if (nodes.size() < std::max<std::size_t>(options_.servers_wanted, 1)) return;
  start(*std::exchange(waiting_load_, std::nullopt), ranked(nodes));
}

// In the order in which they joined.
std::vector<NodeId> Coordinator::Impl::fit_nodes(Precision precision) const {
  return members_.nodes_of(precision, options_.required_labels);
}

// "precision f32 with the labels zone=eu, rack=a7"
std::string Coordinator::Impl::described_servers(Precision precision) const {
  const Labels& labels = options_.required_labels;
  return absl::StrCat("precision ", name_of(precision), labels.empty() ? "" : " with the labels ",
                      absl::StrJoin(labels, ", "));
}

// The servers that a world is to have, as far as they are there.
std::vector<NodeId> Coordinator::Impl::chosen_nodes(Precision precision) const {
  std::vector<NodeId> nodes = fit_nodes(precision);
  if (options_.servers_wanted > 0 && nodes.size() > options_.servers_wanted) {
    nodes.resize(options_.servers_wanted);
  }
  return nodes;
}

// By rank, for a map that is made anew: those with the same labels are next to each other on the curve, so
// that few borders lie between racks.
std::vector<NodeId> Coordinator::Impl::ranked(std::vector<NodeId> nodes) {
  std::ranges::stable_sort(nodes, {}, [&](NodeId node) { return members_.find(node)->labels; });
  return nodes;
}

// 1 for one that has been lost: the world is about to be set back.
double Coordinator::Impl::capacity_of(NodeId node) {
  const Server* server = members_.find(node);
  return server == nullptr ? 1 : server->capacity;
}

std::vector<Host> Coordinator::Impl::hosts(const std::vector<NodeId>& nodes) {
  std::vector<Host> hosts;
  for (const NodeId node : nodes) hosts.push_back({node, capacity_of(node)});
  return hosts;
}

void Coordinator::Impl::start(WaitingLoad load, const std::vector<NodeId>& nodes) {
  const std::uint64_t number = worlds_ + 1;
  absl::StatusOr<Placement> placement =
      place(number, load.world, hosts(nodes), /*map_epoch=*/1, options_.balance_policy);
  if (!placement.ok()) {
    load.reply(placement.status(), {});
    return;
  }
  if (absl::Status status = store_beginning(loads_ + 1, load.world); !status.ok()) {
    load.reply(status, {});
    return;
  }
  const bool replaces = world_ != nullptr;
  close_world(absl::FailedPreconditionError("the world was replaced by another"), nodes);
  failed_.reset();
  worlds_ = number;

  const Tick tick = load.world.tick();
  world_ = make_world(std::make_shared<const WorldToLoad>(std::move(load.world)), ++loads_, number, nodes);
  world_->map = placement->map;
  world_->sectors = placement->sectors;
  world_->load_reply = std::move(load.reply);
  world_->replaced_another = replaces;
  send_loads(*std::move(placement), tick);
  log(absl::StrCat("loading the world '", world_->name, "': ", world_->registry.body_count(), " bodies on ",
                   nodes.size(), " servers"));
}

// A world that no server has yet.
std::unique_ptr<ActiveWorld> Coordinator::Impl::make_world(std::shared_ptr<const WorldToLoad> from,
                                                           std::uint64_t load, std::uint64_t number,
                                                           const std::vector<NodeId>& nodes) const {
  const WorldSettings settings = from->settings();
  const SectorIndex anchor = from->anchor();
  const Tick tick = from->tick();
  std::vector<Sequencer::Held> held = held_of(*from);
  std::optional<Checkpoints> checkpoints;
  if (survives_losses()) checkpoints.emplace(from);
  auto world = std::make_unique<ActiveWorld>(ActiveWorld{
      .load = load,
      .number = number,
      .name = from->name(),
      .settings = settings,
      .anchor = anchor,
      .map = SectorMap(anchor, {}, /*epoch=*/0),
      .nodes = nodes,
      .registry = registry_of(*from),
      .sequencer = Sequencer({number, nodes.size(), settings.time_step, options_.grant_window, tick,
                              /*keeps_past=*/survives_losses()}),
      .queries = Queries(),
      .statistics = TickStatistics(nodes),
      .ready = std::vector<bool>(nodes.size()),
      .checkpoints = std::move(checkpoints),
  });
  world->sequencer.hold(std::move(held));
  return world;
}

// Sends the servers of the world what they host of it, at the end of `tick`.
void Coordinator::Impl::send_loads(Placement placement, Tick tick) {
  for (std::size_t rank = 0; rank < world_->nodes.size(); ++rank) {
    Server& server = *members_.find(world_->nodes[rank]);
    server.patience = std::max<Nanoseconds>(members_.timeout(), kLoadSilenceMax);
    server.bodies = server.exchange_bytes = server.exchange_messages = 0;
    server.map_epoch = placement.map.epoch();
    server.tick = tick;
    v1::LoadWorld& message = *send(server.node).mutable_load_world();
    message = std::move(placement.loads[rank]);
    message.set_load(world_->load);
    message.set_hash_ticks(static_cast<bool>(options_.inputs));
  }
}

void Coordinator::Impl::give_up_waiting(const absl::Status& status) {
  if (!waiting_load_) return;
  const WaitingLoad load = *std::exchange(waiting_load_, std::nullopt);
  log(std::string(status.message()), Severity::kWarning);
  load.reply(status, {});
}

void Coordinator::Impl::finish_load() {
  v1::LoadReply reply;
  reply.set_bodies(world_->registry.body_count());
  reply.set_sectors(world_->sectors);
  reply.set_servers(static_cast<std::uint32_t>(world_->nodes.size()));
  std::exchange(world_->load_reply, {})(absl::OkStatus(), reply);
  log(absl::StrCat("the world '", world_->name, "' is loaded"));
}

// Discards the world; all waiting calls get `status`. Servers that are `staying` for the next world need no
// message: a load replaces their world.
void Coordinator::Impl::close_world(const absl::Status& status, const std::vector<NodeId>& staying) {
  if (!world_) return;
  const std::unique_ptr<ActiveWorld> world = std::move(world_);
  if (world->load_reply) std::exchange(world->load_reply, {})(status, {});
  world->sequencer.abandon(status);
  world->queries.abandon(status);
  answer_drains();
  std::vector<NodeId> nodes = world->nodes;
  if (world->guest) nodes.push_back(world->guest->node);
  for (const NodeId node : nodes) {
    if (std::find(staying.begin(), staying.end(), node) != staying.end()) continue;
    if (members_.find(node) != nullptr) send(node).mutable_unload_world()->set_world(world->number);
  }
}

// A load that fails before the world exists leaves no world; any other failure leaves a failed world.
void Coordinator::Impl::fail_world(const std::string& failure, absl::StatusCode code, Nanoseconds now) {
  const bool leaves_trace = !world_->loading() || world_->replaced_another;
  if (leaves_trace) {
    failed_ = status(now);
    failed_->set_state("failed");
    failed_->set_failure(failure);
  }
  log(absl::StrCat("the world '", world_->name, "' has failed: ", failure), Severity::kError);
  forget_stored().IgnoreError();  // which is logged
  close_world(absl::Status(code, failure), {});
}

void Coordinator::Impl::on(Call<v1::UnloadRequest, v1::UnloadReply>& call, Nanoseconds) {
  if (!world_ && !waiting_load_ && !failed_) {
    call.reply(absl::FailedPreconditionError("no world is loaded"), {});
    return;
  }
  const absl::Status status = absl::FailedPreconditionError("the world was unloaded");
  give_up_waiting(status);
  if (world_) log(absl::StrCat("the world '", world_->name, "' is unloaded"));
  close_world(status, {});
  failed_.reset();
  call.reply(forget_stored(), {});
}

}  // namespace tessera
