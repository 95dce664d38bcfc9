// The section "Upgrade" of docs/operations.md, carried out on real processes under load. One build plays both
// versions; what a next version reads of the present one is in proto/since_test.cc.
#include <signal.h>

#include <utility>

#include "tests/cluster_fixture.h"
#include "tests/watched_run.h"

namespace tessera {
namespace {

using namespace tessera::testing;

class Upgrade : public WatchedRun {
 protected:
  // The busy world on three servers with a store, watched, running as fast as real time.
  void SetUp() override {
    cli::LocalClusterOptions options;
    options.checkpoint_every = absl::Milliseconds(200);
    options.store = true;
    options.servers_to_start = 0;
    cluster_ = start_cluster(kServers, options);
    ASSERT_TRUE(cluster_.client);
    for (std::size_t place = 0; place < kServers; ++place) {
      ASSERT_THAT(processes().start_server(), IsOk());
      await_node();
    }
    begin(client());
  }

  Client& client() { return *cluster_.client; }
  cli::LocalCluster& processes() { return *cluster_.processes; }

  // As systemctl stop.
  void end(pid_t process) {
    const Processes ending({process});
    ASSERT_EQ(kill(process, SIGTERM), 0);
    ASSERT_TRUE(ending.await_end());
  }

  // Waits for a server that was started; it is the last in the status.
  void await_node() {
    ASSERT_TRUE(await_joined(cluster_, ++joined_));
    const absl::StatusOr<ClusterStatus> status = client().status(kPatience);
    ASSERT_THAT(status.status(), IsOk());
    nodes_.push_back(status->servers.back().node);
  }

  static constexpr std::size_t kServers = 3;
  Cluster cluster_;
  std::vector<std::uint64_t> nodes_;  // in the order in which they were started
  int joined_ = 0;
};

// Each server after `tessera drain`, then the coordinator: no tick is lost or repeated to clients.
TEST_F(Upgrade, OneProcessAfterTheOther) {
  go_on(30);
  for (std::size_t place = 0; place < kServers; ++place) {
    ASSERT_THAT(client().drain(nodes_[place], kPatience).status(), IsOk());
    end(processes().server(place));
    ASSERT_THAT(processes().replace_server(place), IsOk());
    await_node();
    go_on(30);
    if (HasFatalFailure()) return;
  }
  EXPECT_EQ(client().status(kPatience).value().recoveries, 0u) << "which drained servers make needless";
  end(processes().coordinator());
  ASSERT_THAT(processes().replace_coordinator(), IsOk());
  go_on(60);
  expect_as_undisturbed();
}

// As `systemctl restart tessera-coordinator 'tessera-sector-server@*'`: clients wait meanwhile.
TEST_F(Upgrade, AllProcessesAtOnce) {
  go_on(30);
  end(processes().coordinator());
  for (std::size_t place = 0; place < kServers; ++place) end(processes().server(place));
  ASSERT_THAT(processes().replace_coordinator(), IsOk());
  for (std::size_t place = 0; place < kServers; ++place)
    ASSERT_THAT(processes().replace_server(place), IsOk());
  may_miss_ticks_ = true;
  watches_contacts_ = false;
  go_on(60);
  expect_as_undisturbed();
}

// Without a store: a snapshot between two ticks goes to the new processes.
TEST_F(Upgrade, BySnapshot) {
  go_on(30);
  const Tick tick = client().pause(kPatience).value();
  const std::filesystem::path folder = cli::make_temporary_folder().value();
  ASSERT_THAT(client().snapshot(folder / "world.snapshot", kPatience).status(), IsOk());
  bodies_.reset();
  contacts_.reset();
  ASSERT_THAT(client().shutdown(kPatience), IsOk());
  cluster_ = start_cluster(2);
  ASSERT_TRUE(cluster_.client);
  ASSERT_THAT(client().restore(folder / "world.snapshot", /*replace=*/false, kPatience).status(), IsOk());
  ASSERT_THAT(client().step(30, kPatience).status(), IsOk());
  const absl::StatusOr<HashAt> hash = client().hash(kPatience);
  ASSERT_THAT(hash.status(), IsOk());
  EXPECT_EQ(hash->hash, Undisturbed(world_, pushes_, tick + 30).hash);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace tessera
