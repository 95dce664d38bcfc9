// The state of a world does not depend on the number of processes that simulate it, nor on its position.
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;

constexpr std::uint64_t kWholeRun = 180;
constexpr const char* kWorlds[] = {"busy.sdf",     "seam.sdf",    "tower.sdf", "falling.sdf",  "machines.sdf",
                                   "globe.sdf",    "station.sdf", "flee.sdf",  "fountain.sdf", "workshop.sdf",
                                   "airfield.sdf", "road.sdf",    "rover.sdf", "house.sdf",    "harbour.sdf",
                                   "train.sdf",    "habitat.sdf", "orbit.sdf", "ferry.sdf",    "voyage.sdf",
                                   "tram.sdf"};

class PlacementInvariance : public ::testing::TestWithParam<int> {};

TEST_P(PlacementInvariance, ClusterEndsInTheBitsOfOneProcess) {
  const Cluster cluster = start_cluster(GetParam());
  ASSERT_TRUE(cluster.client);
  for (const char* name : kWorlds) {
    SCOPED_TRACE(name);
    WorldDescription world = read_world(name);
    const std::string expected = hash_in_process(world, kWholeRun);
    ASSERT_THAT(cluster.client->load(world, true).status(), IsOk());
    ASSERT_THAT(cluster.client->step(kWholeRun, kPatience).status(), IsOk());
    EXPECT_EQ(cluster.client->hash().value().hash, expected);
  }
}

INSTANTIATE_TEST_SUITE_P(Servers, PlacementInvariance, ::testing::Values(1, 2, 4));

TEST(TranslationInvariance, ClusterAtTheEndOfTheRangeEndsInTheSameBits) {
  WorldDescription world = read_world("busy.sdf");
  const std::string expected = hash_in_process(world, kWholeRun);
  ASSERT_THAT(move_by(world, {std::int64_t{1} << 62, -(std::int64_t{1} << 62), std::int64_t{1} << 40}),
              IsOk());
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(world).status(), IsOk());
  ASSERT_THAT(cluster.client->step(kWholeRun, kPatience).status(), IsOk());
  EXPECT_EQ(cluster.client->hash().value().hash, expected);
}

TEST(PlacementInvariance, StepsInPiecesEndInTheSameBits) {
  const WorldDescription world = read_world("busy.sdf");
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(world).status(), IsOk());
  for (std::uint64_t piece = 1, tick = 0; tick < kWholeRun;
       tick += piece, piece = std::min(2 * piece, kWholeRun - tick)) {
    ASSERT_EQ(cluster.client->step(piece, kPatience).value(), tick + piece);
  }
  EXPECT_EQ(cluster.client->hash().value().hash, hash_in_process(world, kWholeRun));
}

TEST(PlacementInvariance, CommandsTakeEffectAtTheirTickOnAnyNumberOfServers) {
  std::set<std::string> hashes;
  for (const int servers : {1, 2}) {
    const Cluster cluster = start_cluster(servers);
    ASSERT_TRUE(cluster.client);
    Client& client = *cluster.client;
    ASSERT_THAT(client.load(read_world("seam.sdf")).status(), IsOk());
    const Spawned crate = client.spawn(solid("late", box(1, 1, 1), 100, {{0, 0, 0}, {5, 5, 8}})).value();
    EXPECT_EQ(crate.tick, 1u);
    ASSERT_THAT(client.set_velocity("ball::ball", {6, 1, 0}, {0, 3, 0}).status(), IsOk());
    ASSERT_THAT(client.step(60, kPatience).status(), IsOk());
    EXPECT_EQ(client.apply_impulse("late", {0, 300, 0}, {0, 0, 0.2}).value(), 61u);
    ASSERT_THAT(client.apply_force(crate.id, {0, 0, 2000}).status(), IsOk());
    ASSERT_THAT(client.remove("crate_edge::crate").status(), IsOk());
    ASSERT_THAT(client.step(60, kPatience).status(), IsOk());
    ASSERT_THAT(client.teleport("late", {{{1, 0, 0}, {0, 0, 4}}, Eigen::Quaterniond::Identity()}).status(),
                IsOk());
    ASSERT_THAT(client.step(60, kPatience).status(), IsOk());
    hashes.insert(client.hash().value().hash);
  }
  EXPECT_EQ(hashes.size(), 1u);
}

}  // namespace
}  // namespace tessera
