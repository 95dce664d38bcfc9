// Streams hear of each body that is awake, falls asleep, comes or is moved, once; and of nothing at rest.
#include "lpss/observe/body_changes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"
#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::set<std::uint64_t> since(const BodyChanges& changes, Partition& partition, std::uint64_t look) {
  std::set<std::uint64_t> ids;
  const auto all = [](const SectorIndex&) { return true; };
  changes.for_each_since(partition, look, all, [&](const BodyView& body) { ids.insert(body.id.value); });
  return ids;
}

std::vector<std::uint64_t> left_since(const BodyChanges& changes, std::uint64_t look) {
  std::vector<std::uint64_t> ids;
  changes.for_each_left_since(look, [&](BodyId id) { ids.push_back(id.value); });
  return ids;
}

TEST(BodyChanges, AreOfWhatIsAwakeAndOnceOfWhatFallsAsleep) {
  TestPartition partition;
  add_body(*partition, box(1, kHigh, {0, 0, 0}));
  add_body(*partition, in_state(box(2, kHigh, {3, 0, 0}), Activity::kAsleep));
  BodyChanges changes;
  EXPECT_FALSE(changes.knows_since(0));
  changes.look(*partition);
  EXPECT_TRUE(changes.knows_since(1));
  EXPECT_FALSE(changes.knows_since(0)) << "what came before the first look";
  changes.look(*partition);
  EXPECT_THAT(since(changes, *partition, 1), ElementsAre(1));
  sector(*partition, kHigh).world->sleep(body(*partition, 1).slot);
  changes.look(*partition);
  EXPECT_THAT(since(changes, *partition, 2), ElementsAre(1));
  changes.look(*partition);
  EXPECT_THAT(since(changes, *partition, 3), IsEmpty());
  EXPECT_THAT(since(changes, *partition, 1), ElementsAre(1)) << "whoever asks seldom hears of it, too";
  EXPECT_EQ(changes.last_of(kHigh, BodyId{1}), 3u);
  EXPECT_EQ(changes.last_of(kHigh, BodyId{2}), 0u);
}

TEST(BodyChanges, TellWhoLeavesASectorAtRest) {
  TestPartition partition;
  add_body(*partition, in_state(box(1, kHigh, {0, 0, 0}), Activity::kAsleep));
  add_body(*partition, in_state(box(2, kLow, {0, 0, 0}), Activity::kAsleep));
  BodyChanges changes;
  changes.look(*partition);
  partition->active.clear();
  for (const SectorIndex& index : {kLow, kHigh}) sector(*partition, index).active = false;
  remove_home(*partition, body(*partition, 2));
  changes.look(*partition);
  EXPECT_THAT(left_since(changes, 1), ElementsAre(2));
  EXPECT_THAT(since(changes, *partition, 1), IsEmpty());
  changes.drop_until(2);
  EXPECT_THAT(left_since(changes, 2), IsEmpty());
  EXPECT_FALSE(changes.knows_since(1));
}

TEST(BodyChanges, AreNotKnownAfterAPause) {
  TestPartition partition;
  add_body(*partition, box(1, kHigh, {0, 0, 0}));
  BodyChanges changes;
  changes.look(*partition);
  changes.look(*partition);
  changes.forget();
  changes.look(*partition);
  EXPECT_FALSE(changes.knows_since(2));
  EXPECT_TRUE(changes.knows_since(3));
}

TEST(BodyMoves, AreNotNotedForNobody) {
  BodyMoves moves;
  moves.note_left(BodyId{1});
  EXPECT_EQ(moves.take(), std::nullopt);
  moves.note_left(BodyId{1});
  EXPECT_THAT(moves.take()->left, ElementsAre(BodyId{1}));
  for (std::size_t n = 0; n <= BodyMoves::kNotesMax; ++n) moves.note_stirred({});
  EXPECT_EQ(moves.take(), std::nullopt) << "too many";
}

// The bits of all bodies of a partition.
using Bits = decltype(bits(BodyState()));
std::map<std::uint64_t, std::pair<SectorIndex, Bits>> states(const Partition& partition) {
  std::map<std::uint64_t, std::pair<SectorIndex, Bits>> all;
  for_each_body(partition, [&](const BodyRecord& record) {
    all.emplace(record.id.value, std::pair(record.home, bits(record.state)));
  });
  return all;
}

// Heaps over many sectors that fall asleep, are packed at once, are woken by commands, and change servers at
// random.
class WholeRuns : public testing::TestWithParam<std::uint32_t> {
 protected:
  void SetUp() override {
    WorldDescription world = pile_world(sectors_of(4), 60);
    world.settings.sleep_after = 0.1;
    if (GetParam() > 1) world.settings.shuffle = 7;
    cluster = cluster_of(world, GetParam());
    for (Rank rank = 0; rank < GetParam(); ++rank) cluster->partition(rank).pack_after = 0;
  }

  std::vector<Command> some_commands() {
    std::vector<Command> commands;
    if (random() % 8 != 0) return commands;
    const BodyId id{random() % 60 + 1};
    const absl::StatusOr<BodyRecord> record = cluster->body(id);
    if (!record.ok()) return commands;
    if (random() % 3 == 0) {
      commands.push_back(RemoveBody{id, {}});
    } else {
      commands.push_back(ApplyImpulse{id, {0, 0, 3 * record->properties.mass}, {}});
    }
    return commands;
  }

  std::mt19937 random{1};
  std::unique_ptr<PartitionCluster> cluster;
};

TEST_P(WholeRuns, MissNoChangeAndTellNoneTwice) {
  std::vector<BodyChanges> changes(GetParam());
  std::vector<std::map<std::uint64_t, std::pair<SectorIndex, Bits>>> before(GetParam());
  std::size_t told = 0;
  for (int tick = 0; tick < 400; ++tick) {
    for (Rank rank = 0; rank < GetParam(); ++rank) {
      Partition& partition = cluster->partition(rank);
      const std::uint64_t last = changes[rank].looks();
      changes[rank].look(partition);
      const auto now = states(partition);
      if (changes[rank].knows_since(last)) {
        const std::set<std::uint64_t> changed = since(changes[rank], partition, last);
        const std::vector<std::uint64_t> left = left_since(changes[rank], last);
        for (const auto& [id, state] : now) {
          const auto old = before[rank].find(id);
          const bool is_awake = std::get<5>(state.second) != static_cast<int>(Activity::kAsleep);
          const bool is_news = is_awake || old == before[rank].end() || old->second != state;
          ASSERT_EQ(changed.contains(id), is_news) << "body " << id << " at tick " << tick;
        }
        for (const auto& [id, state] : before[rank]) {
          const auto here = now.find(id);
          if (here != now.end() && here->second.first == state.first) continue;
          ASSERT_THAT(left, testing::Contains(id)) << "tick " << tick;
        }
        told += changed.size();
      }
      before[rank] = now;
      changes[rank].drop_until(last);
    }
    cluster->step(some_commands());
  }
  EXPECT_GT(told, 100u);
}

INSTANTIATE_TEST_SUITE_P(OnServers, WholeRuns, testing::Values(1, 3));

}  // namespace
}  // namespace tessera
