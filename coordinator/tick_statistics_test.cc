#include "coordinator/tick_statistics.h"

#include <gtest/gtest.h>

#include <array>

#include "proto/convert.h"
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

constexpr std::array<NodeId, 2> kServers{NodeId{7}, NodeId{5}};

TEST(TickStatistics, SumsAreOfTicksThatAllHaveReported) {
  TickStatistics statistics(kServers);
  statistics.add(kServers[0], report(1, 1000, 5));
  EXPECT_EQ(statistics.last().tick, 0u);
  statistics.add(kServers[0], report(2, 3000, 1));
  statistics.add(kServers[1], report(2, 1000, 1));  // before its report of tick 1
  EXPECT_EQ(statistics.last().tick, 2u);
  EXPECT_EQ(statistics.last().counts.clones, 2u);
  statistics.add(kServers[1], report(1, 2000, 6));
  EXPECT_EQ(statistics.last().tick, 2u);
  EXPECT_EQ(statistics.counts_since_load().clones, 11u);
  EXPECT_EQ(statistics.counts_since_load().diverged, 4u);
  EXPECT_NEAR(statistics.durations().times().p50, 2, 0.02);
  EXPECT_EQ(statistics.durations().times().max, 3);
  EXPECT_EQ(statistics.durations_of(kServers[1]).times().max, 2);
}

TEST(TickStatistics, ServersJoinAndLeaveBetweenTicks) {
  TickStatistics statistics(kServers);
  const std::array<NodeId, 3> three{kServers[0], kServers[1], NodeId{9}};
  statistics.change_servers(2, three);
  statistics.change_servers(4, std::array<NodeId, 2>{kServers[1], NodeId{9}});
  const auto is_whole = [&](NodeId server, Tick tick) {
    return statistics.add(server, report(tick, 1000, 1)).has_value();
  };
  EXPECT_FALSE(is_whole(NodeId{9}, 2));
  EXPECT_FALSE(is_whole(NodeId{9}, 3));
  EXPECT_FALSE(is_whole(NodeId{9}, 4));
  EXPECT_FALSE(is_whole(kServers[1], 1));
  EXPECT_FALSE(is_whole(kServers[1], 2));
  EXPECT_FALSE(is_whole(kServers[1], 3));
  EXPECT_TRUE(is_whole(kServers[1], 4)) << "without the one that has left";
  EXPECT_TRUE(is_whole(kServers[0], 1)) << "that still tells of the ticks before";
  EXPECT_TRUE(is_whole(kServers[0], 2));
  EXPECT_TRUE(is_whole(kServers[0], 3));
  EXPECT_EQ(statistics.counts_since_load().diverged, 10u);
}

// However many servers there are, and in whatever order they report.
TEST(TickStatistics, KeepsTheFirstDivergences) {
  TickStatistics statistics(kServers);
  const auto told = [](Tick tick, std::uint64_t first_body) {
    v1::TickReport message = report(tick, 1000, 0);
    for (std::uint64_t n = 0; n < kDivergencesKept; ++n)
      *message.add_divergences() = to_proto(Divergence{tick, BodyId{first_body + 2 * n}});
    return message;
  };
  statistics.add(kServers[0], report(1, 1000, 0));
  v1::TickReport one = report(1, 1000, 0);
  *one.add_divergences() = to_proto(Divergence{1, BodyId{9}, JointId{3}, DivergenceKind::kSpeed});
  statistics.add(kServers[1], one);
  statistics.add(kServers[1], told(2, 2));
  statistics.add(kServers[0], told(2, 1));
  statistics.add(kServers[0], told(3, 1));
  statistics.add(kServers[1], told(3, 2));
  const std::vector<Divergence>& first = statistics.divergences();
  ASSERT_EQ(first.size(), kDivergencesKept);
  EXPECT_EQ(first[0], (Divergence{1, BodyId{9}, JointId{3}, DivergenceKind::kSpeed}));
  for (std::uint64_t n = 1; n < kDivergencesKept; ++n) EXPECT_EQ(first[n], (Divergence{2, BodyId{n}}));
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
