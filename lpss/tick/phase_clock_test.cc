// The phases of a tick make up the tick, and measuring them changes nothing.
#include "lpss/tick/phase_clock.h"

#include <gtest/gtest.h>

#include <numeric>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

using std::chrono::nanoseconds;

nanoseconds time_of(const PhaseTimes& times, TickPhase phase) {
  return times.at(static_cast<std::size_t>(phase));
}
nanoseconds sum(const PhaseTimes& times) {
  return std::accumulate(times.begin(), times.end(), nanoseconds{});
}

TEST(PhaseClockTest, AddsUpWhatEachPhaseTook) {
  nanoseconds now{100};
  PhaseClock clock([&] { return now; });
  const auto pass = [&](int time) { now += nanoseconds{time}; };
  clock.enter(TickPhase::kDetection);
  pass(5);
  clock.enter(TickPhase::kSolving);
  pass(7);
  clock.leave();
  pass(1000);
  clock.enter(TickPhase::kDetection);
  pass(3);
  clock.leave();
  EXPECT_EQ(time_of(clock.times(), TickPhase::kDetection), nanoseconds{8});
  EXPECT_EQ(time_of(clock.times(), TickPhase::kSolving), nanoseconds{7});
  EXPECT_EQ(sum(clock.times()), nanoseconds{15});
  clock.reset();
  EXPECT_EQ(sum(clock.times()), nanoseconds{});
}

TEST(PhaseClockTest, ATickIsMadeOfItsPhasesAndIsNotChangedByTheirMeasuring) {
  WorldSettings settings;
  settings.sector_size = 8;
  const WorldDescription world = pile_world(settings, 40);
  const auto plain = Simulation::create(world);
  ASSERT_TRUE(plain.ok()) << plain.status();
  nanoseconds now{};
  const TimeSource source = [&now] { return now += nanoseconds{1}; };
  const auto timed = Simulation::create(world, 1, source);
  ASSERT_TRUE(timed.ok()) << timed.status();
  for (int tick = 0; tick < 30; ++tick) {
    const nanoseconds before = now;
    (*plain)->step();
    (*timed)->step();
    const PhaseTimes& times = (*timed)->phase_times();
    for (std::size_t phase = 0; phase < times.size(); ++phase) {
      const bool has_programs = phase == static_cast<std::size_t>(TickPhase::kPrograms);
      EXPECT_EQ(times[phase].count() > 0, !has_programs) << name_of(static_cast<TickPhase>(phase));
    }
    // Five calls, each from its first phase to its end: the first reading of a call ends what belongs to no
    // phase.
    EXPECT_EQ(sum(times), now - before - nanoseconds{5});
  }
  EXPECT_EQ((*timed)->hash(), (*plain)->hash());
  EXPECT_EQ(sum((*plain)->phase_times()), nanoseconds{});
}

TEST(PhaseClockTest, AWorldAtRestSpendsNoTime) {
  WorldSettings settings;
  settings.sleep_after = 0.1;
  nanoseconds now{};
  const auto simulation =
      Simulation::create(tower_world(settings, 1, {0, 0, 0}), 1, [&now] { return now += nanoseconds{1}; });
  ASSERT_TRUE(simulation.ok()) << simulation.status();
  for (int tick = 0; tick < 600; ++tick) (*simulation)->step();
  EXPECT_EQ((*simulation)->counts().bodies_awake, 0u);
  EXPECT_EQ(sum((*simulation)->phase_times()), nanoseconds{});
}

}  // namespace
}  // namespace tessera
