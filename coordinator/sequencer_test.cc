#include "coordinator/sequencer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/limits.h"
#include "proto/wire.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using Nanoseconds = Sequencer::Nanoseconds;

std::uint64_t ticks_of(const std::vector<v1::Grant>& grants) {
  std::uint64_t ticks = 0;
  for (const v1::Grant& grant : grants) ticks += grant.ticks();
  return ticks;
}

void nobody(const absl::Status&, Tick) {}

TEST(Sequencer, AWindowOfOneTickWorks) {
  Sequencer sequencer({.grant_window = 1});
  ASSERT_TRUE(sequencer.resume(0, {}).ok());
  for (Tick tick = 1; tick <= 5; ++tick) {
    EXPECT_EQ(ticks_of(sequencer.take_grants({})), 1u);
    EXPECT_EQ(ticks_of(sequencer.take_grants({})), 0u);
    ASSERT_TRUE(sequencer.report(0, tick).ok());
  }
}

TEST(Sequencer, ReportsMayOvertakeOneAnother) {
  Sequencer sequencer({.servers = 2});
  ASSERT_TRUE(sequencer.resume(0, {}).ok());
  sequencer.take_grants({});
  ASSERT_TRUE(sequencer.report(0, 16).ok());
  ASSERT_TRUE(sequencer.report(0, 8).ok());
  ASSERT_TRUE(sequencer.report(1, 10).ok());
  EXPECT_EQ(sequencer.completed(), 10u);
}

TEST(Sequencer, ShortTicksShareGrantsByTheClock) {
  Sequencer sequencer({.time_step = 0.001});
  ASSERT_TRUE(sequencer.resume(1, {}).ok());
  std::size_t grants = 0;
  Tick ticks = 0;
  for (int ms = 0; ms <= 1000; ++ms) {
    const auto granted = sequencer.take_grants(milliseconds(ms));
    grants += granted.size();
    ticks += ticks_of(granted);
    ASSERT_TRUE(sequencer.report(0, ticks).ok());
  }
  EXPECT_NEAR(static_cast<double>(ticks), 1000, 11);
  EXPECT_NEAR(static_cast<double>(grants), 100, 2);
}

// The clock and the count agree at any time, also where a period is no whole number of nanoseconds.
TEST(Sequencer, PacingDoesNotDrift) {
  Sequencer sequencer({.time_step = 1.0 / 60});
  const Nanoseconds start{123'456'789};
  ASSERT_TRUE(sequencer.resume(1, start).ok());
  Tick ticks = 0;
  Nanoseconds now = start;
  while (ticks < 60 * 60 * 2) {
    ticks += ticks_of(sequencer.take_grants(now));
    ASSERT_TRUE(sequencer.report(0, ticks).ok());
    ASSERT_TRUE(sequencer.next_due());
    ASSERT_GT(*sequencer.next_due(), now);
    now = *sequencer.next_due();
  }
  EXPECT_NEAR(std::chrono::duration<double>(now - start).count(), 120, 1e-6);
}

TEST(Sequencer, ACommandGoesIntoTheNextGrantByTheClock) {
  Sequencer sequencer({.time_step = 0.01});
  ASSERT_TRUE(sequencer.resume(1, {}).ok());
  EXPECT_EQ(ticks_of(sequencer.take_grants({})), 1u);
  Tick told = 0;
  sequencer.submit(RemoveBody{BodyId{1}}, std::nullopt, [&](const absl::Status&, Tick tick) { told = tick; });
  EXPECT_TRUE(sequencer.take_grants(milliseconds(5)).empty());
  EXPECT_EQ(told, 0u);
  ASSERT_TRUE(sequencer.report(0, 1).ok());
  EXPECT_EQ(sequencer.take_grants(milliseconds(10)).size(), 1u);
  EXPECT_EQ(told, 2u);
}

TEST(Sequencer, AResumeDisappointsThoseWhoWaitForAPause) {
  Sequencer sequencer({});
  ASSERT_TRUE(sequencer.resume(0, {}).ok());
  sequencer.take_grants({});
  absl::Status heard;
  sequencer.pause([&](const absl::Status& status, Tick) { heard = status; });
  ASSERT_TRUE(sequencer.resume(0, {}).ok());
  EXPECT_EQ(heard.code(), absl::StatusCode::kFailedPrecondition);
}

TEST(Sequencer, APauseWaitsForTheLastTickOfAStep) {
  Sequencer sequencer({});
  Tick stepped = 0;
  Tick paused = 0;
  sequencer.step(4, [&](const absl::Status& status, Tick tick) { stepped = status.ok() ? tick : 0; });
  EXPECT_EQ(ticks_of(sequencer.take_grants({})), 4u);
  sequencer.pause([&](const absl::Status&, Tick tick) { paused = tick; });
  EXPECT_EQ(paused, 0u);
  ASSERT_TRUE(sequencer.report(0, 4).ok());
  EXPECT_EQ(stepped, 4u);
  EXPECT_EQ(paused, 4u);
  EXPECT_TRUE(sequencer.paused());
}

TEST(Sequencer, HasLimits) {
  Sequencer sequencer({});
  EXPECT_TRUE(sequencer.room_for_command(kHeldShapeBytesMax).ok());
  EXPECT_EQ(sequencer.room_for_command(kHeldShapeBytesMax + 1).code(), absl::StatusCode::kResourceExhausted);
  for (std::size_t n = 0; n < kHeldCommandsMax; ++n) {
    ASSERT_TRUE(sequencer.room_for_command(0).ok());
    sequencer.submit(RemoveBody{BodyId{n + 1}}, std::nullopt, nobody);
  }
  EXPECT_EQ(sequencer.room_for_command(0).code(), absl::StatusCode::kResourceExhausted);
  sequencer.step(1, nobody);
  sequencer.take_grants({});
  EXPECT_TRUE(sequencer.room_for_command(0).ok());
}

// What is held is granted after a question that is asked first, and goes on in another sequencer.
TEST(Sequencer, GoesOnFromWhatAnotherHeld) {
  Sequencer before({.tick = 7});
  before.submit(Teleport{.id = BodyId{1}}, std::nullopt, nobody);
  before.submit(ApplyImpulse{BodyId{1}, {1, 0, 0}, {}}, v1::Shape(), nobody);
  ASSERT_TRUE(before.resume(0, {}).ok());
  before.ask_first(v1::Query());
  const std::vector<Sequencer::Held> held = before.held();
  const std::vector<v1::Grant> asked = before.take_grants({});
  EXPECT_EQ(asked.front().queries_size(), 1);
  EXPECT_EQ(asked.front().ticks(), 0u);

  Sequencer after({.tick = 7});
  EXPECT_EQ(after.completed(), 7u);
  after.hold(held);
  ASSERT_TRUE(after.resume(0, {}).ok());
  const std::vector<v1::Grant> grants = after.take_grants({});
  ASSERT_EQ(grants.size(), asked.size() - 1);
  for (std::size_t n = 0; n < grants.size(); ++n) {
    EXPECT_EQ(grants[n].ticks(), asked[n + 1].ticks());
    EXPECT_EQ(grants[n].commands(), asked[n + 1].commands());
    EXPECT_EQ(grants[n].new_shapes_size(), asked[n + 1].new_shapes_size());
  }
  EXPECT_EQ(grants.front().ticks(), 1u) << "the tick of the teleport is one of its own";
  EXPECT_EQ(after.certain(), before.certain());
}

}  // namespace
}  // namespace tessera
