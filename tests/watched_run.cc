#include "tests/watched_run.h"

#include <algorithm>
#include <utility>

#include "lpss/simulation/simulation.h"

namespace tessera::testing {

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
  ASSERT_THAT(client.load(world_).status(), IsOk());
  const FoundBodies found = client.find_bodies("").value();
  for (const FoundBody& body : found.bodies) {
    if (body.properties.motion == Motion::kDynamic) dynamic_.push_back(body.id);
  }
  bodies_ = client.watch_bodies({.complete = true}, kPatience).value();
  contacts_ = client.watch_contacts({}, kPatience).value();
  ASSERT_THAT(client.resume(1).status(), IsOk());
}

void WatchedRun::go_on(Tick ticks) {
  const Tick end = told_ + ticks;
  while (told_ < end && !HasFatalFailure()) {
    const BodyId body = dynamic_[pushes_.size() % dynamic_.size()];
    const Eigen::Vector3d impulse(0.1 * static_cast<double>(pushes_.size() % 3), 0, 0.5);
    // Refused while there is no coordinator; nothing is under way when it is killed.
    const absl::StatusOr<Tick> given =
        client_of_run_->apply_impulse(body, impulse, Eigen::Vector3d::Zero(), kPatience);
    ASSERT_TRUE(given.ok() || absl::IsUnavailable(given.status())) << given.status();
    if (given.ok()) pushes_.push_back({*given, body, impulse});
    read_until(told_ + 10);
  }
}

void WatchedRun::read_until(Tick tick) {
  while (told_ < tick && !HasFatalFailure()) {
    const absl::StatusOr<BodyFrame> frame = bodies_->next(kPatience);
    ASSERT_THAT(frame.status(), IsOk());
    take(*frame);
  }
}

void WatchedRun::read_what_is_there(absl::Time end) {
  const absl::StatusOr<BodyFrame> frame = bodies_->next(end - absl::Now());
  if (absl::IsDeadlineExceeded(frame.status())) return;
  ASSERT_THAT(frame.status(), IsOk());
  take(*frame);
}

void WatchedRun::take(const BodyFrame& frame) {
  ASSERT_EQ(frame.tick, frames_++) << "each tick comes once, in its order";
  const absl::Time now = absl::Now();
  longest_gap_ = std::max(longest_gap_, now - std::exchange(last_frame_, now));
  if (count_ == 0) count_ = frame.bodies.size();
  ASSERT_EQ(frame.bodies.size(), count_) << "tick " << frame.tick;
  const absl::StatusOr<ContactFrame> contacts = contacts_->next(kPatience);
  ASSERT_THAT(contacts.status(), IsOk());
  ASSERT_EQ(contacts->tick, frame.tick);
  for (const ContactSample& contact : contacts->contacts) {
    contacts_told_.emplace_back(frame.tick, contact.phase, contact.a, contact.b);
  }
  told_ = frame.tick;
}

void WatchedRun::expect_as_undisturbed() {
  const Tick tick = client_of_run_->pause(kPatience).value();
  read_until(tick);
  const absl::StatusOr<HashAt> hash = client_of_run_->hash(kPatience);
  ASSERT_THAT(hash.status(), IsOk());
  EXPECT_EQ(hash->tick, tick);
  const Undisturbed alone(world_, pushes_, tick);
  EXPECT_EQ(hash->hash, alone.hash);
  std::sort(contacts_told_.begin(), contacts_told_.end());
  EXPECT_EQ(contacts_told_, alone.contacts);
  EXPECT_EQ(bodies_->skipped(), 0u);
  EXPECT_EQ(contacts_->skipped(), 0u);
}

}  // namespace tessera::testing
