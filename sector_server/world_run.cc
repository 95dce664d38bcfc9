#include "sector_server/world_run.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>

#include "lpss/base/invariant.h"
#include "lpss/model/checks.h"
#include "lpss/snapshot/record_checks.h"
#include "lpss/tick/commands.h"
#include "proto/convert.h"
#include "proto/wire.h"
#include "sector_server/world_loading.h"

namespace tessera {
namespace {

std::vector<NodeId> nodes_in(const google::protobuf::RepeatedField<std::uint64_t>& message) {
  std::vector<NodeId> nodes;
  for (const std::uint64_t node : message) nodes.push_back(NodeId{node});
  return nodes;
}

std::uint64_t ground_waits() { return TileStore::of_process().counts().waits; }

}  // namespace

absl::StatusOr<std::unique_ptr<WorldRun>> WorldRun::create(v1::LoadWorld& load, NodeId self, int threads,
                                                           const MakeEngine& make_engine, Send send) {
  RoundExchange exchange(load.world(), self, nodes_in(load.nodes()), send);
  if (!exchange.takes_part() && !load.has_guest())
    return absl::InvalidArgumentError("the world's list of servers lacks this one");
  if (exchange.takes_part() && load.has_guest())
    return absl::InvalidArgumentError("the world's list of servers has this one, which is a guest");
  const absl::StatusOr<WorldSettings> settings = settings_of(load);
  if (!settings.ok()) return settings.status();
  absl::StatusOr<std::unique_ptr<Engine>> engine = make_engine(engine_settings(*settings));
  if (!engine.ok()) return engine.status();
  absl::StatusOr<std::unique_ptr<Partition>> partition =
      loaded_partition(load, *settings, **engine, exchange.nodes().size(), exchange.self());
  if (!partition.ok()) return partition.status();
  std::unique_ptr<WorldRun> run(new WorldRun(load, threads, *std::move(engine), *std::move(partition),
                                             std::move(exchange), std::move(send)));
  if (!load.has_guest()) {
    run->join();
    return run;
  }
  for (v1::Grant& past : *load.mutable_guest()->mutable_past()) {
    if (absl::Status status = run->add_what_is_new(past); !status.ok()) return status;
    if (absl::Status status = run->follow(past); !status.ok()) return status;
  }
  return run;
}

WorldRun::WorldRun(const v1::LoadWorld& load, int threads, std::unique_ptr<Engine> engine,
                   std::unique_ptr<Partition> partition, RoundExchange exchange, Send send)
    : world_(load.world()),
      threads_(threads),
      engine_(std::move(engine)),
      partition_(std::move(partition)),
      exchange_(std::move(exchange)),
      grants_(load.has_guest() ? load.guest().serial() : 1),
      answers_(load.world(), *partition_, std::move(send)),
      reports_(load.hash_ticks()),
      tick_(load.restored().tick()),
      map_epoch_(load.map_epoch()),
      reported_map_(load.map_epoch()) {}

void WorldRun::join() {
  invariant(exchange_.takes_part() && is_guest(), "who takes part has a rank, and begins once");
  machine_ = std::make_unique<TickMachine>(
      *partition_, TickMachine::Options{.parallel = parallel_on(threads_), .tick = tick_});
}

absl::Status WorldRun::take(v1::Grant grant) {
  for (const v1::Question& question : grant.questions()) {
    if (absl::Status status = answers_.check(question); !status.ok())
      return in(absl::StrCat("a question of grant ", grant.serial()), status);
  }
  return grants_.take(std::move(grant));
}

bool WorldRun::ready() const {
  if (has_left_) return false;
  return round_ ? exchange_.has_all(*round_, current_round()) : grants_.has_work();
}

std::optional<PeerProbes::Wait> WorldRun::awaited() const {
  if (!round_ || has_left_) return std::nullopt;
  PeerProbes::Wait wait{current_round(), exchange_.missing(*round_, current_round()), {}};
  if (wait.peers.empty()) return std::nullopt;
  for (Rank rank = 0; rank < nodes().size(); ++rank) {
    const bool is_awaited = std::ranges::find(wait.peers, nodes()[rank]) != wait.peers.end();
    if (rank != exchange_.self() && !is_awaited) wait.others.push_back(nodes()[rank]);
  }
  return wait;
}

absl::Status WorldRun::proceed(const Clock& clock) { return round_ ? advance(clock) : next_piece(clock); }

absl::Status WorldRun::next_piece(const Clock& clock) {
  if (v1::Grant* grant = grants_.begin_next()) {
    if (absl::Status status = add_what_is_new(*grant); !status.ok()) return status;
  }
  if (const v1::SectorMap* map = grants_.take_map()) return change_map(*map, clock);
  if (is_guest()) return follow(grants_.take_rest());
  if (const auto tick = grants_.take_tick()) return begin_tick(tick->commands, clock);
  // One a turn, so that nothing else has to wait for all of them.
  if (const std::optional<v1::Question> question = grants_.take_question())
    answers_.answer(*question, tick_, /*with_shared=*/exchange_.self() == 0, meter_, clock);
  return absl::OkStatus();
}

absl::Status WorldRun::add_what_is_new(v1::Grant& grant) {
  if (absl::Status status = add_shapes(*partition_, *grant.mutable_new_shapes()); !status.ok()) return status;
  return add_modules(*partition_, *grant.mutable_new_modules());
}

absl::Status WorldRun::begin_tick(const std::string* packed_commands, const Clock& clock) {
  const Nanoseconds began = clock();
  meter_.begin_tick(began, ground_waits());
  std::vector<Command> commands;
  if (packed_commands != nullptr) {
    absl::StatusOr<std::vector<Command>> granted = unpack_commands(*packed_commands);
    if (!granted.ok()) return granted.status();
    commands = std::move(*granted);
    if (absl::Status status = check(*partition_, commands); !status.ok()) return status;
  }
  go_on(machine_->begin_tick(commands), began, clock);
  return absl::OkStatus();
}

// Before the next tick: a round of its own, in which sectors change servers.
absl::Status WorldRun::change_map(const v1::SectorMap& message, const Clock& clock) {
  const Nanoseconds began = clock();
  if (message.nodes_size() > 0) exchange_.change_nodes(nodes_in(message.nodes()));
  absl::StatusOr<SectorMap> map = map_of(*partition_, message, nodes().size());
  if (!map.ok()) return map.status();
  if (message.epoch() <= map_epoch_)
    return absl::InvalidArgumentError(absl::StrCat("the sector map of epoch ", map_epoch_,
                                                   " was to be followed by one of epoch ", message.epoch()));
  if (nodes().size() > kServersMax || message.newcomers() >= nodes().size())
    return absl::InvalidArgumentError(absl::StrCat("the sector map has ", nodes().size(),
                                                   " servers, of which ", message.newcomers(),
                                                   " take part from now on"));
  if (!exchange_.takes_part()) {
    if (is_guest()) {
      partition_->self = exchange_.self();
      partition_->map = *std::move(map);
      return absl::OkStatus();
    }
    if (!partition_->sectors.empty() || partition_->packed.counts().sectors > 0)
      return absl::InvalidArgumentError("a server that hosts sectors was to leave its world");
    has_left_ = true;
    return absl::OkStatus();
  }
  if (exchange_.self() >= nodes().size() - message.newcomers() && !is_guest())
    return absl::InvalidArgumentError("a server of the world was to begin to take part in it");
  new_servers_ = {.since = tick_ + 1, .servers = nodes().size(), .subscriptions = {}};
  if (is_guest()) {
    new_servers_->subscriptions = {message.subscriptions().begin(), message.subscriptions().end()};
    join();
  }
  moving_ = message.epoch();
  meter_.begin_move(began);
  go_on(machine_->change_map({*std::move(map), exchange_.self(), message.newcomers()}), began, clock);
  return absl::OkStatus();
}

void WorldRun::end_move(Nanoseconds now) {
  // Of the tick that follows, others may have sent something already.
  exchange_.end_move(tick_ + 1, moving_);
  map_epoch_ = std::exchange(moving_, 0);
  meter_.end_move(now);
}

// What a guest does of a grant: it hosts nothing that moves, so its ticks cost nothing.
absl::Status WorldRun::follow(const v1::Grant& grant) {
  if (grant.ticks() == 0) return absl::OkStatus();
  const absl::StatusOr<std::vector<Command>> commands = unpack_commands(grant.commands());
  if (!commands.ok()) return commands.status();
  if (absl::Status status = check(*partition_, *commands); !status.ok()) return status;
  std::vector<Exchange> nobody(partition_->map.servers());
  std::vector<Stopped> stopped;
  apply_commands(*partition_, *commands, nobody, stopped);
  tick_ += grant.ticks();
  return absl::OkStatus();
}

absl::Status WorldRun::advance(const Clock& clock) {
  const Nanoseconds began = clock();
  auto messages = exchange_.collect(*round_, current_round(), *machine_);
  if (!messages.ok()) return messages.status();
  go_on(machine_->advance(*std::move(messages)), began, clock);
  return absl::OkStatus();
}

// `began`: when the work on this round did.
void WorldRun::go_on(std::optional<Round> round, Nanoseconds began, const Clock& clock) {
  round_ = std::move(round);
  if (round_) exchange_.send(*round_, current_round());
  const Nanoseconds now = clock();
  meter_.add_own(now - began);
  if (round_) return;
  if (moving_ != 0) {
    end_move(now);
  } else {
    end_tick(now);
  }
}

void WorldRun::end_tick(Nanoseconds now) {
  ++tick_;
  tick_done_ = true;
  exchange_.end_tick(tick_);
  answers_.after_tick();
  memory_.after_tick(partition_->packed.counts().sectors);
  reports_.add(tick_, *machine_, meter_.end_tick(now, ground_waits()));
}

bool WorldRun::report_due() const {
  return reports_.are_due(/*idle=*/!round_ && !grants_.has_work()) || reported_map_ != map_epoch_;
}

std::uint64_t WorldRun::moved_bytes() const { return traffic().sent[RoundMessage(Transfer{}).index()].bytes; }

}  // namespace tessera
