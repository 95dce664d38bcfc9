#include "simulator/driver.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "lpss/model/settings.h"
#include "proto/convert.h"

namespace tessera {
namespace {

constexpr std::uint32_t kScenarioStream = 3;
constexpr std::uint32_t kStepStreams = 2'000'000'000;    // that of the first command; others follow
constexpr int kEventsWithoutCoordinatorMax = 1'000'000;  // while there is no coordinator
constexpr std::uint64_t kReplacedOneIn = 25;
constexpr int kReplacementTriesMax = 200;
constexpr std::uint64_t kEventsBetweenLoads = 200;

// What a client must expect of a cluster with faults.
bool is_expected(const absl::Status& status) {
  return status.ok() || absl::IsUnavailable(status) || absl::IsResourceExhausted(status);
}

// The tick at which the world has paused, whatever coordinators are lost meanwhile.
absl::StatusOr<Tick> paused_tick(SimulatedCluster& cluster) {
  for (int events = 0; events < kEventsWithoutCoordinatorMax && cluster.failure().ok(); ++events) {
    if (cluster.has_coordinator()) {
      const auto paused = cluster.call<v1::PauseRequest, v1::PauseReply>({});
      if (paused.ok()) return paused->tick();
      if (!absl::IsUnavailable(paused.status())) return paused.status();
    }
    cluster.run_events(1);
  }
  if (!cluster.failure().ok()) return cluster.failure();
  return absl::DeadlineExceededError("no coordinator came back");
}

absl::StatusOr<v1::StatusReply> any_status(SimulatedCluster& cluster) {
  absl::StatusOr<v1::StatusReply> status = cluster.status();
  for (int events = 0; absl::IsUnavailable(status.status()) && events < kEventsWithoutCoordinatorMax;
       ++events) {
    if (!cluster.failure().ok()) return cluster.failure();
    cluster.run_events(1);
    if (cluster.has_coordinator()) status = cluster.status();
  }
  return status;
}

}  // namespace

Driver::Driver(SimulatedCluster& cluster, const WorldDescription& world, const Scenario& scenario,
               TickGaps& gaps, std::vector<v1::RecordedInput>& hashes)
    : cluster_(cluster),
      world_(world),
      scenario_(scenario),
      gaps_(gaps),
      hashes_(hashes),
      dice_(scenario.seed, kScenarioStream),
      workload_(scenario.seed, world, scenario.extremes),
      may_balance_(world.settings.shuffle == 0) {}

bool Driver::is_left_out(std::uint32_t command) const {
  return scenario_.only_commands && !std::ranges::binary_search(*scenario_.only_commands, command);
}

absl::Status Driver::run(Tick ticks) {
  const Tick longest = 2 * (ticks / (scenario_.commands + 1)) + 1;
  for (std::uint32_t command = 0; command < scenario_.commands; ++command) {
    dice_ = Dice(scenario_.seed, kStepStreams + command);
    if (step_ && *step_) {
      if (absl::Status ended = end_step(); !ended.ok()) return ended;
    }
    if (!step_ && done_ < ticks && !dice_.one_in(3)) {
      start_step(std::min(dice_.between(std::uint64_t{1}, longest), ticks - done_));
    } else if (!step_ && dice_.one_in(8)) {
      if (absl::Status ran = run_freely(); !ran.ok()) return ran;
    }
    for (std::uint64_t events = dice_.below(20); step_ && !*step_ && events > 0; --events) {
      cluster_.run_events(1);
    }
    if (may_balance_ && dice_.one_in(4)) {
      if (absl::Status balanced = balance(); !is_expected(balanced)) return balanced;
    }
    if (is_left_out(command)) continue;
    if (absl::Status given = give(command); !given.ok()) return given;
  }
  if (absl::Status settled = workload_.settle(cluster_); !settled.ok()) return settled;
  while (step_ || done_ < ticks) {
    if (!step_) start_step(ticks - done_);
    if (absl::Status ended = end_step(); !ended.ok()) return ended;
  }
  return absl::OkStatus();
}

absl::Status Driver::finish(Tick ticks) {
  absl::Status stepped = cluster_.step(ticks);
  if (stepped.ok()) set_tick(tick_ + ticks);
  return stepped;
}

absl::Status Driver::give(std::uint32_t command) {
  if (scenario_.extremes && dice_.one_in(kReplacedOneIn)) return replace_world();
  absl::Status given = workload_.give(command, cluster_);
  return is_expected(given) ? absl::OkStatus() : given;
}

void Driver::set_tick(Tick tick) {
  done_ += tick - tick_;
  tick_ = tick;
}

void Driver::start_step(Tick ticks) {
  v1::Request request;
  request.set_ticks(ticks);
  set_tick(tick_ + ticks);
  gaps_.begin(cluster_.network().now_ns());
  step_ = cluster_.post<v1::Request, v1::Reply>(std::move(request));
}

// Where its coordinator is lost, the world does the step or has not heard of it.
absl::Status Driver::end_step() {
  absl::Status status = cluster_.wait<v1::Reply>(step_).status();
  gaps_.end(cluster_.network().now_ns());
  step_.reset();
  if (!absl::IsUnavailable(status)) return status;
  return pause();
}

absl::Status Driver::pause() {
  const absl::StatusOr<Tick> tick = paused_tick(cluster_);
  if (tick.ok()) set_tick(*tick);
  return tick.status();
}

absl::Status Driver::balance() {
  v1::BalanceRequest request;
  request.set_policy(std::string(name_of(kBalancePolicies[dice_.below(std::size(kBalancePolicies))])));
  const auto balance = cluster_.call<v1::BalanceRequest, v1::BalanceReply>(std::move(request));
  if (balance.ok() && balance->moves()) ++moves_;
  return balance.status();
}

// At the pace of real time, or as fast as it goes, for a while.
absl::Status Driver::run_freely() {
  v1::ResumeRequest request;
  request.set_real_time_factor(dice_.one_in(2) ? 1 : 0);
  const auto resumed = cluster_.call<v1::ResumeRequest, v1::ResumeReply>(std::move(request));
  if (!resumed.ok() && !is_expected(resumed.status())) return resumed.status();
  cluster_.run_events(dice_.below(100));
  return pause();
}

absl::Status Driver::replace_world() {
  if (absl::Status settled = workload_.settle(cluster_); !settled.ok()) return settled;
  if (step_) {
    if (absl::Status ended = end_step(); !ended.ok()) return ended;
  }
  if (absl::Status paused = pause(); !paused.ok()) return paused;
  const absl::StatusOr<v1::StatusReply> before = any_status(cluster_);
  if (!before.ok()) return before.status();
  WorldHistory ended = end_world();
  std::optional<SnapshotChunks> from;
  if (!ended.snapshots.empty() && !dice_.one_in(3))
    from = ended.snapshots[dice_.below(ended.snapshots.size())];
  const bool unloads = dice_.one_in(3);
  cluster_.log_of_clients(from ? "restores a snapshot" : "loads the world anew");
  if (unloads) {
    if (absl::Status unloaded = unload(); !unloaded.ok()) return unloaded;
  }
  // Once the old world is gone, any other number than none is that of the new one.
  if (absl::Status loaded = load_another(from, unloads ? 0 : before->load()); !loaded.ok()) return loaded;
  // A coordinator that was lost meanwhile has repeated ticks of the old one.
  std::ranges::move(std::exchange(hashes_, {}), std::back_inserter(ended.hashes));
  ended_.push_back(std::move(ended));
  from_ = std::move(from);
  workload_.begin_world();
  const absl::StatusOr<Tick> tick = paused_tick(cluster_);
  if (tick.ok()) tick_ = *tick;
  return tick.status();
}

// Again and again, until it is so: faults may keep it from that, or from telling so.
absl::Status Driver::unload() {
  for (int tries = 0; tries < kReplacementTriesMax; ++tries) {
    const auto unloaded = cluster_.call<v1::UnloadRequest, v1::UnloadReply>({});
    if (absl::IsCancelled(unloaded.status()) || !cluster_.failure().ok()) return unloaded.status();
    const absl::StatusOr<v1::StatusReply> status = any_status(cluster_);
    if (!status.ok()) return status.status();
    // A coordinator that is lost may have unloaded it and not told so; the next one has no world.
    const bool is_gone = unloaded.ok() || absl::IsFailedPrecondition(unloaded.status());
    if (is_gone && status->state() == "empty") return absl::OkStatus();
    cluster_.run_events(kEventsBetweenLoads);
  }
  return absl::DeadlineExceededError("the world could not be unloaded");
}

// Likewise.
absl::Status Driver::load_another(const std::optional<SnapshotChunks>& from, std::uint64_t before) {
  for (int tries = 0; tries < kReplacementTriesMax; ++tries) {
    absl::Status loaded = from ? cluster_.restore(*from) : cluster_.load(world_, /*replace=*/true);
    if (!cluster_.failure().ok()) return cluster_.failure();
    const bool may_pass = loaded.ok() || absl::IsUnavailable(loaded) || absl::IsFailedPrecondition(loaded) ||
                          absl::IsResourceExhausted(loaded);
    if (!may_pass) return loaded;
    const absl::StatusOr<v1::StatusReply> status = any_status(cluster_);
    if (!status.ok()) return status.status();
    const bool is_there = status->state() != "loading" && status->state() != "empty";
    if (is_there && (loaded.ok() || status->load() != before)) return absl::OkStatus();
    cluster_.run_events(kEventsBetweenLoads);
  }
  return absl::DeadlineExceededError("no world could be loaded");
}

WorldHistory Driver::end_world() {
  WorldHistory history;
  history.from = from_;
  history.hashes = std::exchange(hashes_, {});
  history.stored = cluster_.stored_commands();
  const std::vector<SimulatedCluster::Told>& told = cluster_.told_commands();
  for (std::size_t n = told_before_; n < told.size(); ++n) {
    if (told[n].id.number > requests_before_) history.told.push_back(told[n]);
  }
  told_before_ = told.size();
  requests_before_ = workload_.last_number();
  history.snapshots = workload_.take_snapshots();
  return history;
}

std::vector<WorldHistory> Driver::take_histories() {
  std::vector<WorldHistory> all = std::exchange(ended_, {});
  all.push_back(end_world());
  return all;
}

}  // namespace tessera
