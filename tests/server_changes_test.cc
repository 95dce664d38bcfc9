// Servers that join a running world, and that leave it: nobody goes back, and clients miss nothing.
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <thread>
#include <utility>

#include "tests/cluster_fixture.h"
#include "tests/watched_run.h"

namespace tessera {
namespace {

using namespace tessera::testing;

class ServerChanges : public WatchedRun {
 protected:
  // The busy world on two servers, and on all others that come, watched and pushed.
  void SetUp() override {
    cli::LocalClusterOptions options;
    options.servers_to_start = 1;
    options.checkpoint_every = absl::Milliseconds(200);
    options.balance_every = absl::ZeroDuration();  // so light a world may go to one server
    cluster_ = start_cluster(0, options);
    ASSERT_TRUE(cluster_.client);
    ASSERT_TRUE(await_joined(cluster_, 1));
    start_server();
    begin(client());
    go_on(30);
  }

  void launch_server() {
    ++processes_;
    ASSERT_THAT(cluster_.processes->start_server(), IsOk());
  }

  // They join in the order in which they are started.
  void start_server() {
    launch_server();
    ASSERT_TRUE(await_joined(cluster_, static_cast<int>(processes_)));
  }

  // Runs on until so many servers have a part of the world.
  void await_parts(std::size_t servers) {
    const auto parts = [&] {
      const std::vector<ServerStatus> all = client().status().value().servers;
      return static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [](const ServerStatus& server) {
        return server.takes_part && server.bodies > 0;
      }));
    };
    for (const absl::Time end = absl::Now() + kPatience; parts() != servers && !HasFatalFailure();) {
      ASSERT_LT(absl::Now(), end) << parts() << " servers have a part";
      client().balance().status().IgnoreError();  // not while a server joins
      go_on(10);
    }
  }

  void expect_nobody_went_back(std::uint64_t joined, std::uint64_t left) {
    const ClusterStatus status = client().status().value();
    EXPECT_EQ(status.recoveries, 0u);
    EXPECT_EQ(status.joined_servers, joined);
    EXPECT_EQ(status.left_servers, left);
  }

  Client& client() { return *cluster_.client; }

  Cluster cluster_;
  std::size_t processes_ = 1;
};

TEST_F(ServerChanges, FromTwoToFourToTwoWhileTheWorldRuns) {
  longest_gap_ = absl::ZeroDuration();
  for (const std::size_t servers : {3, 4}) {
    launch_server();  // and read on meanwhile, as clients do
    await_parts(servers);
  }
  const absl::Duration joins = std::exchange(longest_gap_, absl::ZeroDuration());
  for (const std::size_t place : {0, 1}) {
    absl::Status drained;
    std::thread drain(
        [&, node = client().status().value().servers[0].node] { drained = client().drain(node).status(); });
    go_on(40);
    drain.join();
    ASSERT_THAT(drained, IsOk());
    ASSERT_EQ(kill(cluster_.processes->server(place), SIGKILL), 0) << "which nobody notices";
    go_on(40);
  }
  expect_as_undisturbed();
  expect_nobody_went_back(2, 2);
  std::printf("longest time between ticks: %.0f ms while servers joined, %.0f ms while they left\n",
              absl::ToDoubleMilliseconds(joins), absl::ToDoubleMilliseconds(longest_gap_));
}

TEST_F(ServerChanges, WhileTheWorldIsPaused) {
  const Tick tick = client().pause(kPatience).value();
  start_server();
  for (const absl::Time end = absl::Now() + kPatience; client().status().value().joined_servers == 0;) {
    ASSERT_LT(absl::Now(), end);
  }
  ASSERT_THAT(client().drain(client().status().value().servers[0].node).status(), IsOk());
  ASSERT_EQ(kill(cluster_.processes->server(0), SIGKILL), 0);
  EXPECT_EQ(client().status().value().tick, tick);
  ASSERT_THAT(client().resume(1).status(), IsOk());
  go_on(40);
  expect_as_undisturbed();
  expect_nobody_went_back(1, 1);
}

}  // namespace
}  // namespace tessera
