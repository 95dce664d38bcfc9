#include "lpss/model/tick_counts.h"

#include <gtest/gtest.h>

#include <set>
#include <string_view>

namespace tessera {
namespace {

// Every counter has another value: 1, 2, 3 ...
TickCounts numbered() {
  TickCounts counts;
  std::uint64_t next = 0;
  for (const TickCounter& counter : kTickCounters) counts.*counter.value = ++next;
  return counts;
}

TEST(TickCountsTest, EveryMemberIsInTheListOnceAndHasNamesOfItsOwn) {
  std::set<std::uint64_t> values;
  std::set<std::string_view> names;
  std::set<std::string_view> names_in_run;
  const TickCounts counts = numbered();
  for (const TickCounter& counter : kTickCounters) {
    values.insert(counts.*counter.value);
    names.insert(counter.name);
    names_in_run.insert(counter.name_in_run);
    EXPECT_STRNE(counter.help, "") << counter.name;
  }
  EXPECT_EQ(values.size(), kTickCounters.size());
  EXPECT_EQ(names.size(), kTickCounters.size());
  EXPECT_EQ(names_in_run.size(), kTickCounters.size());
}

TEST(TickCountsTest, SumsOverServers) {
  TickCounts sum = numbered();
  sum += numbered();
  for (const TickCounter& counter : kTickCounters) {
    EXPECT_EQ(sum.*counter.value, 2 * numbered().*counter.value) << counter.name;
  }
}

TEST(TickCountsTest, OverTicksKeepsTheMostOfWhatThereIsAndAddsWhatHappens) {
  TickCounts run;
  run.add_tick({.clones = 5, .diverged = 1});
  run.add_tick({.clones = 3, .diverged = 2});
  EXPECT_EQ(run, (TickCounts{.clones = 5, .diverged = 3}));
}

}  // namespace
}  // namespace tessera
