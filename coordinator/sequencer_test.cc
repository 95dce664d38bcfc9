#include "coordinator/sequencer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

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

void step(Sequencer& sequencer, std::uint64_t ticks, Sequencer::Reply reply) {
  ASSERT_TRUE(sequencer.may_step(ticks).ok());
  sequencer.step_to(sequencer.certain() + ticks, std::move(reply));
}

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

TEST(Sequencer, CommandsGoIntoTheNextGrantByTheClock) {
  Sequencer sequencer({.time_step = 0.01});
  ASSERT_TRUE(sequencer.resume(1, {}).ok());
  EXPECT_EQ(ticks_of(sequencer.take_grants({})), 1u);
  EXPECT_EQ(sequencer.next_command_tick(), 2u) << "it is known at once";
  sequencer.submit({.commands = {RemoveBody{BodyId{1}}, RemoveBody{BodyId{2}}}});
  EXPECT_EQ(sequencer.next_command_tick(), 2u) << "others may join them";
  EXPECT_TRUE(sequencer.take_grants(milliseconds(5)).empty());
  ASSERT_TRUE(sequencer.report(0, 1).ok());
  const std::vector<v1::Grant> grants = sequencer.take_grants(milliseconds(10));
  ASSERT_EQ(grants.size(), 1u);
  EXPECT_EQ(unpack_commands(grants[0].commands()).value().size(), 2u);
  EXPECT_GT(sequencer.next_command_tick(), 2u);
}

TEST(Sequencer, AQuestionWaitsForItsTickAsLongAsTheWorldGoesOn) {
  const auto ask = [](Sequencer& sequencer, Tick after) {
    v1::Question question;
    question.set_id(after);
    sequencer.ask(std::move(question), after);
  };
  // The ticks granted before each question, by its id.
  std::map<std::uint64_t, Tick> asked;
  Tick granted = 0;
  const auto take = [&](Sequencer& sequencer) {
    for (const v1::Grant& grant : sequencer.take_grants({})) {
      granted += grant.ticks();
      for (const v1::Question& question : grant.questions()) asked[question.id()] = granted;
    }
  };
  Sequencer sequencer({.grant_window = 8});
  ASSERT_TRUE(sequencer.resume(0, {}).ok());
  ask(sequencer, 20);
  ask(sequencer, 3);
  take(sequencer);
  EXPECT_EQ(asked.size(), 1u);
  EXPECT_GE(asked[3], 3u);
  while (granted < 30) {
    ASSERT_TRUE(sequencer.report(0, granted).ok());
    take(sequencer);
  }
  EXPECT_GE(asked[20], 20u);
  EXPECT_LT(asked[20], 30u);
  ask(sequencer, 1000);
  take(sequencer);
  EXPECT_FALSE(asked.contains(1000));
  sequencer.pause(nobody);
  take(sequencer);
  EXPECT_EQ(asked[1000], granted) << "a world that has paused comes to no other tick";
}

TEST(Sequencer, AStepIsRefusedUnlessTheWorldIsPaused) {
  Sequencer sequencer({});
  for (const std::uint64_t ticks : {std::uint64_t{0}, kStepTicksMax + 1})
    EXPECT_EQ(sequencer.may_step(ticks).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(sequencer.may_step(kStepTicksMax).ok());
  ASSERT_TRUE(sequencer.resume(0, {}).ok());
  EXPECT_EQ(sequencer.may_step(1).code(), absl::StatusCode::kFailedPrecondition);
}

// A request that is made again after a change of coordinators waits for the same tick.
TEST(Sequencer, AStepThatIsAskedForAgainEndsAtTheSameTick) {
  Sequencer sequencer({});
  int answers = 0;
  const auto count = [&](const absl::Status& status, Tick tick) {
    EXPECT_TRUE(status.ok());
    EXPECT_EQ(tick, 4u);
    ++answers;
  };
  sequencer.step_to(4, count);
  sequencer.step_to(4, count);
  absl::Status beyond;
  sequencer.step_to(6, [&](const absl::Status& status, Tick) { beyond = status; });
  EXPECT_EQ(beyond.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ticks_of(sequencer.take_grants({})), 4u);
  sequencer.step_to(4, count);
  ASSERT_TRUE(sequencer.report(0, 4).ok());
  EXPECT_EQ(answers, 3);
  sequencer.step_to(4, count);
  EXPECT_EQ(answers, 4) << "it is done";
  EXPECT_EQ(ticks_of(sequencer.take_grants({})), 0u);
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
  step(sequencer, 4, [&](const absl::Status& status, Tick tick) { stepped = status.ok() ? tick : 0; });
  EXPECT_EQ(ticks_of(sequencer.take_grants({})), 4u);
  sequencer.pause([&](const absl::Status&, Tick tick) { paused = tick; });
  EXPECT_EQ(paused, 0u);
  ASSERT_TRUE(sequencer.report(0, 4).ok());
  EXPECT_EQ(stepped, 4u);
  EXPECT_EQ(paused, 4u);
  EXPECT_TRUE(sequencer.paused());
}

TEST(Sequencer, HasLimits) {
  constexpr auto kNoRoom = absl::StatusCode::kResourceExhausted;
  Sequencer sequencer({});
  EXPECT_TRUE(sequencer.room_for_commands(1, kHeldShapeBytesMax).ok());
  EXPECT_EQ(sequencer.room_for_commands(1, kHeldShapeBytesMax + 1).code(), kNoRoom);
  EXPECT_TRUE(sequencer.room_for_commands(kHeldCommandsMax, 0).ok());
  EXPECT_EQ(sequencer.room_for_commands(kHeldCommandsMax + 1, 0).code(), kNoRoom) << "a list is whole";
  sequencer.submit(
      {.commands = PackedCommands(std::vector<Command>(kHeldCommandsMax - 1, RemoveBody{BodyId{1}}))});
  EXPECT_TRUE(sequencer.room_for_commands(1, 0).ok());
  EXPECT_EQ(sequencer.room_for_commands(2, 0).code(), kNoRoom);
  step(sequencer, 1, nobody);
  sequencer.take_grants({});
  EXPECT_TRUE(sequencer.room_for_commands(kHeldCommandsMax, 0).ok());

  for (std::size_t n = 0; n < kOpenQuestionsMax; ++n) {
    ASSERT_TRUE(sequencer.room_for_question().ok());
    sequencer.ask(v1::Question());
  }
  EXPECT_EQ(sequencer.room_for_question().code(), kNoRoom);
}

// What is held is granted after a question that is asked first, and goes on in another sequencer.
TEST(Sequencer, GoesOnFromWhatAnotherHeld) {
  Sequencer before({.tick = 7});
  before.submit({.commands = {Teleport{.id = BodyId{1}}}});
  before.hold_at(9,
                 {.commands = {ApplyImpulse{BodyId{1}, {1, 0, 0}, {}}}, .new_shapes = {v1::NumberedShape()}});
  ASSERT_TRUE(before.resume(0, {}).ok());
  before.ask_first(v1::Question());
  const std::vector<SequencedCommands> held = before.held();
  const std::vector<v1::Grant> asked = before.take_grants({});
  EXPECT_EQ(asked.front().questions_size(), 1);
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
  EXPECT_EQ(grants.front().ticks(), 1u) << "another tick has commands";
  EXPECT_EQ(after.certain(), before.certain());
}

// The commands of each tick, from grants that begin after tick `tick`.
std::map<Tick, std::string> commands_by_tick(const std::vector<v1::Grant>& grants, Tick tick) {
  std::map<Tick, std::string> commands;
  for (const v1::Grant& grant : grants) {
    for (std::uint64_t n = 0; n < grant.ticks(); ++n) {
      commands[++tick] = n == 0 ? grant.commands() : pack(std::span<const Command>());
    }
  }
  return commands;
}

// A sequencer at tick 20, after commands for the ticks 1, 6, 7 and 11, as far as they are not forgotten.
struct Rewound {
  explicit Rewound(Tick forgotten) {
    const auto run_to = [&](Tick tick, Sequencer::Reply reply) {
      step(sequencer, tick - sequencer.certain(), std::move(reply));
      for (v1::Grant& grant : sequencer.take_grants({})) grants.push_back(std::move(grant));
      EXPECT_TRUE(sequencer.report(0, tick).ok());
    };
    sequencer.submit({.commands = {ApplyImpulse{BodyId{1}, {1, 0, 0}, {}}}});
    run_to(5, nobody);
    sequencer.submit({.commands = {Teleport{.id = BodyId{1}}}});
    sequencer.submit(
        {.commands = {ApplyImpulse{BodyId{1}, {2, 0, 0}, {}}}, .new_shapes = {v1::NumberedShape()}});
    run_to(10, nobody);
    sequencer.submit({.commands = {ApplyImpulse{BodyId{1}, {3, 0, 0}, {}}}});
    run_to(20, nobody);
    sequencer.forget_past(forgotten);
  }

  Sequencer sequencer{{.world = 1, .keeps_past = true}};
  std::vector<v1::Grant> grants;
};

TEST(Rewind, TheSameCommandsComeAtTheSameTicks) {
  for (const Tick tick : {0, 4, 5, 6, 7, 10, 19}) {
    Rewound world(tick);
    world.sequencer.rewind(2, 3, tick);
    EXPECT_EQ(world.sequencer.completed(), 20u) << "as clients were told";
    EXPECT_TRUE(world.sequencer.replaying());
    std::vector<v1::Grant> again = world.sequencer.take_grants({});
    EXPECT_FALSE(world.sequencer.replaying());
    EXPECT_EQ(again.front().serial(), 1u);
    EXPECT_EQ(again.front().world(), 2u);
    std::map<Tick, std::string> expected = commands_by_tick(world.grants, 0);
    expected.erase(expected.begin(), expected.upper_bound(tick));
    EXPECT_EQ(commands_by_tick(again, tick), expected) << tick;
  }
}

TEST(Rewind, MayComeAgainToALaterTickBeforeAnythingWasGranted) {
  Rewound world(0);
  world.sequencer.rewind(2, 1, 0);
  world.sequencer.rewind(3, 1, 6);
  std::map<Tick, std::string> expected = commands_by_tick(world.grants, 0);
  expected.erase(expected.begin(), expected.upper_bound(6));
  EXPECT_EQ(commands_by_tick(world.sequencer.take_grants({}), 6), expected);
}

TEST(Rewind, WhatComesMeanwhileTakesEffectAfterwards) {
  Rewound world(7);
  world.sequencer.rewind(2, 1, 7);
  world.sequencer.submit({.commands = {ApplyImpulse{BodyId{1}, {4, 0, 0}, {}}}});
  EXPECT_EQ(world.sequencer.next_command_tick(), 21u);
  v1::Question question;
  question.set_id(5);
  world.sequencer.ask(question);
  bool has_paused = false;
  world.sequencer.pause([&](const absl::Status& status, Tick tick) {
    EXPECT_TRUE(status.ok());
    EXPECT_EQ(tick, 20u);
    has_paused = true;
  });
  EXPECT_FALSE(has_paused);
  const std::vector<v1::Grant> again = world.sequencer.take_grants({});
  EXPECT_EQ(again.back().questions_size(), 1) << "answered at the tick that was reached before";
  EXPECT_EQ(ticks_of(again), 13u);
  ASSERT_TRUE(world.sequencer.report(0, 20).ok());
  EXPECT_TRUE(has_paused);
  EXPECT_EQ(world.sequencer.held().size(), 1u);
}

TEST(Rewind, AStepEndsWhereItWasToEnd) {
  Sequencer sequencer({.world = 1, .grant_window = 8, .keeps_past = true});
  Tick done = 0;
  step(sequencer, 30, [&](const absl::Status& status, Tick tick) {
    EXPECT_TRUE(status.ok());
    done = tick;
  });
  sequencer.take_grants({});
  ASSERT_TRUE(sequencer.report(0, 6).ok());
  sequencer.take_grants({});
  sequencer.rewind(2, 1, 0);
  Tick tick = 0;
  for (int n = 0; n < 100 && done == 0; ++n) {
    tick += ticks_of(sequencer.take_grants({}));
    ASSERT_TRUE(sequencer.report(0, tick).ok());
  }
  EXPECT_EQ(done, 30u);
  EXPECT_EQ(tick, 30u);
}

}  // namespace
}  // namespace tessera
