// The sequence of a world: the tick at which each command takes effect, and how far the servers may run.
#pragma once

#include <absl/container/btree_map.h>
#include <absl/status/status.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "cluster.pb.h"
#include "coordinator/fatal_tick.h"
#include "lpss/grid/sector_map.h"
#include "lpss/model/program.h"
#include "lpss/tick/messages.h"
#include "proto/wire.h"
#include "store.pb.h"

namespace tessera {

// Commands that take effect together, with what they need, which is added before them.
struct SequencedCommands {
  PackedCommands commands;
  std::vector<v1::NumberedShape> new_shapes;
  ProgramModules new_modules;
};

// As grants carry it, with the servers that there are.
v1::SectorMap map_message(const SectorMap& map);

// A grant carries several ticks if possible, and its commands apply at the first of them. The next grant
// always begins with the tick after the last one granted, so a command's tick is known as soon as it is
// accepted.
//
// What was granted can be granted again: after rewind() the servers, or others in their place, repeat the
// ticks since a checkpoint with the same commands. To clients that is only a delay: the ticks of commands
// stay what they were told, and completed() does not go back.
class Sequencer {
 public:
  using Nanoseconds = std::chrono::nanoseconds;
  using Reply = std::function<void(const absl::Status&, Tick)>;

  struct Options {
    std::uint64_t world = 0;
    std::size_t servers = 1;
    double time_step = 1.0 / 60;      // s
    std::uint32_t grant_window = 32;  // ticks granted ahead of the slowest server, at least 1
    Tick tick = 0;                    // completed before the sequence begins
    bool keeps_past = false;          // so that rewind() may be called
  };

  explicit Sequencer(const Options& options);

  double time_step() const { return options_.time_step; }  // s

  // Whether the world is paused, or will be once all granted ticks are done.
  bool paused() const { return mode_ == Mode::kPaused; }
  // Whether there are ticks to come by themselves: it runs, steps, or repeats what was done.
  bool ticks() const { return more_to_come(); }
  Tick completed() const { return reached_; }  // by all servers, at any time
  // The last tick that is certain to run, with what takes effect up to it: the last one granted so far.
  Tick certain() const { return certain_; }
  // Whether ticks that were granted before rewind() have yet to be granted again.
  bool replaying() const { return granted_ < certain_; }

  // The servers, `servers` of them now, are at the end of tick `tick`, which none of forget_past() has
  // passed, and go on from there as world `world`. `in_doubt`: those that were granted and never completed
  // are granted again one by one, so that it is known which of them cannot be.
  void rewind(std::uint64_t world, std::size_t servers, Tick tick, bool in_doubt = false);

  // The ticks that servers carry out now, where these have never been completed.
  std::optional<TicksUnderWay> new_ticks_under_way() const;
  bool has_commands_at(Tick tick) const;

  // The world will not be set back to before the end of this tick.
  void forget_past(Tick tick);

  // RESOURCE_EXHAUSTED if submit(), with so many commands, or ask() must not be called at present.
  absl::Status room_for_commands(std::size_t commands, std::size_t shape_bytes) const;
  absl::Status room_for_question() const;

  // The tick at whose beginning the next commands that are submitted take effect.
  Tick next_command_tick() const;

  // Takes checked commands: they take effect together, at next_command_tick().
  void submit(SequencedCommands commands);

  // Asks a question that is answered after all ticks that are certain, but not before the end of tick
  // `after`, as long as the world goes on up to that.
  void ask(v1::Question question, Tick after = 0);

  // Asks one that is answered before any further tick is granted: held() has all that is to come.
  void ask_first(v1::Question question);

  // The commands of each of the ticks after certain(), as far as there are any.
  std::vector<SequencedCommands> held() const;

  // As the first of all: the commands that a snapshot holds, and those that were stored since, by their
  // ticks.
  void hold(std::vector<SequencedCommands> held);
  void hold_at(Tick tick, SequencedCommands commands);

  // The map changes before the next tick that is granted, by a grant of its own: also while the world is
  // paused. Its newcomers are the last ranks from then on; `leaver` is the rank that a server had until then.
  void set_map(v1::SectorMap map, std::optional<std::size_t> leaver = std::nullopt);
  bool awaits_map() const { return !next_maps_.empty(); }

  // For a server that has the world at the end of tick `tick`, which none of forget_past() has passed: what
  // was granted since, and the serial number of the next grant.
  std::vector<v1::Grant> granted_since(Tick tick) const;
  std::uint64_t next_serial() const { return serial_ + 1; }

  // How the world runs. Where it goes on, so many more ticks than were granted may be certain.
  v1::StoredPace stored_pace(std::uint64_t ticks_ahead) const;
  // As the last of all, of a world that is at the tick where the sequence begins.
  void restore_pace(const v1::StoredPace& pace);

  // Runs at `real_time_factor` simulated seconds per second; 0: as fast as possible. INVALID_ARGUMENT for a
  // factor out of bounds, FAILED_PRECONDITION during a step. Calls that wait for a pause get an error.
  absl::Status resume(double real_time_factor, Nanoseconds now);

  // Stops granting; answers when all servers have completed the granted ticks. Cuts a step short.
  void pause(Reply reply);

  // Whether step() may be called: INVALID_ARGUMENT unless `ticks` is 1 to kStepTicksMax, FAILED_PRECONDITION
  // unless paused.
  absl::Status may_step(std::uint64_t ticks) const;

  // Runs up to the end of tick `target`, unless that is certain already, and pauses; answers when it is done.
  // FAILED_PRECONDITION if the world neither is paused nor runs up to that tick.
  void step_to(Tick target, Reply reply);

  // A server has completed `tick`; reports may arrive out of order. INTERNAL for a tick that was not granted.
  absl::Status report(std::size_t rank, Tick tick);

  // The grants that are due, in order, for every server of the world.
  std::vector<v1::Grant> take_grants(Nanoseconds now);

  // When the next tick is due, with real-time pacing.
  std::optional<Nanoseconds> next_due() const;

  // From one tick to the next, with real-time pacing.
  std::optional<Nanoseconds> period() const;

  // Answers all waiting calls with `status`; the world is gone.
  void abandon(const absl::Status& status);
  // Likewise, and the world may come back.
  void suspend(const absl::Status& status);

 private:
  enum class Mode { kPaused, kStepping, kRunning };

  // By the tick at whose beginning they take effect.
  using Batches = absl::btree_map<Tick, SequencedCommands>;

  // Tick `base_tick + n` (n >= 1) is due n - 1 periods after `base_time`.
  struct Pace {
    double period_ns = 0;
    Tick base_tick = 0;
    Nanoseconds base_time{};
    std::uint64_t quantum = 1;  // ticks per grant: short ticks are not worth a message each
    std::uint64_t ahead_max = 1;

    Nanoseconds due(std::uint64_t n) const;
  };

  bool more_to_come() const {
    return replaying() || mode_ == Mode::kRunning || (mode_ == Mode::kStepping && granted_ < target_);
  }
  bool paced() const { return mode_ == Mode::kRunning && pace_ && !replaying(); }
  std::uint64_t window() const;
  std::uint64_t ticks_to_grant(Nanoseconds now) const;
  std::uint64_t ticks_due(Nanoseconds now) const;
  void forgive_debt(Nanoseconds now);
  v1::Grant next_grant(std::uint64_t ticks);
  v1::Grant map_grant();
  void give(const SequencedCommands& batch, v1::Grant& grant);
  void hold(SequencedCommands& batch, SequencedCommands more);
  v1::Grant question_grant(std::vector<v1::Question> questions);
  void ask_due(std::vector<v1::Grant>& grants);
  void settle();

  Options options_;
  std::uint64_t chunk_;  // ticks per grant without pacing
  Mode mode_ = Mode::kPaused;
  double real_time_factor_ = 0;
  std::optional<Pace> pace_;  // set while running with real-time pacing
  Tick target_ = 0;           // of the step
  std::vector<Reply> step_replies_;
  std::vector<Reply> pauses_;

  std::uint64_t serial_ = 0;
  Tick granted_ = 0;
  Tick certain_ = 0;  // the largest that granted_ has been
  Tick completed_ = 0;
  Tick reached_ = 0;                // the largest that completed_ has been
  bool in_doubt_ = false;           // replayed ticks that are beyond that
  std::vector<Tick> completed_by_;  // by rank
  Batches batches_;                 // after granted_; those after certain_ without a gap
  Batches past_;                    // granted, and not forgotten
  std::size_t past_commands_ = 0;
  std::size_t held_commands_ = 0;
  std::size_t held_shape_bytes_ = 0;
  struct NextMap {
    v1::SectorMap map;
    std::optional<std::size_t> leaver;
  };
  std::deque<NextMap> next_maps_;
  std::multimap<Tick, v1::Question> questions_;  // by the tick that they wait for
  std::vector<v1::Question> first_questions_;
};

}  // namespace tessera
