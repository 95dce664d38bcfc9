// Two coordinators and an etcd: when the one that leads is killed or stands still, the other goes on with the
// same bits, and clients miss nothing.
#include <absl/time/clock.h>
#include <signal.h>

#include <cstdio>
#include <future>

#include "coordinator/grpc_etcd.h"
#include "keys/keys_folder.h"
#include "keys/test_keys.h"
#include "tests/standby_cluster.h"

namespace tessera {
namespace {

using namespace tessera::testing;

class Standby : public StandbyCluster {
 protected:
  void SetUp() override { start_all(); }
};

TEST_F(Standby, TakesOverFromALeaderThatIsKilled) {
  for (int round = 0; round < 3; ++round) {
    go_on(60);
    const std::size_t place = leader();
    longest_gap_ = absl::ZeroDuration();
    coordinators_[place]->signal(SIGKILL);
    go_on(60);
    ASSERT_NE(leader(), place);
    std::printf("%.2f s without ticks\n", absl::ToDoubleSeconds(longest_gap_));
    start_coordinator(place);
    go_on(60);
  }
  expect_as_undisturbed();
}

TEST_F(Standby, TakesOverFromALeaderThatStandsStillWhichThenDoesNoHarm) {
  go_on(60);
  const std::size_t place = leader();
  const std::size_t before = said(place);
  longest_gap_ = absl::ZeroDuration();
  coordinators_[place]->signal(SIGSTOP);
  go_on(120);
  ASSERT_NE(leader(), place);
  std::printf("%.2f s without ticks\n", absl::ToDoubleSeconds(longest_gap_));
  coordinators_[place]->signal(SIGCONT);
  await(place, "stands by for the one at", before);
  go_on(60);
  // It may lead again.
  coordinators_[1 - place]->signal(SIGKILL);
  go_on(60);
  ASSERT_EQ(leader(), place);
  expect_as_undisturbed();
}

// With a lease that no busy machine needs all of to start etcd again.
class PatientStandby : public StandbyCluster {
 protected:
  void SetUp() override {
    lease_seconds_ = 60;
    start_all();
  }
};

TEST_F(PatientStandby, AnEtcdThatIsKilledAndStartedAgainDelaysOnly) {
  go_on(60);
  const std::size_t place = leader();
  etcd_->signal(SIGKILL);
  cli::wait_readable({etcd_->descriptor()}, kPatience);
  start_etcd();
  go_on(120);
  EXPECT_EQ(leader(), place);
  expect_as_undisturbed();
}

// Etcd stands still until the leader has lost its lease, with a push that it could not store. Either of the
// two coordinators leads then, and takes the push, unless etcd has stored it by then.
TEST_F(Standby, APushThatALeaderCouldNotStoreIsTakenOnceByWhoeverLeadsThen) {
  go_on(60);
  const std::size_t place = leader();
  const std::size_t before = said(place);
  etcd_->signal(SIGSTOP);
  const Push push{0, dynamic_[0], {0.3, 0, 0.5}};
  std::future<absl::StatusOr<Tick>> given = std::async(std::launch::async, [&] {
    return client_->apply_impulse(push.body, push.impulse, Eigen::Vector3d::Zero(), kPatience);
  });
  await(place, "does not lead any more", before);
  etcd_->signal(SIGCONT);
  const absl::StatusOr<Tick> tick = given.get();
  ASSERT_THAT(tick.status(), IsOk());
  pushes_.push_back(push);
  pushes_.back().tick = *tick;
  go_on(60);
  expect_as_undisturbed();
}

TEST_F(Standby, ALeaderAndAServerAtOnce) {
  go_on(60);
  const std::size_t place = leader();
  servers_[1]->signal(SIGKILL);
  coordinators_[place]->signal(SIGKILL);
  start_server(1);
  start_coordinator(place);
  read_until(told_);
  const absl::Time end = absl::Now() + kPatience;
  absl::StatusOr<Tick> tick = client_->pause(kPatience);
  while (absl::IsUnavailable(tick.status()) && absl::Now() < end) tick = client_->pause(kPatience);
  ASSERT_THAT(tick.status(), IsOk());
  const absl::StatusOr<HashAt> hash = client_->hash(kPatience);
  ASSERT_THAT(hash.status(), IsOk());
  EXPECT_EQ(hash->hash, Undisturbed(world_, pushes_, *tick).hash);
}

TEST_F(Standby, EndsWithTheClusterAndNotWithALeaderThatIsAskedToEnd) {
  go_on(60);
  const std::size_t place = leader();
  coordinators_[place]->signal(SIGTERM);
  // A push that it takes while it leaves may have an effect, though nobody is told.
  cli::wait_readable({coordinators_[place]->descriptor()}, kPatience);
  go_on(60);
  ASSERT_NE(leader(), place);
  EXPECT_EQ(coordinators_[place]->ended(), 0);
  start_coordinator(place);
  await(place, "stands by for the one at", 0);
  expect_as_undisturbed();
  bodies_.reset();
  contacts_.reset();
  ASSERT_THAT(client_->shutdown(), IsOk());
  for (auto& coordinator : coordinators_) {
    cli::wait_readable({coordinator->descriptor()}, kPatience);
    EXPECT_EQ(coordinator->ended(), 0);
  }
}

// A standby shows the keys of a daemon, and so gets the states without which it could not lead.
class StandbyWithKeys : public StandbyCluster {
 protected:
  void SetUp() override { start_all(nullptr, keys_.folder()); }

  const TestKeys keys_;
};

TEST_F(StandbyWithKeys, TakesOverFromALeaderThatIsKilled) {
  go_on(60);
  const std::size_t place = leader();
  coordinators_[place]->signal(SIGKILL);
  go_on(60);
  ASSERT_NE(leader(), place);
  expect_as_undisturbed();
}

// A client of the cluster, of whatever role, is not let into its etcd.
TEST_F(StandbyWithKeys, EtcdAcceptsDaemonsOnly) {
  go_on(10);
  const auto read_as = [&](const std::string& holder) {
    CoordinatorArguments arguments;
    arguments.etcd = {etcd_url_};
    const absl::StatusOr<ServerKeys> daemon = read_server_keys(keys_.folder(), kDaemonFolder);
    const std::filesystem::path own = keys_.folder() / holder;
    arguments.etcd_files = {.authority = (own / kAuthorityFile).string(),
                            .certificate = (own / kCertificateFile).string(),
                            .key = (own / kKeyFile).string()};
    const std::unique_ptr<Etcd> etcd = connect_etcd(etcd_access(arguments, *daemon).value(), [] {});
    etcdserverpb::TxnRequest request;
    *request.add_success() = read("leader");
    return etcd->transact(request).get().status();
  };
  EXPECT_THAT(read_as(kDaemonFolder), IsOk());
  EXPECT_FALSE(read_as(kAdminFolder).ok());
}

}  // namespace
}  // namespace tessera
