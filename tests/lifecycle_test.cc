// Clusters as processes: how they start, what they refuse, and that they leave nothing behind.
#include <signal.h>

#include <algorithm>
#include <optional>

#include "tests/cluster_fixture.h"

namespace tessera {
namespace {

using namespace tessera::testing;

TEST(LifecycleTest, ShutdownLeavesNoProcessAndNoSharedMemory) {
  const std::set<std::string> memory_before = shared_memory();
  Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(read_world("seam.sdf")).status(), IsOk());
  ASSERT_THAT(cluster.client->step(30, kPatience).status(), IsOk());
  const std::vector<pid_t> processes = cluster.processes->processes();
  EXPECT_EQ(processes.size(), 3u);
  ASSERT_THAT(cluster.client->shutdown(), IsOk());
  EXPECT_THAT(cluster.processes->wait_until_ended(kPatience), IsOk());
  for (const pid_t process : processes) EXPECT_FALSE(runs(process)) << process;
  EXPECT_EQ(shared_memory(), memory_before);
  EXPECT_EQ(cluster.client->status().status().code(), absl::StatusCode::kUnavailable);
}

TEST(LifecycleTest, PortInUseIsNamed) {
  const Cluster first = start_cluster(1);
  ASSERT_TRUE(first.client);
  cli::LocalClusterOptions options;
  options.servers = 1;
  options.listen = first.processes->address();
  options.start_timeout = kPatience;
  const absl::Status status = cli::LocalCluster::start(options).status();
  EXPECT_THAT(status, IsStatus(absl::StatusCode::kUnavailable, first.processes->address()));
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("in use"));
  EXPECT_THAT(first.client->status().status(), IsOk());
}

TEST(LifecycleTest, SecondCoordinatorIsRefused) {
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  std::vector<std::string> arguments = cluster.processes->identity();
  for (const char* more : {"--listen", "127.0.0.1:0", "--exit-with-parent"}) arguments.emplace_back(more);
  Process second("tessera-coordinator", arguments);
  EXPECT_EQ(second.wait(), 1);
  EXPECT_THAT(second.output(), ::testing::HasSubstr(cluster.processes->address()));
  EXPECT_THAT(cluster.client->load(read_world("falling.sdf")).status(), IsOk());
}

TEST(LifecycleTest, ServerThatNeverComesIsMissed) {
  cli::LocalClusterOptions options;
  options.servers_to_start = 1;
  options.join_timeout = absl::Seconds(1);
  const Cluster cluster = start_cluster(2, options);
  ASSERT_TRUE(cluster.client);
  EXPECT_THAT(cluster.client->load(read_world("falling.sdf"), false, kPatience).status(),
              IsStatus(absl::StatusCode::kFailedPrecondition,
                       "needs 2 servers of precision f32, but there are 1 after waiting for 1 s"));
  EXPECT_EQ(cluster.client->status().value().state, "empty");

  // The server may still join.
  ASSERT_THAT(cluster.processes->start_server(), IsOk());
  ASSERT_TRUE(await_joined(cluster, 2));
  const absl::StatusOr<LoadSummary> summary =
      cluster.client->load(read_world("falling.sdf"), false, kPatience);
  ASSERT_THAT(summary.status(), IsOk());
  EXPECT_EQ(summary->servers, 2u);
}

TEST(LifecycleTest, LoadThatTakesTooLongEndsAtItsDeadline) {
  cli::LocalClusterOptions options;
  options.servers_to_start = 1;
  const Cluster cluster = start_cluster(2, options);
  ASSERT_TRUE(cluster.client);
  EXPECT_THAT(cluster.client->load(read_world("falling.sdf"), false, absl::Milliseconds(300)).status(),
              IsStatus(absl::StatusCode::kDeadlineExceeded, "no answer within 300ms"));
}

TEST(LifecycleTest, NoCoordinatorIsAnErrorThatNamesTheAddress) {
  EXPECT_THAT(Client::connect("127.0.0.1:1", absl::Milliseconds(500)).status(),
              IsStatus(absl::StatusCode::kUnavailable, "127.0.0.1:1"));
}

TEST(LifecycleTest, LoadedWorldIsNotReplacedByAccident) {
  const Cluster cluster = start_cluster(1);
  ASSERT_TRUE(cluster.client);
  ASSERT_THAT(cluster.client->load(read_world("falling.sdf")).status(), IsOk());
  EXPECT_EQ(cluster.client->load(read_world("seam.sdf")).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(cluster.client->status().value().world, "falling");
  ASSERT_THAT(cluster.client->unload(), IsOk());
  EXPECT_EQ(cluster.client->status().value().state, "empty");
  EXPECT_EQ(cluster.client->step().status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST(LifecycleTest, ServerThatStallsForAWhileIsTakenBack) {
  const Cluster cluster = start_cluster(2);
  ASSERT_TRUE(cluster.client);
  Client& client = *cluster.client;
  const WorldDescription world = read_world("seam.sdf");
  ASSERT_THAT(client.load(world).status(), IsOk());
  ASSERT_THAT(client.step(10, kPatience).status(), IsOk());
  const auto suspects = [&] {
    const ClusterStatus status = client.status(kPatience).value();
    return std::count_if(status.servers.begin(), status.servers.end(),
                         [](const ServerStatus& server) { return server.suspect; });
  };
  ASSERT_EQ(kill(cluster.processes->server(1), SIGSTOP), 0);
  ASSERT_TRUE(await_log(cluster, "is not responding"));
  EXPECT_EQ(suspects(), 1);
  ASSERT_EQ(kill(cluster.processes->server(1), SIGCONT), 0);
  EXPECT_EQ(client.step(20, kPatience).value(), 30u);
  EXPECT_EQ(suspects(), 0);
  EXPECT_EQ(client.hash(kPatience).value().hash, hash_in_process(world, 30));
}

// `tessera up` and its daemons, as users run them.
class UpTest : public ::testing::Test {
 protected:
  void start() {
    ASSERT_TRUE(up_.await_output("a cluster is up")) << up_.output();
    daemons_.emplace(children_of(up_.process().pid()));
    EXPECT_EQ(daemons_->ids().size(), 4u) << "a coordinator, two servers, the web UI";
  }

  Process up_{"tessera", {"up", "--listen", "127.0.0.1:0", "--servers", "2", "--threads", "1"}};
  std::optional<Processes> daemons_;
};

TEST_F(UpTest, InterruptEndsAllInOrder) {
  start();
  up_.process().signal(SIGINT);
  EXPECT_EQ(up_.wait(), kSignalled + SIGINT) << up_.output();
  EXPECT_TRUE(daemons_->await_end());
}

TEST_F(UpTest, DaemonsEndWithTheirParentWhateverEndsIt) {
  start();
  up_.process().signal(SIGKILL);
  EXPECT_EQ(up_.wait(), -SIGKILL);
  EXPECT_TRUE(daemons_->await_end());
}

TEST_F(UpTest, ALostServerIsReplaced) {
  start();
  kill(daemons_->ids()[2], SIGKILL);  // a server: they start after the coordinator and before the web UI
  EXPECT_TRUE(up_.await_output("a sector server is replaced")) << up_.output();
  EXPECT_THAT(up_.output(), ::testing::HasSubstr("signal 9"));
  up_.process().signal(SIGINT);
  EXPECT_EQ(up_.wait(), kSignalled + SIGINT) << up_.output();
}

TEST(UpWithoutReplacement, LostDaemonEndsAllWithAnError) {
  Process up("tessera", {"up", "--listen", "127.0.0.1:0", "--no-page", "--no-replacement"});
  ASSERT_TRUE(up.await_output("a cluster is up")) << up.output();
  const Processes daemons(children_of(up.process().pid()));
  kill(daemons.ids()[2], SIGKILL);
  EXPECT_EQ(up.wait(), 1);
  EXPECT_THAT(up.output(), ::testing::HasSubstr("signal 9"));
  EXPECT_TRUE(daemons.await_end());
}

}  // namespace
}  // namespace tessera
