#include "lpss/tick/tick_machine.h"

#include <absl/cleanup/cleanup.h>
#include <absl/container/flat_hash_set.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "lpss/base/invariant.h"
#include "lpss/partition/packing.h"
#include "lpss/partition/statics.h"
#include "lpss/tick/burden.h"
#include "lpss/tick/cloning.h"
#include "lpss/tick/commands.h"
#include "lpss/tick/components.h"
#include "lpss/tick/contact_points.h"
#include "lpss/tick/crossings.h"
#include "lpss/tick/detect.h"
#include "lpss/tick/events.h"
#include "lpss/tick/exchange.h"
#include "lpss/tick/foresee.h"
#include "lpss/tick/frames.h"
#include "lpss/tick/homes.h"
#include "lpss/tick/integrate.h"
#include "lpss/tick/islands.h"
#include "lpss/tick/report.h"
#include "lpss/tick/seam_search.h"
#include "lpss/tick/ship.h"
#include "lpss/tick/sleep.h"
#include "lpss/tick/transfer.h"
#include "lpss/tick/triggers.h"

namespace tessera {
namespace {

constexpr Tick kTicksPerLookAhead = 8;

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

bool is_nothing(const RoundMessage& message) {
  if (const auto* transfer = std::get_if<Transfer>(&message))
    return transfer->sectors.empty() && !transfer->heard;
  if (const auto* exchange = std::get_if<Exchange>(&message)) return exchange->empty();
  if (const auto* seams = std::get_if<std::shared_ptr<const Seams>>(&message))
    return (*seams)->sectors.empty();
  return false;
}

RoundMessage nothing(RoundKind kind) {
  if (kind == RoundKind::kTransfer) return Transfer{};
  if (kind == RoundKind::kExchange) return Exchange{};
  return std::make_shared<const Seams>();
}

// Parts of sectors at rest, which others may not know.
void tell_all_parts(const Partition& partition, Seams& found) {
  if (partition.map.servers() == 1) return;
  absl::flat_hash_set<SectorIndex> told;
  for (const SectorSeams& seams : found.sectors) told.insert(seams.sector);
  for (SectorSeams& seams : partition.seam_graph.reported()) {
    if (!partition.hosts(seams.sector) || told.contains(seams.sector)) continue;
    seams.is_news = false;
    found.sectors.push_back(std::move(seams));
  }
}

// Those that are not empty.
template <typename Message>
std::map<Rank, RoundMessage> worth_sending(std::vector<Message> outbox) {
  std::map<Rank, RoundMessage> result;
  for (Rank rank = 0; rank < outbox.size(); ++rank) {
    RoundMessage message = std::move(outbox[rank]);
    if (!is_nothing(message)) result.emplace(rank, std::move(message));
  }
  return result;
}

std::map<Rank, RoundMessage> as_messages(std::map<Rank, Seams> news) {
  std::map<Rank, RoundMessage> result;
  for (auto& [rank, seams] : news) result.emplace(rank, std::make_shared<const Seams>(std::move(seams)));
  return result;
}

void drop_empty_sectors(Partition& partition, Vacated& vacated) {
  std::erase_if(partition.active, [&](Sector* sector) { return drop_if_empty(partition, *sector, vacated); });
  std::sort(partition.active.begin(), partition.active.end(),
            [](const Sector* a, const Sector* b) { return a->index < b->index; });
}

}  // namespace

Round make_round(RoundKind kind, std::size_t servers, std::uint32_t repetition) {
  constexpr int kRepetitionBits = 24;
  Round result;
  result.number = (static_cast<std::uint32_t>(kind) << kRepetitionBits) + repetition;
  result.to.resize(servers);
  result.from.assign(servers, false);
  return result;
}

TickMachine::TickMachine(Partition& partition, Options options)
    : partition_(partition),
      parallel_(std::move(options.parallel)),
      clock_(std::move(options.time)),
      solvers_(partition.engine),
      queries_(partition),
      tick_(options.tick) {
  set_felt(partition_, tick_);
}

Round TickMachine::round(RoundKind kind, std::uint32_t repetition) {
  awaited_ = kind;
  return make_round(kind, partition_.map.servers(), repetition);
}

std::optional<Round> TickMachine::agree(Agreement said, RoundKind next) {
  for (const auto& [rank, message] : pending_) {
    if (rank != partition_.self && !links_.contains(rank)) said.calls.push_back({partition_.self, rank});
  }
  agreed_on_ = next;
  awaited_ = RoundKind::kAgreement;
  if (auto round = tree_.begin(partition_.self, partition_.map.servers(), std::move(said), agreements_++))
    return round;
  return act_on_agreement();
}

std::optional<Round> TickMachine::act_on_agreement() {
  const Agreement& agreed = tree_.result();
  if (agreed_on_ == RoundKind::kSeams) {
    if (agreed.goes_on) return linked_round(RoundKind::kSeams, agreed.calls, ++gatherings_);
    const std::vector<SectorIndex> awake = gathering_->awake();
    gathering_.reset();
    return shipment_round(awake);
  }
  if (agreed_on_ == RoundKind::kTransfer) return linked_round(RoundKind::kTransfer, agreed.calls);
  partition_.at_rest = agreed.quiet;
  if (agreed.quiet) {
    rest();
    return std::nullopt;
  }
  has_programs_ = agreed.has_programs;
  for (const JointHost& joint : agreed.joint_hosts) joint_hosts_.emplace(joint.body, joint.host);
  return linked_round(RoundKind::kExchange, agreed.calls);
}

Round TickMachine::linked_round(RoundKind kind, std::span<const Call> calls, std::uint32_t repetition) {
  Round result = round(kind, repetition);
  links_.for_each([&](Rank rank) {
    result.from[rank] = true;
    result.to[rank] = nothing(kind);
  });
  for (const Call& call : calls) result.from[call.from] = true;
  for (auto& [rank, message] : pending_) {
    if (rank == partition_.self) {
      result.from[rank] = true;
    } else {
      links_.note(rank, tick_);
    }
    result.to[rank] = std::move(message);
  }
  pending_.clear();
  return result;
}

void TickMachine::note_links(const Inbox& inbox) {
  for (Rank rank = 0; rank < inbox.size(); ++rank) {
    if (inbox[rank] && rank != partition_.self && !is_nothing(*inbox[rank])) links_.note(rank, tick_);
  }
}

std::optional<Round> TickMachine::begin_tick(std::span<const Command> commands) {
  invariant(awaited_ == RoundKind::kIdle, "a tick begins after the last one has ended");
  context_ = {};
  context_.tick = ++tick_;
  clock_.reset();
  const absl::Cleanup leave = [this] { clock_.leave(); };
  if (begin_frames(partition_, tick_)) partition_.at_rest = false;
  if (partition_.at_rest && commands.empty()) {
    rest();
    return std::nullopt;
  }
  partition_.at_rest = false;
  between_ticks_ = false;
  agreements_ = 0;
  links_.forget_old(tick_);
  context_.commands = std::exchange(partition_.acts, {});
  for (const Command& act : context_.commands) {
    if (const auto* removal = std::get_if<RemoveJoint>(&act)) context_.joints_removed.push_back(removal->id);
  }
  context_.commands.insert(context_.commands.end(), commands.begin(), commands.end());
  std::optional<SectorMap> map = shuffled_map(partition_, tick_);
  return map ? transfer_round({*std::move(map), partition_.self}) : exchange_round();
}

std::optional<Round> TickMachine::change_map(MapChange change) {
  invariant(awaited_ == RoundKind::kIdle, "a map changes between ticks");
  const absl::Cleanup leave = [this] { clock_.leave(); };
  between_ticks_ = true;
  agreements_ = 0;
  return transfer_round(std::move(change));
}

std::optional<Round> TickMachine::advance(std::vector<std::optional<RoundMessage>> inbox) {
  const absl::Cleanup leave = [this] { clock_.leave(); };
  switch (awaited_) {
    case RoundKind::kIdle:
      break;
    case RoundKind::kAgreement:
      if (auto next = tree_.advance(messages<Agreement>(inbox))) return next;
      return act_on_agreement();
    case RoundKind::kTransfer:
      clock_.enter(TickPhase::kExchange);
      if (by_links()) note_links(inbox);
      take_sectors(partition_, messages<Transfer>(inbox));
      if (!between_ticks_) return exchange_round();
      partition_.at_rest = false;  // the next tick looks at what has come
      awaited_ = RoundKind::kIdle;
      return std::nullopt;
    case RoundKind::kExchange: {
      if (by_links()) note_links(inbox);
      std::vector<Exchange> received = messages<Exchange>(inbox);
      if (by_links()) return seams_round(std::move(received));
      partition_.at_rest =
          std::all_of(received.begin(), received.end(), [](const Exchange& e) { return e.quiet; });
      has_programs_ = std::ranges::any_of(received, &Exchange::has_programs);
      if (!partition_.at_rest) return seams_round(std::move(received));
      rest();
      return std::nullopt;
    }
    case RoundKind::kSeams: {
      if (by_links()) note_links(inbox);
      const auto received = messages<std::shared_ptr<const Seams>>(inbox);
      if (by_links()) return gathering_round(received);
      std::vector<const Seams*> seams;
      for (const auto& message : received) seams.push_back(message.get());
      clock_.enter(TickPhase::kIslands);
      return shipment_round(take_parts(partition_, seams));
    }
    case RoundKind::kShipment:
      return begin_solving(messages<Shipment>(inbox));
    case RoundKind::kMotions:
      clock_.enter(TickPhase::kSolving);
      staged_->take(messages<Motions>(inbox));
      return go_on_solving();
    case RoundKind::kSolution:
      return integrate_round(messages<Solution>(inbox));
    case RoundKind::kAsks: {
      clock_.enter(TickPhase::kPrograms);
      if (programs_->take(messages<ProgramAsks>(inbox))) {
        Round again = round(RoundKind::kAsks, 1);
        address(again, programs_->ask_everybody());
        again.from.flip();
        return again;
      }
      if (!programs_->are_asked()) return run_programs({});
      Round result = round(RoundKind::kAnswers);
      address(result, programs_->answer());
      result.from.flip();
      return result;
    }
    case RoundKind::kAnswers:
      return run_programs(messages<ProgramAnswers>(inbox));
    case RoundKind::kActs:
      clock_.enter(TickPhase::kPrograms);
      take_acts(messages<ProgramActs>(inbox));
      end_tick();
      return std::nullopt;
  }
  invariant(false, "a tick advances after it has begun");
  return std::nullopt;
}

std::optional<Round> TickMachine::transfer_round(MapChange change) {
  clock_.enter(TickPhase::kExchange);
  // All servers change the map at once, so all begin anew with it.
  links_.clear();
  const bool begins_anew =
      by_links() || change.newcomers > 0 || change.map.servers() != partition_.map.servers();
  tells_all_parts_ |= begins_anew;
  std::vector<Transfer> outbox = give_sectors(partition_, std::move(change));
  if (begins_anew) forget_parts_of_others(partition_);
  if (by_links()) {
    pending_ = worth_sending(std::move(outbox));
    return agree({}, RoundKind::kTransfer);
  }
  Round result = round(RoundKind::kTransfer);
  address(result, std::move(outbox));
  result.from.flip();
  return result;
}

std::optional<Round> TickMachine::exchange_round() {
  std::vector<Exchange> outbox(partition_.map.servers());
  clock_.enter(TickPhase::kSectorization);
  load_carriers(partition_);
  // Also where all of them are about to leave for others.
  bool has_programs = partition_.programmed_count > 0 || may_cross(partition_) || !partition_.carried.empty();
  std::vector<HomeChange> jumps = apply_commands(partition_, context_.commands, outbox, context_.stopped);
  foresee_drives(partition_);
  send_contact_points(partition_, outbox);
  change_homes(partition_, std::move(jumps), outbox);
  attend_borders(partition_, parallel_);
  announce_home_changes(partition_, context_.stopped, parallel_);

  clock_.enter(TickPhase::kSeamSearch);
  search_seams(partition_, parallel_);

  clock_.enter(TickPhase::kExchange);
  tell_of_replicas(partition_, outbox, parallel_);
  const bool quiet = partition_.active.empty() && context_.commands.empty();
  has_programs |= partition_.programmed_count > 0;
  if (by_links()) {
    joint_hosts_.clear();
    Agreement said{
        .quiet = quiet, .has_programs = has_programs, .joint_ends = joint_ends(partition_, outbox)};
    pending_ = worth_sending(std::move(outbox));
    return agree(std::move(said), RoundKind::kExchange);
  }
  for (Exchange& message : outbox) {
    message.quiet = quiet;
    message.has_programs = has_programs;
  }

  Round result = round(RoundKind::kExchange);
  address(result, std::move(outbox));
  result.from.flip();
  return result;
}

Round TickMachine::seams_round(std::vector<Exchange> inbox) {
  clock_.enter(TickPhase::kExchange);
  take_replicas(partition_, inbox, parallel_);
  clock_.enter(TickPhase::kSectorization);
  take_homes(partition_, inbox);
  list_far_clones(partition_);
  drop_empty_sectors(partition_, context_.vacated);

  clock_.enter(TickPhase::kCloning);
  update_clones(partition_, parallel_);
  clock_.enter(TickPhase::kSectorization);
  take_contact_points(partition_, inbox);

  clock_.enter(TickPhase::kDetection);
  context_.burdens = begin_burdens(partition_);
  context_.stepped = detect(partition_, parallel_);
  context_.trigger_events =
      look_at_triggers(partition_, tick_, context_.vacated, parallel_, context_.changed_triggers);

  clock_.enter(TickPhase::kIslands);
  Seams found = find_components(partition_, parallel_, context_.vacated);
  if (by_links()) {
    gatherings_ = 0;
    gathering_.emplace(partition_, found, joint_hosts_);
    pending_ = as_messages(gathering_->news([this](Rank rank) { return links_.contains(rank); }));
    return linked_round(RoundKind::kSeams, {});
  }
  if (std::exchange(tells_all_parts_, false)) tell_all_parts(partition_, found);
  const auto seams = std::make_shared<const Seams>(std::move(found));
  Round result = round(RoundKind::kSeams);
  for (auto& message : result.to) message = seams;
  result.from.flip();
  return result;
}

std::optional<Round> TickMachine::gathering_round(const std::vector<std::shared_ptr<const Seams>>& inbox) {
  clock_.enter(TickPhase::kIslands);
  for (Rank rank = 0; rank < inbox.size(); ++rank) {
    if (inbox[rank]) gathering_->take(rank, *inbox[rank]);
  }
  pending_ = as_messages(gathering_->news([](Rank) { return true; }));
  return agree({.goes_on = !pending_.empty()}, RoundKind::kSeams);
}

Round TickMachine::shipment_round(std::span<const SectorIndex> awake) {
  clock_.enter(TickPhase::kIslands);
  std::vector<Shipment> outbox = plan_islands(partition_, context_, awake, parallel_);
  queue_.emplace(partition_.dt(), parallel_, solvers_);
  queue_->add(std::move(context_.plan.jobs));
  Round result = round(RoundKind::kShipment);
  result.from = context_.plan.awaits_shipment;
  for (Rank rank = 0; rank < outbox.size(); ++rank) {
    const bool is_in_step = context_.plan.in_step.contains(rank);
    if (is_in_step || !outbox[rank].islands.empty()) result.to[rank] = std::move(outbox[rank]);
  }
  return result;
}

Round TickMachine::begin_solving(std::vector<Shipment> inbox) {
  shipments_ = std::move(inbox);
  clock_.enter(TickPhase::kSolving);
  shipped_.emplace(context_.plan, shipments_, *queue_);
  if (!context_.plan.staged.empty()) staged_.emplace(partition_, context_.plan, shipments_, staged_solvers_);
  return go_on_solving();
}

Round TickMachine::go_on_solving() {
  if (staged_) {
    if (std::optional<Round> exchange = staged_->go_on()) {
      awaited_ = RoundKind::kMotions;
      return *std::move(exchange);
    }
  }
  return solution_round();
}

Round TickMachine::solution_round() {
  queue_->finish();
  std::vector<Solution> solutions = shipped_->solutions();
  context_.blamed = queue_->blamed();
  queue_->for_each_joint([this](JointId id, const JointLoads& loads) { note_loads(id, loads); });
  Round result = round(RoundKind::kSolution);
  for (Rank rank = 0; rank < solutions.size(); ++rank) {
    const bool self = rank == partition_.self;
    result.from[rank] = context_.plan.awaits_solution[rank] || self;
    if (!solutions[rank].islands.empty() || self) result.to[rank] = std::move(solutions[rank]);
  }
  queue_.reset();
  shipped_.reset();
  staged_.reset();
  shipments_.clear();
  return result;
}

// Spread over all exchanges, so that each is worth waiting for.
void TickMachine::work_while_waiting() {
  if (!queue_) return;
  const absl::Cleanup leave = [this] { clock_.leave(); };
  clock_.enter(TickPhase::kSolving);
  if (context_.plan.staged.empty()) {
    queue_->finish();
  } else if (staged_) {
    queue_->run(1.0 / staged_->sweeps());
  }
}

void TickMachine::take(const Solution& solution) {
  take_solution(context_.plan, solution);
  for (const auto& [body, joint] : solution.blamed) context_.blamed[body] = joint;
  for (const auto& [joint, loads] : solution.joint_loads) note_loads(joint, loads);
}

// Of a joint that may live elsewhere.
void TickMachine::note_loads(JointId joint, const JointLoads& loads) {
  if (JointRecord* const record = partition_.joints.record(joint)) record->loads = loads;
}

std::optional<Round> TickMachine::integrate_round(const std::vector<Solution>& inbox) {
  clock_.enter(TickPhase::kIntegration);
  for (const Solution& solution : inbox) take(solution);
  context_.events = gather_events(partition_, tick_, context_.stepped, context_.vacated, parallel_);
  std::move(context_.trigger_events.begin(), context_.trigger_events.end(),
            std::back_inserter(context_.events));
  const std::vector<Stopped> stopped = integrate(partition_, context_.stepped, parallel_);
  context_.stopped.insert(context_.stopped.end(), stopped.begin(), stopped.end());
  if (!has_programs_) {
    end_tick();
    return std::nullopt;
  }
  clock_.enter(TickPhase::kPrograms);
  programs_.emplace(partition_, queries_, tick_, parallel_);
  Round result = round(RoundKind::kAsks);
  address(result, programs_->ask());
  result.from.flip();
  return result;
}

std::optional<Round> TickMachine::run_programs(const std::vector<ProgramAnswers>& inbox) {
  clock_.enter(TickPhase::kPrograms);
  ProgramActs acts = programs_->run(inbox);
  context_.counts.programs = programs_->instances();
  programs_.reset();
  append_wakes(context_.changed_triggers, acts);
  append_crossings(partition_, tick_, acts);
  append_carried(partition_, acts);
  end_burdens(partition_, context_.burdens);
  acts.burdens = std::move(context_.burdens);
  Round result = round(RoundKind::kActs);
  for (auto& message : result.to) message = acts;
  result.from.flip();
  return result;
}

// Bodies change frames after programs have acted on them, which saw them in the frame before.
void TickMachine::take_acts(std::vector<ProgramActs> acts) {
  const std::vector<CarriedFrame> before = partition_.carried;
  take_carried(partition_, acts);
  partition_.acts = collected_acts(acts);
  for (Command& push : bear_burdens(partition_, tick_, before, acts))
    partition_.acts.push_back(std::move(push));
  std::vector<Crossing> crossings;
  for (ProgramActs& some : acts) std::ranges::move(some.crossings, std::back_inserter(crossings));
  for (const Teleport& jump : agreed_jumps(partition_, tick_, std::move(crossings)))
    partition_.acts.push_back(jump);
}

void TickMachine::end_tick() {
  clock_.enter(TickPhase::kIntegration);
  note_divergences();
  count(partition_, context_.stepped, parallel_, context_.counts);
  if (tick_ % kTicksPerLookAhead == 0) look_ahead_for_ground(partition_);
  retire_sectors(partition_);
  pack_resting(partition_);
  awaited_ = RoundKind::kIdle;
}

void TickMachine::note_divergences() {
  context_.divergences = divergences_of(tick_, context_.stopped, context_.blamed);
  context_.counts.diverged = context_.divergences.size();
}

// The rest of a tick in which nothing in the whole world moves.
void TickMachine::rest() {
  awaited_ = RoundKind::kIdle;
  note_divergences();
  count(partition_, {}, parallel_, context_.counts);
  pack_resting(partition_);
}

}  // namespace tessera
