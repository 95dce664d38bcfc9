// The tick as a state machine: what is said in which round, and who has to be heard.
#include <absl/cleanup/cleanup.h>

#include <type_traits>

#include "lpss/base/invariant.h"
#include "lpss/tick/share.h"

namespace tessera {
namespace {

using Inbox = std::vector<std::optional<RoundMessage>>;

// The messages of one kind by rank; a default one where a rank had nothing to say.
template <typename Message>
std::vector<Message> messages(Inbox& inbox) {
  std::vector<Message> result(inbox.size());
  for (std::size_t rank = 0; rank < inbox.size(); ++rank) {
    if (!inbox[rank]) continue;
    Message* message = std::get_if<Message>(&*inbox[rank]);
    invariant(message != nullptr, "a message belongs to the round that it was sent in");
    result[rank] = std::move(*message);
  }
  return result;
}

template <typename Message>
void address(Round& round, std::vector<Message> outbox) {
  for (std::size_t rank = 0; rank < outbox.size(); ++rank) round.to[rank] = std::move(outbox[rank]);
}

}  // namespace

Round Share::round(Phase phase, std::uint32_t pass) {
  phase_ = phase;
  Round result;
  result.number = static_cast<std::uint32_t>(phase) + pass;
  result.to.resize(options_.map.servers());
  result.from.assign(options_.map.servers(), false);
  return result;
}

std::optional<Round> Share::begin_tick(std::span<const Command> commands) {
  invariant(phase_ == Phase::kIdle, "a tick begins after the last one has ended");
  ++tick_;
  counts_ = {};
  phase_clock_.reset();
  const absl::Cleanup leave = [this] { phase_clock_.leave(); };
  if (at_rest_ && commands.empty()) {
    rest();
    return std::nullopt;
  }
  at_rest_ = false;
  commands_.assign(commands.begin(), commands.end());
  if (!shuffles()) return exchange();
  phase_clock_.enter(TickPhase::kExchange);
  Round result = round(Phase::kTransfer);
  address(result, give_sectors_away());
  result.from.flip();
  return result;
}

std::optional<Round> Share::advance(std::vector<std::optional<RoundMessage>> inbox) {
  const absl::Cleanup leave = [this] { phase_clock_.leave(); };
  switch (phase_) {
    case Phase::kIdle:
      break;
    case Phase::kTransfer:
      phase_clock_.enter(TickPhase::kExchange);
      take_sectors(messages<Transfer>(inbox));
      return exchange();
    case Phase::kExchange: {
      phase_clock_.enter(TickPhase::kExchange);
      std::vector<Exchange> received = messages<Exchange>(inbox);
      at_rest_ = std::all_of(received.begin(), received.end(), [](const Exchange& e) { return e.quiet; });
      if (!at_rest_) return seams_round(std::move(received));
      rest();
      return std::nullopt;
    }
    case Phase::kSeams: {
      phase_clock_.enter(TickPhase::kIslands);
      const auto received = messages<std::shared_ptr<const Seams>>(inbox);
      std::vector<const Seams*> seams;
      for (const auto& message : received) seams.push_back(message.get());
      return shipment_round(seams);
    }
    case Phase::kShipment:
      phase_clock_.enter(TickPhase::kSolving);
      return after_shipments(messages<Shipment>(inbox));
    case Phase::kCoupling:
      phase_clock_.enter(TickPhase::kSolving);
      return after_coupling(messages<Coupling>(inbox));
    case Phase::kSolution:
      phase_clock_.enter(TickPhase::kIntegration);
      finish(messages<Solution>(inbox));
      phase_ = Phase::kIdle;
      return std::nullopt;
  }
  invariant(false, "a tick advances after it has begun");
  return std::nullopt;
}

// The rest of a tick in which nothing in the whole world moves.
void Share::rest() {
  phase_ = Phase::kIdle;
  stepped_.clear();
  events_.clear();
  count();
}

std::optional<Round> Share::exchange() {
  std::vector<Exchange> outbox = tell_of_seams();
  Round result = round(Phase::kExchange);
  address(result, std::move(outbox));
  result.from.flip();
  return result;
}

Round Share::seams_round(std::vector<Exchange> inbox) {
  const auto seams = std::make_shared<const Seams>(detect(std::move(inbox)));
  Round result = round(Phase::kSeams);
  for (auto& message : result.to) message = seams;
  result.from.flip();
  return result;
}

Round Share::shipment_round(const std::vector<const Seams*>& inbox) {
  std::vector<Shipment> outbox = join(inbox);
  Round result = round(Phase::kShipment);
  for (Rank rank = 0; rank < outbox.size(); ++rank) {
    result.from[rank] = awaits_shipment_[rank] || coupled_with_[rank];
    if (!outbox[rank].islands.empty() || coupled_with_[rank]) result.to[rank] = std::move(outbox[rank]);
  }
  return result;
}

Round Share::after_shipments(std::vector<Shipment> inbox) {
  begin_parts(inbox);
  solutions_ = solve(std::move(inbox));
  pass_ = 0;
  return coupled_.empty() ? solution_round() : coupling_round();
}

Round Share::coupling_round() {
  std::vector<Coupling> outbox = changes_of_parts();
  Round result = round(Phase::kCoupling, pass_);
  for (Rank rank = 0; rank < outbox.size(); ++rank) {
    result.from[rank] = coupled_with_[rank];
    if (coupled_with_[rank]) result.to[rank] = std::move(outbox[rank]);
  }
  return result;
}

Round Share::after_coupling(std::vector<Coupling> inbox) {
  agree(inbox);
  const auto passes = static_cast<std::uint32_t>(coupled_.front().solver->passes());
  run_parallel(coupled_.size(), [&](std::size_t n) {
    PartSolver& solver = *coupled_[n].solver;
    if (pass_ < passes) {
      solver.pass(static_cast<int>(pass_));
    } else {
      solver.end();
    }
  });
  if (pass_++ < passes) return coupling_round();
  coupled_.clear();
  return solution_round();
}

Round Share::solution_round() {
  Round result = round(Phase::kSolution);
  for (Rank rank = 0; rank < solutions_.size(); ++rank) {
    result.from[rank] = awaits_solution_[rank] || rank == options_.self;
    if (awaits_shipment_[rank] || rank == options_.self) result.to[rank] = std::move(solutions_[rank]);
  }
  return result;
}

}  // namespace tessera
