#include "coordinator/sequencer.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "coordinator/command_checks.h"
#include "coordinator/limits.h"
#include "lpss/base/invariant.h"
#include "proto/convert.h"

namespace tessera {
namespace {

using Nanoseconds = Sequencer::Nanoseconds;

// With real-time pacing, ticks are granted at most this far ahead (commands wait for that long), in grants of
// at most this length; a delay beyond this time is not caught up with.
constexpr double kAheadNs = 50e6;
constexpr double kQuantumNs = 10e6;
constexpr Nanoseconds kDebtMax = std::chrono::milliseconds(100);

// Periods are counted from a base that advances after this many, so that products stay exact enough.
constexpr std::uint64_t kPeriodsMax = 1'000'000;

// Without pacing, a window is granted in this many parts: servers work on some while others are in transit.
constexpr std::uint64_t kChunksPerWindow = 4;

void add_what_is_new(const SequencedCommands& commands, v1::Grant& grant) {
  for (const v1::NumberedShape& shape : commands.new_shapes) *grant.add_new_shapes() = shape;
  for (const std::shared_ptr<const ProgramModule>& module : commands.new_modules)
    grant.add_new_modules(module->bytes);
}

}  // namespace

Sequencer::Sequencer(const Options& options)
    : options_(options),
      chunk_(std::max<std::uint64_t>(options.grant_window / kChunksPerWindow, 1)),
      granted_(options.tick),
      certain_(options.tick),
      completed_(options.tick),
      reached_(options.tick),
      completed_by_(options.servers, options.tick) {
  options_.grant_window = std::max<std::uint32_t>(options.grant_window, 1);
}

absl::Status Sequencer::room_for_commands(std::size_t commands, std::size_t shape_bytes) const {
  if (held_commands_ + commands > kHeldCommandsMax) {
    return absl::ResourceExhaustedError(absl::StrCat(held_commands_, " commands wait for a tick, and with ",
                                                     commands, " more they would be more than ",
                                                     kHeldCommandsMax));
  }
  if (past_commands_ + commands > kPastCommandsMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat(past_commands_, " commands came since the last checkpoint, and with ", commands,
                     " more they would be more than ", kPastCommandsMax));
  }
  if (held_shape_bytes_ + shape_bytes > kHeldShapeBytesMax) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the shapes of the commands that wait for a tick would take ",
                     held_shape_bytes_ + shape_bytes, " bytes, and may take at most ", kHeldShapeBytesMax));
  }
  return absl::OkStatus();
}

absl::Status Sequencer::room_for_question() const {
  if (questions_.size() < kOpenQuestionsMax) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat(questions_.size(), " questions wait already, which is the maximum"));
}

std::optional<TicksUnderWay> Sequencer::new_ticks_under_way() const {
  if (granted_ == completed_ || completed_ < reached_) return std::nullopt;
  return TicksUnderWay{completed_ + 1, granted_};
}

bool Sequencer::has_commands_at(Tick tick) const {
  const auto has = [tick](const Batches& batches) {
    const auto found = batches.find(tick);
    return found != batches.end() && found->second.commands.size() > 0;
  };
  return has(past_) || has(batches_);
}

void Sequencer::rewind(std::uint64_t world, std::size_t servers, Tick tick, bool in_doubt) {
  invariant(options_.keeps_past && tick <= certain_, "a world goes back to what was, and is kept");
  options_.world = world;
  serial_ = 0;
  next_maps_.clear();
  granted_ = completed_ = tick;
  in_doubt_ = in_doubt;
  completed_by_.assign(servers, tick);
  for (auto again = past_.upper_bound(tick); again != past_.end(); again = past_.erase(again)) {
    past_commands_ -= again->second.commands.size();
    held_commands_ += again->second.commands.size();
    for (const v1::NumberedShape& shape : again->second.new_shapes) held_shape_bytes_ += shape.ByteSizeLong();
    batches_.insert(std::move(*again));
  }
  // Those that an earlier rewind() brought back, and this one does not need.
  while (!batches_.empty() && batches_.begin()->first <= tick) {
    held_commands_ -= batches_.begin()->second.commands.size();
    for (const v1::NumberedShape& shape : batches_.begin()->second.new_shapes)
      held_shape_bytes_ -= shape.ByteSizeLong();
    batches_.erase(batches_.begin());
  }
}

void Sequencer::forget_past(Tick tick) {
  const auto end = past_.upper_bound(tick);
  for (auto old = past_.begin(); old != end; ++old) past_commands_ -= old->second.commands.size();
  past_.erase(past_.begin(), end);
}

// Commands keep their order: none overtakes those of a snapshot, which may be for later ticks.
Tick Sequencer::next_command_tick() const {
  return batches_.empty() ? certain_ + 1 : std::max(certain_ + 1, batches_.rbegin()->first);
}

void Sequencer::hold(SequencedCommands& batch, SequencedCommands more) {
  held_commands_ += more.commands.size();
  for (const v1::NumberedShape& shape : more.new_shapes) held_shape_bytes_ += shape.ByteSizeLong();
  batch.commands.append(more.commands);
  std::ranges::move(more.new_shapes, std::back_inserter(batch.new_shapes));
  std::ranges::move(more.new_modules, std::back_inserter(batch.new_modules));
}

void Sequencer::submit(SequencedCommands commands) {
  hold(batches_[next_command_tick()], std::move(commands));
}

void Sequencer::ask(v1::Question question, Tick after) { questions_.emplace(after, std::move(question)); }
void Sequencer::ask_first(v1::Question question) { first_questions_.push_back(std::move(question)); }

v1::SectorMap map_message(const SectorMap& map) {
  v1::SectorMap message;
  for (const SectorIndex& splitter : map.splitters()) *message.add_splitters() = to_proto(splitter);
  message.mutable_owners()->Add(map.owners().begin(), map.owners().end());
  message.set_epoch(map.epoch());
  return message;
}

void Sequencer::set_map(v1::SectorMap map, std::optional<std::size_t> leaver) {
  next_maps_.push_back({std::move(map), leaver});
}

std::vector<v1::Grant> Sequencer::granted_since(Tick tick) const {
  invariant(tick <= granted_, "grants since a tick that was granted");
  std::vector<v1::Grant> grants;
  const auto add = [&](Tick from, Tick to) -> v1::Grant& {
    v1::Grant& grant = grants.emplace_back();
    grant.set_ticks(to - from);
    grant.set_commands(pack(std::span<const Command>()));
    return grant;
  };
  auto batch = past_.upper_bound(tick);
  const Tick first = batch == past_.end() ? granted_ + 1 : batch->first;
  if (first > tick + 1) add(tick, first - 1);
  while (batch != past_.end()) {
    const auto next = std::next(batch);
    v1::Grant& grant = add(batch->first - 1, next == past_.end() ? granted_ : next->first - 1);
    grant.set_commands(batch->second.commands.list());
    add_what_is_new(batch->second, grant);
    batch = next;
  }
  return grants;
}

std::vector<SequencedCommands> Sequencer::held() const {
  std::vector<SequencedCommands> held;
  for (auto batch = batches_.upper_bound(certain_); batch != batches_.end(); ++batch)
    held.push_back(batch->second);
  return held;
}

void Sequencer::hold(std::vector<SequencedCommands> held) {
  invariant(batches_.empty(), "what a snapshot holds comes first");
  Tick tick = certain_;
  for (SequencedCommands& from : held) hold(batches_[++tick], std::move(from));
}

void Sequencer::hold_at(Tick tick, SequencedCommands commands) { hold(batches_[tick], std::move(commands)); }

v1::StoredPace Sequencer::stored_pace(std::uint64_t ticks_ahead) const {
  v1::StoredPace pace;
  pace.set_certain(certain_);
  if (mode_ == Mode::kRunning) {
    pace.set_mode(v1::StoredPace::RUNNING);
    pace.set_certain(certain_ + ticks_ahead);
    pace.set_real_time_factor(real_time_factor_);
  } else if (mode_ == Mode::kStepping) {
    pace.set_mode(v1::StoredPace::STEPPING);
    pace.set_certain(std::min(certain_ + ticks_ahead, target_));
    pace.set_target(target_);
  }
  return pace;
}

void Sequencer::restore_pace(const v1::StoredPace& pace) {
  certain_ = std::max(certain_, pace.certain());
  if (pace.mode() == v1::StoredPace::STEPPING && pace.target() > certain_) {
    step_to(pace.target(), [](const absl::Status&, Tick) {});
  } else if (pace.mode() == v1::StoredPace::RUNNING) {
    resume(pace.real_time_factor(), {}).IgnoreError();  // it was accepted before
  }
}

absl::Status Sequencer::resume(double real_time_factor, Nanoseconds now) {
  if (mode_ == Mode::kStepping) {
    return absl::FailedPreconditionError("a step is under way: wait for it, or pause first");
  }
  const bool in_bounds = real_time_factor >= kRealTimeFactorMin && real_time_factor <= kRealTimeFactorMax;
  if (real_time_factor != 0 && !in_bounds) {
    return absl::InvalidArgumentError(absl::StrCat("real_time_factor = ", real_time_factor, " must be 0, or ",
                                                   kRealTimeFactorMin, " to ", kRealTimeFactorMax));
  }
  mode_ = Mode::kRunning;
  real_time_factor_ = real_time_factor;
  pace_.reset();
  if (real_time_factor != 0) {
    pace_ = Pace{};
    Pace& pace = *pace_;
    pace.period_ns = options_.time_step / real_time_factor * 1e9;
    pace.base_tick = certain_;
    pace.base_time = now;
    const double ahead = std::min<double>(std::ceil(kAheadNs / pace.period_ns), options_.grant_window);
    pace.ahead_max = std::min<std::uint64_t>(std::max<std::uint64_t>(static_cast<std::uint64_t>(ahead), 2),
                                             options_.grant_window);
    const std::uint64_t half = pace.ahead_max / 2;
    const double quantum = std::min<double>(kQuantumNs / pace.period_ns, static_cast<double>(half));
    pace.quantum = std::max<std::uint64_t>(static_cast<std::uint64_t>(quantum), 1);
  }
  for (const Reply& waiting : std::exchange(pauses_, {})) {
    waiting(absl::FailedPreconditionError("the world was resumed before it had paused"), reached_);
  }
  return absl::OkStatus();
}

void Sequencer::pause(Reply reply) {
  if (pauses_.size() >= kWaitingCallsMax) {
    reply(absl::ResourceExhaustedError(absl::StrCat(pauses_.size(), " calls wait for the pause already")), 0);
    return;
  }
  if (mode_ == Mode::kStepping && certain_ < target_) {
    mode_ = Mode::kPaused;
    const absl::Status cut_short =
        absl::FailedPreconditionError(absl::StrCat("the step was cut short by a pause, at tick ", certain_));
    for (const Reply& waiting : std::exchange(step_replies_, {})) waiting(cut_short, certain_);
  }
  if (mode_ == Mode::kRunning) mode_ = Mode::kPaused;
  pauses_.push_back(std::move(reply));
  settle();
}

absl::Status Sequencer::may_step(std::uint64_t ticks) const {
  if (mode_ != Mode::kPaused)
    return absl::FailedPreconditionError("the world must be paused before it is stepped");
  if (ticks >= 1 && ticks <= kStepTicksMax) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("ticks = ", ticks, " must be 1 to ", kStepTicksMax));
}

void Sequencer::step_to(Tick target, Reply reply) {
  const bool is_under_way = mode_ == Mode::kStepping && target == target_;
  if (mode_ == Mode::kPaused && target > certain_) {
    invariant(step_replies_.empty(), "a step ends before the next one begins");
    mode_ = Mode::kStepping;
    target_ = target;
  } else if (target > certain_ && !is_under_way) {
    return reply(absl::FailedPreconditionError("the world must be paused before it is stepped"), 0);
  } else if (target <= completed_ && !is_under_way) {
    return reply(absl::OkStatus(), completed_);
  }
  step_replies_.push_back(std::move(reply));
}

absl::Status Sequencer::report(std::size_t rank, Tick tick) {
  if (tick > granted_) {
    return absl::InternalError(
        absl::StrCat("it reports tick ", tick, ", but ticks were granted up to ", granted_));
  }
  invariant(rank < completed_by_.size(), "servers report by their ranks");
  completed_by_[rank] = std::max(completed_by_[rank], tick);
  completed_ = *std::min_element(completed_by_.begin(), completed_by_.end());
  reached_ = std::max(reached_, completed_);
  settle();
  return absl::OkStatus();
}

// Answers the calls that wait for the world to pause.
void Sequencer::settle() {
  if (mode_ == Mode::kStepping && completed_ == target_) mode_ = Mode::kPaused;
  if (mode_ != Mode::kPaused || completed_ != certain_) return;
  for (const Reply& waiting : std::exchange(step_replies_, {})) waiting(absl::OkStatus(), completed_);
  for (const Reply& waiting : std::exchange(pauses_, {})) waiting(absl::OkStatus(), completed_);
}

Nanoseconds Sequencer::Pace::due(std::uint64_t n) const {
  return base_time + Nanoseconds(std::llround(static_cast<double>(n - 1) * period_ns));
}

std::uint64_t Sequencer::window() const { return paced() ? pace_->ahead_max : options_.grant_window; }

// How many ticks after the base are due; estimated within rounding, then corrected by due().
std::uint64_t Sequencer::ticks_due(Nanoseconds now) const {
  if (now < pace_->base_time) return 0;
  const double elapsed_ns = static_cast<double>((now - pace_->base_time).count());
  auto n = static_cast<std::uint64_t>(elapsed_ns / pace_->period_ns) + 1;
  while (pace_->due(n + 1) <= now) ++n;
  while (n > 0 && pace_->due(n) > now) --n;
  return n;
}

// A world that cannot keep up slows down evenly instead of catching up later.
void Sequencer::forgive_debt(Nanoseconds now) {
  if (!paced()) return;
  const std::uint64_t done = granted_ - pace_->base_tick;
  const Nanoseconds due = pace_->due(done + 1);
  if (due >= now - kDebtMax && done < kPeriodsMax) return;
  pace_->base_tick = granted_;
  pace_->base_time = std::max(due, now - kDebtMax);
}

std::uint64_t Sequencer::ticks_to_grant(Nanoseconds now) const {
  const std::uint64_t ahead = granted_ - completed_;
  if (!more_to_come() || ahead >= window()) return 0;
  const std::uint64_t room = window() - ahead;
  if (paced()) {
    const std::uint64_t done = granted_ - pace_->base_tick;
    const std::uint64_t due = ticks_due(now);
    return due <= done ? 0 : std::min(room, std::max(due - done, pace_->quantum));
  }
  std::uint64_t wanted = chunk_;
  if (replaying()) {
    if (in_doubt_ && granted_ >= reached_) return ahead == 0 ? 1 : 0;
    wanted = std::min(wanted, (in_doubt_ ? reached_ : certain_) - granted_);
  } else if (mode_ == Mode::kStepping) {
    wanted = std::min(wanted, target_ - granted_);
  }
  const bool worth_a_message = room >= wanted || !batches_.empty();
  return worth_a_message ? std::min(room, wanted) : 0;
}

v1::Grant Sequencer::next_grant(std::uint64_t ticks) {
  v1::Grant grant;
  grant.set_world(options_.world);
  grant.set_serial(++serial_);
  auto next = batches_.begin();
  if (next != batches_.end() && next->first == granted_ + 1) {
    give(next->second, grant);
    if (options_.keeps_past) {
      past_commands_ += next->second.commands.size();
      past_.insert(std::move(*next));
    }
    next = batches_.erase(next);
  } else {
    grant.set_commands(pack(std::span<const Command>()));
  }
  // A tick that has commands begins another grant.
  if (next != batches_.end()) ticks = std::min(ticks, next->first - granted_ - 1);
  grant.set_ticks(ticks);
  granted_ += ticks;
  certain_ = std::max(certain_, granted_);
  invariant(batches_.empty() || batches_.begin()->first > granted_, "no grant passes over commands");
  return grant;
}

v1::Grant Sequencer::map_grant() {
  NextMap next = std::move(next_maps_.front());
  next_maps_.pop_front();
  invariant(!next.leaver || *next.leaver < completed_by_.size(), "who leaves had a rank");
  // Those that begin need do nothing of what was granted so far.
  completed_by_.resize(completed_by_.size() + next.map.newcomers(), granted_);
  if (next.leaver) completed_by_.erase(completed_by_.begin() + static_cast<std::ptrdiff_t>(*next.leaver));
  completed_ = *std::min_element(completed_by_.begin(), completed_by_.end());
  reached_ = std::max(reached_, completed_);
  v1::Grant grant = question_grant({});
  *grant.mutable_map() = std::move(next.map);
  grant.mutable_map()->set_since(granted_ + 1);
  return grant;
}

void Sequencer::give(const SequencedCommands& batch, v1::Grant& grant) {
  invariant(held_commands_ >= batch.commands.size(), "commands are counted as they come");
  held_commands_ -= batch.commands.size();
  grant.set_commands(batch.commands.list());
  for (const v1::NumberedShape& shape : batch.new_shapes) held_shape_bytes_ -= shape.ByteSizeLong();
  add_what_is_new(batch, grant);
}

v1::Grant Sequencer::question_grant(std::vector<v1::Question> questions) {
  v1::Grant grant;
  grant.set_world(options_.world);
  grant.set_serial(++serial_);
  for (v1::Question& question : questions) *grant.add_questions() = std::move(question);
  return grant;
}

std::vector<v1::Grant> Sequencer::take_grants(Nanoseconds now) {
  forgive_debt(now);
  std::vector<v1::Grant> grants;
  while (replaying()) {
    const std::uint64_t ticks = ticks_to_grant(now);
    if (ticks == 0) return grants;
    grants.push_back(next_grant(ticks));
  }
  if (!first_questions_.empty()) grants.push_back(question_grant(std::exchange(first_questions_, {})));
  while (!next_maps_.empty()) grants.push_back(map_grant());
  ask_due(grants);
  while (const std::uint64_t ticks = ticks_to_grant(now)) {
    grants.push_back(next_grant(ticks));
    ask_due(grants);
  }
  settle();
  return grants;
}

// A separate grant: a slow pace must not delay answers.
void Sequencer::ask_due(std::vector<v1::Grant>& grants) {
  const auto end = more_to_come() ? questions_.upper_bound(granted_) : questions_.end();
  std::vector<v1::Question> due;
  for (auto question = questions_.begin(); question != end; ++question)
    due.push_back(std::move(question->second));
  questions_.erase(questions_.begin(), end);
  if (!due.empty()) grants.push_back(question_grant(std::move(due)));
}

std::optional<Nanoseconds> Sequencer::next_due() const {
  if (!paced() || granted_ - completed_ >= window()) return std::nullopt;
  return pace_->due(granted_ - pace_->base_tick + 1);
}

std::optional<Nanoseconds> Sequencer::period() const {
  if (!paced()) return std::nullopt;
  return Nanoseconds(static_cast<std::int64_t>(pace_->period_ns));
}

void Sequencer::abandon(const absl::Status& status) {
  suspend(status);
  batches_.clear();
  past_.clear();
  mode_ = Mode::kPaused;
}

void Sequencer::suspend(const absl::Status& status) {
  questions_.clear();
  first_questions_.clear();
  for (const Reply& waiting : std::exchange(pauses_, {})) waiting(status, 0);
  for (const Reply& waiting : std::exchange(step_replies_, {})) waiting(status, 0);
}

}  // namespace tessera
