// The production state machines on a network that delays and reorders: whatever the timing, the same bits.
#include "simulator/simulated_cluster.h"

#include <gtest/gtest.h>

#include "lpss/simulation/example_worlds.h"
#include "lpss/simulation/simulation.h"

namespace tessera {
namespace {

WorldDescription busy_world() {
  WorldSettings settings;
  settings.sector_size = 8;
  return pile_world(settings, 30);
}

constexpr std::uint64_t kTicks = 60;

std::string hash_in_process(const WorldDescription& world) {
  auto simulation = Simulation::create(world);
  EXPECT_TRUE(simulation.ok()) << simulation.status();
  for (std::uint64_t tick = 0; tick < kTicks; ++tick) (*simulation)->step();
  return (*simulation)->hash().to_string();
}

TEST(MessageTiming, TwoHundredSeedsOfDelayAndReorderEndInTheSameBits) {
  const WorldDescription world = busy_world();
  const std::string expected = hash_in_process(world);
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const std::uint32_t servers = 1 + seed % 4;
    SimulatedCluster cluster(seed, servers, Precision::kFloat32);
    ASSERT_TRUE(cluster.load(world).ok());
    const auto stepped = cluster.step(kTicks);
    ASSERT_TRUE(stepped.ok()) << stepped.status();
    EXPECT_EQ(stepped->tick(), kTicks);
    const auto hash = cluster.hash();
    ASSERT_TRUE(hash.ok()) << hash.status();
    ASSERT_EQ(hash->hash(), expected) << "seed " << seed << ", " << servers << " servers";
  }
}

TEST(MessageTiming, CommandsTakeEffectAtTheTickThatTheReplyNames) {
  const WorldDescription world = busy_world();
  std::string first;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SimulatedCluster cluster(seed, 1 + seed % 3, Precision::kFloat32);
    ASSERT_TRUE(cluster.load(world).ok());
    ASSERT_TRUE(cluster.step(20).ok());
    v1::ApplyImpulseRequest push;
    push.mutable_body()->set_name("body3");
    push.mutable_impulse()->set_z(8);
    const auto reply = cluster.call<v1::ApplyImpulseRequest, v1::CommandReply>(push);
    ASSERT_TRUE(reply.ok()) << reply.status();
    EXPECT_EQ(reply->tick(), 21u);
    ASSERT_TRUE(cluster.step(40).ok());
    const auto hash = cluster.hash();
    ASSERT_TRUE(hash.ok());
    if (first.empty()) first = hash->hash();
    EXPECT_EQ(hash->hash(), first) << "seed " << seed;
  }
}

TEST(Faults, AKilledServerEndsTheWorldWithAMessage) {
  SimulatedCluster cluster(7, 2, Precision::kFloat32);
  ASSERT_TRUE(cluster.load(busy_world()).ok());
  cluster.network().kill(cluster.server_node(1));
  const auto stepped = cluster.step(100);
  EXPECT_EQ(stepped.status().code(), absl::StatusCode::kUnavailable) << stepped.status();
  const auto status = cluster.status();
  ASSERT_TRUE(status.ok());
  EXPECT_EQ(status->state(), "failed");
  EXPECT_FALSE(status->failure().empty());
}

}  // namespace
}  // namespace tessera
