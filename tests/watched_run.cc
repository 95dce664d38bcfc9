#include "tests/watched_run.h"

#include <algorithm>
#include <utility>

#include "lpss/simulation/simulation.h"

namespace tessera::testing {
namespace {

constexpr absl::Duration kLookAfter = absl::Seconds(1);
constexpr absl::Duration kAskAgain = absl::Milliseconds(50);

}  // namespace

Undisturbed::Undisturbed(const WorldDescription& world, const std::vector<Push>& pushes, Tick ticks) {
  const std::unique_ptr<Simulation> simulation = Simulation::create(world).value();
  simulation->report_contacts(true);
  for (Tick tick = 1; tick <= ticks; ++tick) {
    std::vector<Command> commands;
    for (const Push& push : pushes) {
      if (push.tick != tick) continue;
      ApplyImpulse command{push.body, {}, {}};
      std::copy_n(push.impulse.data(), 3, command.impulse.data());
      commands.emplace_back(command);
    }
    simulation->step(commands);
    for (const ContactEvent& event : simulation->contact_events()) {
      if (event.phase != ContactPhase::kPersist) contacts.emplace_back(tick, event.phase, event.a, event.b);
    }
  }
  std::sort(contacts.begin(), contacts.end());
  hash = simulation->hash().to_string();
}

void WatchedRun::begin(Client& client) {
  client_of_run_ = &client;
  ASSERT_THAT(client.load(world_, /*replace=*/true).status(), IsOk());
  const FoundBodies found = client.find_bodies("").value();
  dynamic_.clear();
  for (const FoundBody& body : found.bodies) {
    if (body.properties.motion == Motion::kDynamic) dynamic_.push_back(body.id);
  }
  begin_again(0);
}

void WatchedRun::begin_again(Tick tick) {
  std::erase_if(pushes_, [&](const Push& push) { return push.tick > tick; });
  std::erase_if(contacts_told_, [&](const TickedContact& contact) { return std::get<Tick>(contact) > tick; });
  frames_ = told_ = tick;
  absl::StatusOr<std::unique_ptr<BodyStream>> bodies =
      client_of_run_->watch_bodies({.complete = true}, patience_);
  ASSERT_THAT(bodies.status(), IsOk());
  bodies_ = *std::move(bodies);
  if (watches_contacts_) {
    absl::StatusOr<std::unique_ptr<ContactStream>> contacts = client_of_run_->watch_contacts({}, patience_);
    ASSERT_THAT(contacts.status(), IsOk());
    contacts_ = *std::move(contacts);
  }
  ASSERT_THAT(client_of_run_->resume(1, patience_).status(), IsOk());
  last_frame_ = absl::Now();
}

void WatchedRun::go_on(Tick ticks) {
  const Tick end = told_ + ticks;
  while (told_ < end && !HasFatalFailure()) {
    const BodyId body = dynamic_[pushes_.size() % dynamic_.size()];
    const Eigen::Vector3d impulse(0.1 * static_cast<double>(pushes_.size() % 3), 0, 0.5);
    // Refused while there is no coordinator; nothing is under way when it is killed.
    const absl::StatusOr<Tick> given =
        client_of_run_->apply_impulse(body, impulse, Eigen::Vector3d::Zero(), patience_);
    ASSERT_TRUE(given.ok() || absl::IsUnavailable(given.status())) << given.status();
    if (given.ok()) pushes_.push_back({*given, body, impulse});
    read_until(told_ + 10);
  }
}

void WatchedRun::read_until(Tick tick) {
  absl::Time end = absl::Now() + patience_;
  while (told_ < tick && !HasFatalFailure()) {
    const Tick before = told_;
    read_what_is_there(absl::Now() + kLookAfter);
    if (told_ != before) {
      end = absl::Now() + patience_;
    } else {
      look_after();
      ASSERT_LT(absl::Now(), end) << "no tick after " << told_;
    }
  }
}

void WatchedRun::read_what_is_there(absl::Time end) {
  const absl::StatusOr<BodyFrame> frame = bodies_->next(end - absl::Now());
  if (absl::IsDeadlineExceeded(frame.status())) return;
  if (absl::IsUnavailable(frame.status()) && may_miss_ticks_) return reopen();
  ASSERT_THAT(frame.status(), IsOk());
  take(*frame);
}

// A client that has been without a coordinator for longer than its stream waits for one.
void WatchedRun::reopen() {
  absl::StatusOr<std::unique_ptr<BodyStream>> bodies =
      client_of_run_->watch_bodies({.complete = true}, patience_);
  ASSERT_TRUE(bodies.ok() || absl::IsUnavailable(bodies.status())) << bodies.status();
  if (!bodies.ok()) return;
  bodies_ = *std::move(bodies);
  is_reopened_ = true;
  ++reopened_;
}

void WatchedRun::take(const BodyFrame& frame) {
  if (std::exchange(is_reopened_, false) && frame.tick < frames_) return;  // the state that was told last
  if (may_miss_ticks_ && frame.tick > frames_) missed_ += frame.tick - std::exchange(frames_, frame.tick);
  ASSERT_EQ(frame.tick, frames_++) << "each tick comes once, in its order";
  const absl::Time now = absl::Now();
  longest_gap_ = std::max(longest_gap_, now - std::exchange(last_frame_, now));
  if (count_ == 0) count_ = frame.bodies.size();
  ASSERT_EQ(frame.bodies.size(), count_) << "tick " << frame.tick;
  told_ = frame.tick;
  if (!watches_contacts_) return;
  const absl::StatusOr<ContactFrame> contacts = contacts_->next(patience_);
  ASSERT_THAT(contacts.status(), IsOk());
  ASSERT_EQ(contacts->tick, frame.tick);
  for (const ContactSample& contact : contacts->contacts) {
    contacts_told_.emplace_back(frame.tick, contact.phase, contact.a, contact.b);
  }
}

// Ticks from before a coordinator was replaced may still be read while the next one begins, which refuses
// calls until then.
absl::StatusOr<Tick> WatchedRun::pause() {
  const absl::Time end = absl::Now() + patience_;
  for (;;) {
    const absl::StatusOr<Tick> tick = client_of_run_->pause(patience_);
    if (!absl::IsUnavailable(tick.status()) || absl::Now() > end || HasFatalFailure()) return tick;
    read_what_is_there(absl::Now() + kAskAgain);
  }
}

void WatchedRun::expect_as_undisturbed() {
  const absl::StatusOr<Tick> paused = pause();
  ASSERT_THAT(paused.status(), IsOk());
  const Tick tick = *paused;
  read_until(tick);
  const absl::StatusOr<HashAt> hash = client_of_run_->hash(patience_);
  ASSERT_THAT(hash.status(), IsOk());
  EXPECT_EQ(hash->tick, tick);
  const Undisturbed alone(world_, pushes_, tick);
  EXPECT_EQ(hash->hash, alone.hash);
  if (!watches_contacts_) return;
  std::sort(contacts_told_.begin(), contacts_told_.end());
  EXPECT_EQ(contacts_told_, alone.contacts);
  EXPECT_EQ(bodies_->skipped(), 0u);
  EXPECT_EQ(contacts_->skipped(), 0u);
}

}  // namespace tessera::testing
