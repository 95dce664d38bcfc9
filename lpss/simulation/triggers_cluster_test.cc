// Events of triggers do not depend on partitions, maps that change, packed sectors, and snapshots.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "lpss/engine/test_world.h"
#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/test_runs.h"
#include "lpss/tick/events.h"

namespace tessera {
namespace {

using ::testing::Gt;

using TriggerEvent = std::tuple<ContactPhase, BodyId, BodyId>;
constexpr int kPileTicks = 300;

// A pile over eight sectors, in a static zone and beside another one, among which every fifth body carries a
// sphere that notices, and a kinematic sheet goes through it.
WorldDescription noticing_pile(std::uint64_t shuffle) {
  WorldSettings settings = sectors_of(4);
  settings.precision = engine_tests::test_precision;
  settings.sleep_after = 0.1;
  settings.shuffle = shuffle;
  WorldDescription world = pile_world(settings, 60);
  PartMaterial notices;
  notices.trigger = true;
  for (std::size_t n = 1; n < world.bodies.size(); n += 5) {
    Shape shape = world.shapes[world.bodies[n].properties.shape];
    shape.parts.push_back(ShapePart{Sphere{1}, {}, notices});
    world.bodies[n].properties.shape = world.shapes.size();
    world.shapes.push_back(shape);
  }
  const auto add = [&](const char* name, const Geometry& geometry, Motion motion,
                       const Eigen::Vector3d& place) {
    BodyDescription body = world.bodies.front();
    body.name = name;
    body.properties.motion = motion;
    body.properties.trigger = true;
    body.properties.shape = world.shapes.size();
    body.pose.position.local = place;
    world.shapes.push_back(Shape{{ShapePart{geometry, {}}}});
    world.bodies.push_back(body);
  };
  add("zone", Box{{3, 3, 3}}, Motion::kStatic, {2, 2, 2});
  add("high", Cylinder{2, 1}, Motion::kStatic, {2, 2, 4});
  add("sheet", Box{{0.1, 2.5, 2.5}}, Motion::kKinematic, {-2, 2, 2});
  world.bodies.back().linear_velocity = {1.7, 0, 0};
  return world;
}

std::vector<TriggerEvent> trigger_events(PartitionCluster& cluster) {
  std::vector<TriggerEvent> all;
  for (Rank rank = 0; rank < cluster.size(); ++rank) {
    for (const ContactEvent& event : cluster.machine(rank).contact_events()) {
      if (event.trigger && event.phase != ContactPhase::kPersist)
        all.emplace_back(event.phase, event.a, event.b);
    }
  }
  std::sort(all.begin(), all.end());
  return all;
}

void report_in(PartitionCluster& cluster) {
  for (Rank rank = 0; rank < cluster.size(); ++rank) report_contacts(cluster.partition(rank), true);
}

struct Course {
  std::vector<std::vector<TriggerEvent>> events;
  std::vector<WorldHash> hashes;
  std::size_t begun = 0;

  friend bool operator==(const Course& a, const Course& b) {
    return a.events == b.events && a.hashes == b.hashes;
  }
};

// Each pair begins, then ends, and so on.
Course course(PartitionCluster& cluster, int ticks, std::set<std::pair<BodyId, BodyId>> open = {}) {
  report_in(cluster);
  Course result;
  for (int tick = 0; tick < ticks; ++tick) {
    cluster.step();
    for (Rank rank = 0; rank < cluster.size(); ++rank) check_invariants(cluster.partition(rank));
    for (const auto& [phase, trigger, visitor] : trigger_events(cluster)) {
      const std::pair pair(trigger, visitor);
      if (phase == ContactPhase::kBegin) {
        EXPECT_TRUE(open.insert(pair).second) << trigger.value << " " << visitor.value << " at " << tick;
        ++result.begun;
      } else {
        EXPECT_EQ(open.erase(pair), 1u) << trigger.value << " " << visitor.value << " at " << tick;
      }
    }
    result.events.push_back(trigger_events(cluster));
    result.hashes.push_back(cluster.hash());
  }
  return result;
}

TEST(TriggersOfClusters, AreAlikeOnAnyMap) {
  const Course alone = course(*cluster_of(noticing_pile(0), 1), kPileTicks);
  EXPECT_THAT(alone.begun, Gt(80u));
  for (const std::uint32_t partitions : {2u, 4u}) {
    EXPECT_EQ(course(*cluster_of(noticing_pile(0), partitions), kPileTicks), alone) << partitions;
  }
  const auto many = cluster_of(noticing_pile(3), 3);
  EXPECT_EQ(course(*many, kPileTicks), alone) << "shuffled";
}

// Balls fly out of a trigger, over the border in the same tick, to servers that have no trigger.
TEST(TriggersOfClusters, EndWhereNobodyHasATrigger) {
  WorldSettings settings = sectors_of(16);
  settings.precision = engine_tests::test_precision;
  settings.gravity = UniformGravity{{0, 0, 0}};
  WorldBuilder builder(settings);
  BodyDescription& gate =
      builder.add("gate", builder.shape(Box{{2, 2, 2}}), 1, {0, 0, 0}, Motion::kKinematic);
  gate.properties.trigger = true;
  const ShapeId ball = builder.shape(Sphere{0.1});
  for (int n = 0; n < 60; ++n) {
    const Eigen::Vector3d way = Eigen::Vector3d(n % 5 - 2, n % 3 - 1, n % 7 - 3.5).normalized();
    builder.add("ball" + std::to_string(n), ball, 1, 0.5 * way).linear_velocity = way * (300 + 20 * n);
  }
  const Course alone = course(*cluster_of(builder.world(), 1), 10);
  EXPECT_THAT(alone.begun, Gt(40u));
  for (const std::uint32_t partitions : {2u, 4u, 8u})
    EXPECT_EQ(course(*cluster_of(builder.world(), partitions), 10), alone) << partitions;
}

TEST(TriggersOfClusters, ArePackedWithTheirSectors) {
  const auto packing = [](std::uint64_t after) {
    auto cluster = cluster_of(noticing_pile(0), 2);
    for (Rank rank = 0; rank < 2; ++rank) cluster->partition(rank).pack_after = after;
    return cluster;
  };
  EXPECT_EQ(course(*packing(0), 2 * kPileTicks),
            course(*packing(std::numeric_limits<std::uint64_t>::max()), 2 * kPileTicks));
}

TEST(TriggersOfClusters, GoOnFromASnapshot) {
  for (const int before : {60, 140, 280}) {
    const auto first = cluster_of(noticing_pile(0), 2);
    course(*first, before);
    const auto restored = PartitionCluster::restore(first->snapshot(), 3);
    ASSERT_TRUE(restored.ok()) << restored.status();
    report_in(**restored);
    for (int tick = before; tick < kPileTicks; ++tick) {
      first->step();
      (*restored)->step();
      ASSERT_EQ(trigger_events(*first), trigger_events(**restored)) << "tick " << tick;
      ASSERT_EQ(first->hash(), (*restored)->hash());
    }
  }
}

// Whoever begins to watch hears of what begins from then on.
TEST(TriggersOfClusters, AreKeptWhileNobodyWatches) {
  const auto watched = cluster_of(noticing_pile(0), 1);
  report_in(*watched);
  const auto later = cluster_of(noticing_pile(0), 1);
  for (int tick = 0; tick < kPileTicks; ++tick) {
    if (tick == 100) report_in(*later);
    watched->step();
    later->step();
    if (tick >= 100) {
      ASSERT_EQ(trigger_events(*watched), trigger_events(*later)) << "tick " << tick;
    }
  }
}

}  // namespace
}  // namespace tessera
