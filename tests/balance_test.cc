// The map follows the load, and the state does not notice.
#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;

constexpr int kBalls = 40;
constexpr std::uint64_t kToSleep = 120;
constexpr std::uint64_t kAfterMove = 60;

// Balls that roll on, over some sectors, and as many boxes far away, which fall asleep: bodies are shared out
// evenly, and the work is not.
WorldDescription crowd_and_sleepers() {
  WorldDescription world = flat_world(4);
  for (int n = 0; n < kBalls; ++n) {
    const double x = 1.5 * (n % 8);
    const double y = 1.5 * static_cast<double>(n / 8);
    NewBody ball = solid(absl::StrCat("ball", n), sphere(0.5), 1, {{0, 0, 0}, {x, y, 0.5}});
    ball.body.linear_velocity = {1, 0, 0};
    add(world, ball);
    add(world, solid(absl::StrCat("box", n), box(1, 1, 1), 1, {{0, 0, 0}, {400 + 2 * x, 2 * y, 0.5}}));
  }
  return world;
}

std::vector<std::uint64_t> awake_by_server(Client& client) {
  std::vector<std::uint64_t> awake;
  const ClusterStatus status = client.status().value();
  for (const ServerStatus& server : status.servers) awake.push_back(server.counts.bodies_awake);
  return awake;
}

TEST(Balance, ACrowdIsSharedOutAndTheStateStaysTheSame) {
  const WorldDescription world = crowd_and_sleepers();
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  ASSERT_THAT(client.load(world).status(), IsOk());
  ASSERT_THAT(client.step(kToSleep, kPatience).status(), IsOk());
  ASSERT_THAT(awake_by_server(client), ::testing::UnorderedElementsAre(kBalls, 0));
  const std::uint64_t epoch = client.status().value().map_epoch;

  for (const char* policy : {"curve", "k-means", "hulls", "graph"}) {
    EXPECT_GT(client.balance(/*dry_run=*/true, policy).value().moved_sectors, 0u) << policy;
  }
  EXPECT_THAT(client.balance(/*dry_run=*/true, "other").status(),
              IsStatus(absl::StatusCode::kInvalidArgument, "known are curve"));
  const Balance plan = client.balance(/*dry_run=*/true).value();
  EXPECT_FALSE(plan.moves);
  EXPECT_GT(plan.moved_sectors, 0u);
  ASSERT_EQ(plan.shares.size(), 2u);
  EXPECT_EQ(client.status().value().map_epoch, epoch);

  const Balance done = client.balance().value();
  EXPECT_TRUE(done.moves);
  EXPECT_EQ(done.tick, kToSleep);
  EXPECT_EQ(done.moved_bodies, plan.moved_bodies);
  ASSERT_THAT(client.step(kAfterMove, kPatience).status(), IsOk());
  EXPECT_EQ(client.status().value().map_epoch, epoch + 1);
  EXPECT_THAT(awake_by_server(client), ::testing::Each(::testing::Ge(kBalls / 4)));
  EXPECT_EQ(client.hash().value().hash, hash_in_process(world, kToSleep + kAfterMove));
}

}  // namespace
}  // namespace tessera
