#include "coordinator/tick_statistics.h"

#include <gtest/gtest.h>

#include "proto/convert_counts.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

v1::TickReport report(Tick tick, std::uint64_t work_us, std::uint32_t clones) {
  v1::TickReport report;
  report.set_tick(tick);
  report.set_work_us(work_us);
  write(TickCounts{.clones = clones, .diverged = 1}, *report.mutable_counts());
  return report;
}

TEST(DurationHistogram, QuantilesAreWithinAPercent) {
  DurationHistogram histogram;
  EXPECT_EQ(histogram.times().p50, 0);
  for (std::uint64_t us = 1; us <= 100'000; ++us) histogram.add(us);
  EXPECT_NEAR(histogram.times().p50, 50, 0.5);
  EXPECT_NEAR(histogram.times().p99, 99, 0.99);
  EXPECT_NEAR(histogram.times().mean, 50, 0.001);
  EXPECT_EQ(histogram.times().max, 100);
}

TEST(DurationHistogram, TakesAnyNumber) {
  DurationHistogram histogram;
  histogram.add(0);
  histogram.add(~std::uint64_t{0});
  EXPECT_EQ(histogram.times().p50, 0);
  EXPECT_NEAR(histogram.times().p99 / histogram.times().max, 1, 0.01);
}

TEST(TickStatistics, SumsAreOfTicksThatAllHaveReported) {
  TickStatistics statistics(2);
  statistics.add(0, report(1, 1000, 5));
  EXPECT_EQ(statistics.last().tick, 0u);
  statistics.add(0, report(2, 3000, 1));
  statistics.add(1, report(2, 1000, 1));  // before its report of tick 1
  EXPECT_EQ(statistics.last().tick, 2u);
  EXPECT_EQ(statistics.last().counts.clones, 2u);
  statistics.add(1, report(1, 2000, 6));
  EXPECT_EQ(statistics.last().tick, 2u);
  EXPECT_EQ(statistics.counts_since_load().clones, 11u);
  EXPECT_EQ(statistics.counts_since_load().diverged, 4u);
  EXPECT_NEAR(statistics.durations().times().p50, 2, 0.02);
  EXPECT_EQ(statistics.durations().times().max, 3);
  EXPECT_EQ(statistics.durations_of(1).times().max, 2);
}

TEST(RealTimeMeter, LooksBackTwoSecondsWhileItRuns) {
  RealTimeMeter meter;
  EXPECT_EQ(meter.factor(0.01, seconds(1)), 0);
  meter.start(0, seconds(0));
  Tick tick = 0;
  for (int ms = 10; ms <= 10'000; ms += 10) meter.progress(++tick, milliseconds(ms));
  EXPECT_NEAR(meter.factor(0.01, seconds(10)), 1, 0.05);
  for (int ms = 10'000; ms <= 15'000; ms += 20) meter.progress(++tick, milliseconds(ms));
  EXPECT_NEAR(meter.factor(0.01, seconds(15)), 0.5, 0.05);
  meter.stop(tick, seconds(15));
  EXPECT_NEAR(meter.factor(0.01, seconds(99)), static_cast<double>(tick) * 0.01 / 15, 1e-9);
}

}  // namespace
}  // namespace tessera
