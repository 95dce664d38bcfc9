#include "sector_server/tick_meter.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

using namespace std::chrono_literals;

TEST(TickMeter, WhatIsNotOwnWorkIsWaiting) {
  TickMeter meter;
  meter.begin_tick(1s, 0);
  meter.add_own(2ms);
  meter.add_own(1ms);
  const TickMeter::Times times = meter.end_tick(1s + 10ms, 0);
  EXPECT_EQ(times.all, 10ms);
  EXPECT_EQ(times.own, 3ms);
  EXPECT_EQ(meter.usual_own_us(), 3000);
  EXPECT_EQ(meter.usual_wait_us(), 7000);
}

TEST(TickMeter, AChangeOfTheMapCountsWithTheTickThatFollows) {
  TickMeter meter;
  meter.begin_move(1s);
  meter.add_own(2ms);
  meter.end_move(1s + 5ms);
  meter.begin_tick(2s, 0);
  meter.add_own(1ms);
  const TickMeter::Times times = meter.end_tick(2s + 4ms, 0);
  EXPECT_EQ(times.all, 9ms);
  EXPECT_EQ(times.own, 3ms);
}

TEST(TickMeter, TicksThatWaitForGroundAreCounted) {
  TickMeter meter;
  for (const std::uint64_t waits : {3u, 3u, 5u}) {
    meter.begin_tick(0s, 3);
    meter.end_tick(1ms, waits);
  }
  EXPECT_EQ(meter.ticks_waited_for_ground(), 1u);
}

}  // namespace
}  // namespace tessera
