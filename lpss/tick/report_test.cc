// What a server counts at the end of a tick.
#include "lpss/tick/report.h"

#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

TEST(Report, CountsSectorsBodiesClonesAndContactsOfATick) {
  TestWorld world;
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
  world.add(in_state(box(3, kHigh, {4, 0, 0}), Activity::kAsleep));
  world.add(in_state(box(4, {5, 0, 0}, {0, 0, 0}), Activity::kAsleep));
  world.exchange();
  world.detect();
  TickCounts counts;
  counts.islands_shipped = 7;
  count(world[0], world.contexts[0].stepped, {}, counts);
  EXPECT_EQ(counts.sectors, 3u);
  EXPECT_EQ(counts.sectors_awake, 2u);
  EXPECT_EQ(counts.bodies_awake, 2u);
  EXPECT_EQ(counts.clones, 1u);
  EXPECT_EQ(counts.contacts, 1u);
  EXPECT_EQ(counts.islands_shipped, 7u) << "counted where they are solved";
}

}  // namespace
}  // namespace tessera
