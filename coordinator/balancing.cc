#include "coordinator/balancing.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "proto/convert.h"

namespace tessera {
namespace {

constexpr std::uint64_t kCountMax = std::uint64_t{1} << 48;  // of what a piece has: sums stay in range

// How often a world is divided anew, one time after the other, for a server that has joined.
constexpr std::uint32_t kSharesMax = 64;

std::string describe(const BalancePlan& plan) {
  const auto largest = [](const std::vector<double>& us) {
    return *std::max_element(us.begin(), us.end()) / 1000;
  };
  if (plan.consolidates) {
    return absl::StrFormat(
        "%d sectors with %d bodies join the others on one server: the slowest part of a tick took %.2f ms, "
        "waiting for others %.2f ms; all of it takes at most about %.2f ms",
        plan.moved_sectors, plan.moved_bodies, largest(plan.tick_us), plan.wait_us / 1000,
        largest(plan.tick_us_then));
  }
  return absl::StrFormat(
      "%d sectors with %d bodies change servers: the slowest part of a tick took %.2f ms, and will take "
      "about %.2f ms",
      plan.moved_sectors, plan.moved_bodies, largest(plan.tick_us), largest(plan.tick_us_then));
}

absl::Status changing_error() {
  return absl::UnavailableError("the servers of the world are changing: ask again");
}

}  // namespace

// As the servers of the world answer, by rank. UNAVAILABLE where these have changed since they were asked,
// INTERNAL where a number cannot be.
absl::StatusOr<std::vector<ServerLoad>> Balancing::checked(
    const std::vector<v1::ServerLoad>& messages) const {
  const std::vector<NodeId>& nodes = world_.servers.nodes();
  if (messages.size() != nodes.size() || messages.size() != world_.map.servers()) return changing_error();
  const auto is_amount = [](double value) { return std::isfinite(value) && value >= 0; };
  std::vector<ServerLoad> loads;
  for (const v1::ServerLoad& message : messages) {
    ServerLoad& load = loads.emplace_back();
    load.capacity = context_.choice.capacity_of(nodes[loads.size() - 1]);
    load.tick_us = message.tick_us();
    load.wait_us = message.wait_us();
    bool is_sound = is_amount(load.tick_us) && is_amount(load.wait_us) &&
                    message.pieces_size() <= static_cast<int>(kLoadPiecesMax);
    for (const v1::LoadPiece& piece : message.pieces()) {
      is_sound = is_sound && is_amount(piece.work()) && piece.level() <= kCurveLevelMax &&
                 piece.sectors() <= kCountMax && piece.bodies() <= kCountMax;
      load.pieces.push_back(
          {from_proto(piece.first()), piece.level(), piece.work(), piece.sectors(), piece.bodies()});
    }
    if (!is_sound) return absl::InternalError("a server described its load with numbers that cannot be");
  }
  return loads;
}

// Whether a running world may change its map by itself.
bool Balancing::may_balance() const {
  return context_.options.balance_every > Nanoseconds::zero() && world_.servers.nodes().size() > 1 &&
         follows_load(context_.options.balance_policy) && world_.settings().shuffle == 0 && !awaits_ &&
         !world_.recovering() && !world_.sequencer.paused() && !world_.sequencer.awaits_map() &&
         may_share_out();
}

// Whether what servers do may be divided anew among all of them: not where one is being emptied.
bool Balancing::may_share_out() const {
  if (!context_.has_checkpoints()) return true;
  const std::vector<NodeId> wanted =
      context_.choice.chosen(world_.settings().precision, world_.servers.unfit());
  return std::ranges::all_of(world_.servers.nodes(),
                             [&](NodeId node) { return std::ranges::find(wanted, node) != wanted.end(); });
}

bool Balancing::has_settled() const {
  if (world_.sequencer.awaits_map()) return false;
  return std::ranges::all_of(world_.servers.nodes(), [&](NodeId node) {
    const Server* server = context_.members.find(node);
    return server != nullptr && server->map_epoch >= world_.map.epoch();
  });
}

void Balancing::tend(Nanoseconds now) {
  if (!may_share_out()) return;  // what comes is for the one that is being emptied
  if (const auto messages = std::exchange(fresh_, std::nullopt)) {
    const absl::StatusOr<std::vector<ServerLoad>> loads = checked(*messages);
    if (absl::IsInternal(loads.status()))
      context_.log(std::string(loads.status().message()), Severity::kWarning);
    if (loads.ok() && !world_.sequencer.awaits_map()) plan(*loads);
  }
  if (shares_left_ > 0 && !world_.recovering() && has_settled()) return ask();
  if (!may_balance() || now < next_) return;
  const bool is_first = next_ == Nanoseconds::zero();
  next_ = now + context_.options.balance_every;
  if (!is_first) ask();
}

std::optional<Nanoseconds> Balancing::next_deadline() const {
  return may_balance() ? std::optional(next_) : std::nullopt;
}

void Balancing::plan(const std::vector<ServerLoad>& loads) {
  const BalancePolicy policy = context_.options.balance_policy;
  const bool shares_out = shares_left_ > 0;
  const BalancePlan plan =
      shares_out ? plan_balance(world_.map, loads, policy)
                 : consolidation_.next(world_.map, loads, policy,
                                       std::chrono::duration<double>(world_.settings().time_step),
                                       world_.sequencer.period());
  if (shares_out) shares_left_ = plan.moves() ? shares_left_ - 1 : 0;
  if (plan.moves()) set_map(plan);
}

// Of all servers, unless they are being asked.
void Balancing::ask() {
  if (awaits_ || !world_.questions.room().ok()) return;
  awaits_ = true;
  // The world calls this, so it exists, and this with it.
  world_.sequencer.ask(
      load_question([this](const absl::Status& status, Tick, std::vector<v1::ServerLoad> loads) {
        awaits_ = false;
        if (status.ok()) fresh_ = std::move(loads);
      }));
}

v1::Question Balancing::load_question(Questions::LoadReply reply) {
  return world_.questions.load(std::chrono::duration<double>(context_.options.balance_ahead).count(),
                               std::move(reply));
}

void Balancing::set_map(const BalancePlan& plan) {
  set_map(plan.map, plan.moved_sectors, plan.moved_bodies);
  context_.log(describe(plan));
}

void Balancing::set_map(const SectorMap& map, std::uint64_t moved_sectors, std::uint64_t moved_bodies) {
  world_.map = map;
  moved_sectors_ += moved_sectors;
  moved_bodies_ += moved_bodies;
  world_.sequencer.set_map(map_message(map));
}

void Balancing::share_out() { shares_left_ = world_.settings().shuffle == 0 ? kSharesMax : 0; }

bool Balancing::empty(Rank leaver) {
  const auto messages = std::exchange(fresh_, std::nullopt);
  if (!messages) {
    ask();
    return false;
  }
  const absl::StatusOr<std::vector<ServerLoad>> loads = checked(*messages);
  if (!loads.ok()) return false;  // it is asked again
  const DeparturePlan plan = plan_departure(world_.map, *loads, leaver, context_.options.balance_policy,
                                            world_.settings().shuffle != 0);
  set_map(plan.map, plan.moved_sectors, plan.moved_bodies);
  return plan.is_last;
}

void Balancing::set_back() {
  shares_left_ = 0;
  awaits_ = false;
  fresh_.reset();
}

void Balancing::answer(ClientCall<v1::BalanceRequest, v1::BalanceReply>& call) {
  if (world_.settings().shuffle != 0) {
    return call.reply(absl::FailedPreconditionError("authority over the world's sectors moves at random "
                                                    "(shuffle), so that it cannot be balanced"),
                      {});
  }
  BalancePolicy policy = context_.options.balance_policy;
  if (!call.request.policy().empty()) {
    const std::optional<BalancePolicy> asked = parse_balance_policy(call.request.policy());
    if (!asked) {
      return call.reply(absl::InvalidArgumentError(absl::StrCat("unknown policy \"", call.request.policy(),
                                                                "\"; known are ",
                                                                absl::StrJoin(balance_policy_names(), ", "))),
                        {});
    }
    policy = *asked;
  }
  if (absl::Status status = world_.questions.room(); !status.ok()) return call.reply(status, {});
  if (absl::Status status = world_.sequencer.room_for_question(); !status.ok()) return call.reply(status, {});
  // The world calls this, so it exists, and this with it.
  world_.sequencer.ask(
      load_question([this, policy, dry_run = call.request.dry_run(), reply = std::move(call.reply)](
                        const absl::Status& status, Tick tick, std::vector<v1::ServerLoad> messages) {
        if (!status.ok()) return reply(status, {});
        const absl::StatusOr<std::vector<ServerLoad>> loads = checked(messages);
        if (!loads.ok()) return reply(loads.status(), {});
        if (!may_share_out()) return reply(changing_error(), {});
        const BalancePlan plan = plan_balance(world_.map, *loads, policy);
        v1::BalanceReply answer;
        answer.set_tick(tick);
        for (std::size_t rank = 0; rank < loads->size(); ++rank) {
          v1::BalanceReply::ServerShare& share = *answer.add_shares();
          share.set_node(world_.servers.nodes()[rank].value);
          share.set_tick_us(plan.tick_us[rank]);
          share.set_tick_us_then(plan.tick_us_then[rank]);
        }
        answer.set_moved_sectors(plan.moved_sectors);
        answer.set_moved_bodies(plan.moved_bodies);
        answer.set_moves(plan.moves() && !dry_run && !world_.sequencer.awaits_map());
        if (answer.moves()) set_map(plan);
        reply(absl::OkStatus(), answer);
      }));
}

}  // namespace tessera
