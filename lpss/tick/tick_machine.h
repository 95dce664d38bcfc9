// The tick of one partition as a state machine without I/O: it takes messages and gives back messages.
//
// One process that hosts everything has one partition (rank 0 of 1) and hands its own messages back to it; n
// servers have n and carry the messages. Both run this code, and end in the same bits.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "lpss/tick/agreement.h"
#include "lpss/tick/context.h"
#include "lpss/tick/gathering.h"
#include "lpss/tick/joint_ends.h"
#include "lpss/tick/links.h"
#include "lpss/tick/parallel.h"
#include "lpss/tick/phase_clock.h"
#include "lpss/tick/programs.h"
#include "lpss/tick/round.h"
#include "lpss/tick/solve.h"
#include "lpss/tick/staged.h"
#include "lpss/tick/transfer.h"

namespace tessera {

class TickMachine {
 public:
  struct Options {
    ParallelFor parallel;  // empty: one after the other
    TimeSource time{};     // empty: phases are not timed
    Tick tick = 0;         // completed, by the machines that brought the partition to its state
  };

  // The partition must outlive the machine. Between ticks it may be changed from outside.
  TickMachine(Partition& partition, Options options);

  // Between ticks: a round in which sectors change servers, which all of the new map take part in.
  std::optional<Round> change_map(MapChange change);

  // Starts a tick. All servers get all commands, which take effect at once. Nothing to say, and the tick is
  // over, where the whole world is at rest.
  std::optional<Round> begin_tick(std::span<const Command> commands);

  // Whether a message is of the kind of the last round.
  bool awaits(const RoundMessage& message) const {
    return message.index() + 1 == static_cast<std::size_t>(awaited_);
  }

  // Goes on with what the ranks in the last round's `from` sent in that round. Nothing once the tick is over,
  // or the map is changed.
  std::optional<Round> advance(std::vector<std::optional<RoundMessage>> inbox);

  // Does some of what needs nobody: worth a call while others' messages are on their way.
  void work_while_waiting();

  // To whom this server is linked, if all do not talk to all.
  const Links& links() const { return links_; }

  const Partition& partition() const { return partition_; }
  Partition& partition() { return partition_; }

  // --- of the last tick ---

  const TickCounts& counts() const { return context_.counts; }

  // Joints that programs removed at its beginning, whether they were there or not; the same on all servers.
  const std::vector<JointId>& joints_removed() const { return context_.joints_removed; }
  // Bodies that diverged, ascending by (body, kind).
  const std::vector<Divergence>& divergences() const { return context_.divergences; }

  // Ascending by (a, b); only gathered while they are reported (events.h).
  const std::vector<ContactEvent>& contact_events() const { return context_.events; }

  // Without the time between the calls; zero without a time source.
  const PhaseTimes& phase_times() const { return clock_.times(); }

 private:
  // One function a round: what the messages of the last one make possible, up to the messages of this one.
  std::optional<Round> transfer_round(MapChange change);
  std::optional<Round> exchange_round();
  Round seams_round(std::vector<Exchange> inbox);
  std::optional<Round> gathering_round(const std::vector<std::shared_ptr<const Seams>>& inbox);
  Round shipment_round(std::span<const SectorIndex> awake);
  Round begin_solving(std::vector<Shipment> inbox);
  Round go_on_solving();
  Round solution_round();
  void take(const Solution& solution);
  void note_loads(JointId joint, const JointLoads& loads);
  std::optional<Round> integrate_round(const std::vector<Solution>& inbox);
  std::optional<Round> run_programs(const std::vector<ProgramAnswers>& inbox);
  void take_acts(std::vector<ProgramActs> acts);
  void end_tick();
  void note_divergences();
  void rest();

  Round round(RoundKind kind, std::uint32_t repetition = 0);

  // Whether servers talk over links alone (links.h).
  bool by_links() const { return partition_.map.servers() > partition_.all_linked_max; }
  // All servers agree on what is to be in the round to come, in which pending_ is sent.
  std::optional<Round> agree(Agreement said, RoundKind next);
  std::optional<Round> act_on_agreement();
  // A round with those that are linked, or call, or are called. What is pending is sent.
  Round linked_round(RoundKind kind, std::span<const Call> calls, std::uint32_t repetition = 0);
  void note_links(const std::vector<std::optional<RoundMessage>>& inbox);

  Partition& partition_;
  ParallelFor parallel_;
  PhaseClock clock_;
  SolverPool solvers_;
  Queries queries_;  // of programs
  Tick tick_ = 0;
  bool between_ticks_ = true;
  RoundKind awaited_ = RoundKind::kIdle;
  TickContext context_;

  // While not all talk to all.
  Links links_;
  AgreementTree tree_;
  std::uint32_t agreements_ = 0;            // in this tick
  RoundKind agreed_on_ = RoundKind::kIdle;  // the round that the agreement is about
  std::map<Rank, RoundMessage> pending_;    // what is to be sent in it, if not nothing
  JointHosts joint_hosts_;                  // in this tick
  std::optional<Gathering> gathering_;
  std::uint32_t gatherings_ = 0;  // rounds of it
  // Others may not know of the parts of islands that were at rest when the machine, or the map, was made.
  bool tells_all_parts_ = true;

  // While islands are solved.
  std::optional<JobQueue> queue_;
  std::vector<Shipment> shipments_;  // to which what is solved refers
  std::optional<ShippedIslands> shipped_;
  std::optional<StagedSolve> staged_;
  std::vector<std::unique_ptr<StagedSolver>> staged_solvers_;

  bool has_programs_ = false;  // somebody hosts some, in this tick
  std::optional<ProgramPhase> programs_;
};

}  // namespace tessera
