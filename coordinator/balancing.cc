// What divides a world anew among its servers while it runs: the map follows the load. Moves are announced in
// grants, so that all servers make them at the beginning of the same tick; where a body lives does not change
// a bit of what comes out.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "coordinator/coordinator_impl.h"
#include "proto/convert.h"

namespace tessera {
namespace {

constexpr std::uint64_t kCountMax = std::uint64_t{1} << 48;  // of what a piece has: sums stay in range

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

}  // namespace

// As the servers of the world answer, by rank. UNAVAILABLE where these have changed since they were asked,
// INTERNAL where a number cannot be.
absl::StatusOr<std::vector<ServerLoad>> Coordinator::Impl::checked_loads(
    const std::vector<v1::ServerLoad>& messages) {
  if (messages.size() != world_->nodes.size() || messages.size() != world_->map.servers())
    return absl::UnavailableError("the servers of the world are changing: ask again");
  const auto is_amount = [](double value) { return std::isfinite(value) && value >= 0; };
  std::vector<ServerLoad> loads;
  for (const v1::ServerLoad& message : messages) {
    ServerLoad& load = loads.emplace_back();
    load.capacity = capacity_of(world_->nodes[loads.size() - 1]);
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
bool Coordinator::Impl::may_balance() const {
  const ActiveWorld& world = *world_;
  return options_.balance_every > Nanoseconds::zero() && world.nodes.size() > 1 &&
         follows_load(options_.balance_policy) && world.settings.shuffle == 0 && !world.awaits_load &&
         !world.recovering() && !world.sequencer.paused() && !world.sequencer.awaits_map() && may_share_out();
}

void Coordinator::Impl::tend_balance(Nanoseconds now) {
  ActiveWorld& world = *world_;
  if (!may_share_out()) return;  // what comes is for the one that is being emptied
  if (const auto messages = std::exchange(world.fresh_load, std::nullopt)) {
    const absl::StatusOr<std::vector<ServerLoad>> loads = checked_loads(*messages);
    if (absl::IsInternal(loads.status())) log(std::string(loads.status().message()), Severity::kWarning);
    if (loads.ok() && !world.sequencer.awaits_map()) {
      const bool shares_out = world.shares_left > 0;
      const BalancePlan plan =
          shares_out ? plan_balance(world.map, *loads, options_.balance_policy)
                     : world.consolidation.next(world.map, *loads, options_.balance_policy,
                                                std::chrono::duration<double>(world.settings.time_step),
                                                world.sequencer.period());
      if (shares_out) world.shares_left = plan.moves() ? world.shares_left - 1 : 0;
      if (plan.moves()) {
        set_map(plan.map, plan.moved_sectors, plan.moved_bodies);
        log(describe(plan));
      }
    }
  }
  if (world.shares_left > 0 && !world.recovering() && has_last_map()) return ask_for_load();
  if (!may_balance() || now < world.next_balance) return;
  const bool is_first = world.next_balance == Nanoseconds::zero();
  world.next_balance = now + options_.balance_every;
  if (!is_first) ask_for_load();
}

// Of all servers, unless they are being asked.
void Coordinator::Impl::ask_for_load() {
  ActiveWorld& world = *world_;
  if (world.awaits_load || !world.queries.room().ok()) return;
  world.awaits_load = true;
  // The world calls this, so `world` exists.
  world.sequencer.ask(
      load_query([&world](const absl::Status& status, Tick, std::vector<v1::ServerLoad> loads) {
        world.awaits_load = false;
        if (status.ok()) world.fresh_load = std::move(loads);
      }));
}

v1::Query Coordinator::Impl::load_query(Queries::LoadReply reply) {
  return world_->queries.load(std::chrono::duration<double>(options_.balance_ahead).count(),
                              std::move(reply));
}

void Coordinator::Impl::set_map(const SectorMap& map, std::uint64_t moved_sectors,
                                std::uint64_t moved_bodies) {
  world_->map = map;
  world_->moved_sectors += moved_sectors;
  world_->moved_bodies += moved_bodies;
  world_->sequencer.set_map(map_message(map));
}

void Coordinator::Impl::on(Call<v1::BalanceRequest, v1::BalanceReply>& call, Nanoseconds) {
  const absl::StatusOr<ActiveWorld*> live = live_world();
  if (!live.ok()) return call.reply(live.status(), {});
  ActiveWorld& world = **live;
  if (world.settings.shuffle != 0) {
    return call.reply(absl::FailedPreconditionError("authority over the world's sectors moves at random "
                                                    "(shuffle), so that it cannot be balanced"),
                      {});
  }
  BalancePolicy policy = options_.balance_policy;
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
  if (absl::Status status = world.queries.room(); !status.ok()) return call.reply(status, {});
  if (absl::Status status = world.sequencer.room_for_query(); !status.ok()) return call.reply(status, {});
  // The world calls this, so `world` exists.
  world.sequencer.ask(
      load_query([this, &world, policy, dry_run = call.request.dry_run(), reply = std::move(call.reply)](
                     const absl::Status& status, Tick tick, std::vector<v1::ServerLoad> messages) {
        if (!status.ok()) return reply(status, {});
        const absl::StatusOr<std::vector<ServerLoad>> loads = checked_loads(messages);
        if (!loads.ok()) return reply(loads.status(), {});
        if (!may_share_out())
          return reply(absl::UnavailableError("the servers of the world are changing: ask again"), {});
        const BalancePlan plan = plan_balance(world.map, *loads, policy);
        v1::BalanceReply answer;
        answer.set_tick(tick);
        for (std::size_t rank = 0; rank < world.nodes.size(); ++rank) {
          v1::BalanceReply::ServerShare& share = *answer.add_shares();
          share.set_node(world.nodes[rank].value);
          share.set_tick_us(plan.tick_us[rank]);
          share.set_tick_us_then(plan.tick_us_then[rank]);
        }
        answer.set_moved_sectors(plan.moved_sectors);
        answer.set_moved_bodies(plan.moved_bodies);
        answer.set_moves(plan.moves() && !dry_run && !world.sequencer.awaits_map());
        if (answer.moves()) {
          set_map(plan.map, plan.moved_sectors, plan.moved_bodies);
          log(describe(plan));
        }
        reply(absl::OkStatus(), answer);
      }));
}

}  // namespace tessera
