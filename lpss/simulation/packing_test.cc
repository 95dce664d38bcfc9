// Sectors at rest are packed, and come back with the bits that they had: a world in which they are packed at
// once goes on as one in which they never are.
#include "lpss/partition/packing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "lpss/observe/queries.h"
#include "lpss/observe/state.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"
#include "lpss/tick/events.h"

namespace tessera {
namespace {

using ::testing::Gt;

constexpr std::uint64_t kAtOnce = 0;
constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

std::unique_ptr<PartitionCluster> cluster_that_packs(const WorldDescription& world, std::uint32_t partitions,
                                                     std::uint64_t pack_after) {
  std::unique_ptr<PartitionCluster> cluster = cluster_of(world, partitions);
  for (Rank rank = 0; rank < partitions; ++rank) {
    cluster->partition(rank).pack_after = pack_after;
    report_contacts(cluster->partition(rank), true);
  }
  return cluster;
}

std::size_t packed_bodies(PartitionCluster& cluster) {
  std::size_t sum = 0;
  for (Rank rank = 0; rank < cluster.size(); ++rank) sum += cluster.partition(rank).packed.counts().bodies;
  return sum;
}

using Happening = std::tuple<BodyId, BodyId, ContactPhase, double, double>;

std::vector<Happening> happenings(PartitionCluster& cluster) {
  std::vector<Happening> all;
  for (Rank rank = 0; rank < cluster.size(); ++rank) {
    for (const ContactEvent& event : cluster.machine(rank).contact_events())
      all.emplace_back(event.a, event.b, event.phase, event.impulse, event.depth);
  }
  std::sort(all.begin(), all.end());
  return all;
}

constexpr double kLarge = 1.3;  // m, the radius of a ball larger than all else

// Boxes, balls and more in heaps over many small sectors: a good part of them asleep at any time, until a
// command wakes some.
WorldDescription heaps() {
  WorldDescription world = pile_world(sectors_of(4), 80);
  world.settings.sleep_after = 0.1;
  world.shapes.push_back(Shape{{ShapePart{Sphere{kLarge}, {}}}});  // of nobody yet
  return world;
}

constexpr int kTicks = 2600;

// Something every 200 ticks, so that most of the heap sleeps in between.
std::vector<Command> commands_at(const WorldDescription& world, int tick) {
  const auto body = [&](int n) { return BodyId{static_cast<std::uint64_t>(n + tick / 200)}; };
  if (tick == 1900) {
    JointRecord joint;
    joint.id = JointId{1};
    joint.properties.type = JointType::kBall;
    joint.properties.parent = BodyId{20};
    joint.properties.child = BodyId{21};
    joint.properties.in_parent.position = {0, 0, 0.5};
    joint.parent_motion = Motion::kDynamic;
    return {AddJoint{joint}};
  }
  if (tick == 2200) {
    BodyRecord large = records_of(world)->at(1);
    large.id = BodyId{2000};
    large.properties.shape = static_cast<ShapeId>(world.shapes.size() - 1);
    large.state.position = {1, 1, 6};
    return {SpawnBody{large}};
  }
  if (tick == 2500) return {RemoveBody{BodyId{1}}};  // the floor
  if (tick < 300 || tick % 200 != 0) return {};
  switch (tick / 200 % 4) {
    case 0:
      return {ApplyImpulse{body(3), {3, 1, 4}, {0.1, 0, 0}}};
    case 1: {
      BodyRecord spawned = records_of(world)->at(1);
      spawned.id = body(1000);
      return {SpawnBody{spawned}};
    }
    case 2:
      return {RemoveBody{body(30)}};
    default: {
      BodyState state;
      state.position = {1.5, -1.9, 3};
      return {Teleport{body(50), {0, 0, 0}, state}};
    }
  }
}

class Packing : public ::testing::TestWithParam<std::tuple<std::uint32_t, std::uint64_t>> {};

TEST_P(Packing, ChangesNoBitAndNoContactEvent) {
  const auto [partitions, shuffle] = GetParam();
  WorldDescription world = heaps();
  world.settings.shuffle = shuffle;
  const auto packs = cluster_that_packs(world, partitions, kAtOnce);
  const auto keeps = cluster_that_packs(world, partitions, kNever);
  std::size_t most_packed = 0;
  std::size_t ticks_of_packing = 0;
  for (int tick = 0; tick < kTicks; ++tick) {
    const std::vector<Command> commands = commands_at(world, tick);
    if (tick == 700 || tick == 1100) {
      for (const auto& cluster : {packs.get(), keeps.get()}) {
        for (Rank rank = 0; rank < partitions; ++rank)
          report_contacts(cluster->partition(rank), tick == 1100);
      }
    }
    packs->step(commands);
    keeps->step(commands);
    ASSERT_EQ(packs->hash(), keeps->hash()) << "tick " << tick;
    ASSERT_EQ(happenings(*packs), happenings(*keeps)) << "tick " << tick;
    for (Rank rank = 0; rank < partitions; ++rank) check_invariants(packs->partition(rank));
    const std::size_t packed = packed_bodies(*packs);
    most_packed = std::max(most_packed, packed);
    ticks_of_packing += packed > 0 ? 1 : 0;
    ASSERT_EQ(packed_bodies(*keeps), 0u);
  }
  EXPECT_THAT(most_packed, Gt(40u));
  EXPECT_THAT(ticks_of_packing, Gt(300u));
}

INSTANTIATE_TEST_SUITE_P(Everywhere, Packing,
                         ::testing::Combine(::testing::Values(1u, 3u), ::testing::Values(0u, 5u)));

TEST(PackedSnapshot, HasTheSameAsOneOfAWorldThatPacksNothing) {
  const WorldDescription world = heaps();
  const auto packs = cluster_that_packs(world, 2, kAtOnce);
  const auto keeps = cluster_that_packs(world, 2, kNever);
  for (int tick = 0; tick < 400; ++tick) {
    packs->step();
    keeps->step();
  }
  ASSERT_THAT(packed_bodies(*packs), Gt(60u));
  const auto restored = PartitionCluster::restore(packs->snapshot(), 3);
  const auto other = PartitionCluster::restore(keeps->snapshot(), 1);
  ASSERT_TRUE(restored.ok()) << restored.status();
  ASSERT_TRUE(other.ok()) << other.status();
  const std::vector<Command> push{ApplyImpulse{BodyId{5}, {0, 3, 5}, {0.1, 0, 0}}};
  for (int tick = 0; tick < 100; ++tick) {
    (*restored)->step(tick == 0 ? push : std::vector<Command>{});
    (*other)->step(tick == 0 ? push : std::vector<Command>{});
    ASSERT_EQ((*restored)->hash(), (*other)->hash()) << "tick " << tick;
  }
}

TEST(PackedSectors, AnswerQuestions) {
  const WorldDescription world = heaps();
  const auto packs = cluster_that_packs(world, 1, kAtOnce);
  const auto keeps = cluster_that_packs(world, 1, kNever);
  for (int tick = 0; tick < 400; ++tick) {
    packs->step();
    keeps->step();
  }
  ASSERT_THAT(packed_bodies(*packs), Gt(60u));
  const auto states = [](PartitionCluster& cluster) {
    std::vector<std::pair<BodyId, std::array<double, 3>>> all;
    for_each_body(cluster.partition(0),
                  [&](const BodyRecord& body) { all.emplace_back(body.id, body.state.position); });
    return all;
  };
  EXPECT_EQ(states(*packs), states(*keeps));
  EXPECT_EQ(packs->body(BodyId{9})->home, keeps->body(BodyId{9})->home);
  EXPECT_EQ(packs->counts().sectors, keeps->counts().sectors);

  const auto near = [](PartitionCluster& cluster) {
    std::vector<std::pair<BodyId, double>> all;
    for (const NearBody& body : bodies_near(cluster.partition(0), Sphere{1}, {{{}, {0, 0, 1}}, {}}, 2, ~0u))
      all.emplace_back(body.body, body.distance);
    return all;
  };
  EXPECT_EQ(near(*packs), near(*keeps));
  const auto hit = [](PartitionCluster& cluster) {
    const auto answer = raycast(cluster.partition(0), {{}, {0, 0, 20}}, -Eigen::Vector3d::UnitZ(), 30, ~0u);
    return std::pair(answer->body, answer->distance);
  };
  EXPECT_EQ(hit(*packs), hit(*keeps));
}

// Whoever asks for more than what is packed gets what was asked for, and no more comes back.
TEST(PackedSectors, ComeBackOneByOne) {
  WorldBuilder builder(sectors_of(16));
  builder.world().settings.sleep_after = 0.1;
  builder.add("ground", builder.shape(Plane{}), 1, {0, 0, 0}, Motion::kStatic);
  const ShapeId box = builder.shape(Box{{1, 1, 1}});
  for (int n = 0; n < 200; ++n) builder.add(absl::StrCat("box", n), box, 1, {16.0 * n, 0, 0.5});
  const auto cluster = cluster_of(builder.world(), 1);
  Partition& partition = cluster->partition(0);
  partition.pack_after = 5;
  while (!partition.at_rest) cluster->step();
  EXPECT_EQ(partition.packed.counts().bodies, 0u) << "they have just fallen asleep";
  while (partition.packed.counts().bodies == 0) cluster->step();
  EXPECT_EQ(partition.packed.counts().bodies, kPackedAtOnce) << "so many a tick";
  for (int tick = 0; tick < 3; ++tick) cluster->step();
  EXPECT_EQ(partition.packed.counts().bodies, 200u);
  EXPECT_TRUE(partition.sectors.empty());
  EXPECT_TRUE(partition.at_rest);

  const std::vector<Command> push{ApplyImpulse{BodyId{5}, {0, 3, 0}, {}}};
  cluster->step(push);
  EXPECT_EQ(partition.packed.counts().bodies, 199u);
  EXPECT_EQ(partition.sectors.size(), 1u);
  for (int tick = 0; tick < 300; ++tick) cluster->step();
  EXPECT_EQ(partition.packed.counts().bodies, 200u) << "and falls asleep again";
}

}  // namespace
}  // namespace tessera
