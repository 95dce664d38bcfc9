// Which coordinator leads, whatever becomes of the others, of etcd, and of the time.
#include "coordinator/election.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "coordinator/fake_etcd.h"

namespace tessera {
namespace {

using testing::FakeEtcd;

class ElectionTest : public ::testing::Test {
 protected:
  Election candidate(const std::string& name) {
    return Election(
        etcd_, EtcdKeys("lab"),
        {.name = name, .address = name + ":7300", .holds = [this, name](const v1::StateRecord& state) {
           return std::find(state.holders().begin(), state.holders().end(), name) != state.holders().end();
         }});
  }

  void pass(std::chrono::milliseconds time, const std::vector<Election*>& awake) {
    for (std::chrono::milliseconds passed{0}; passed < time; passed += kElectionTurn) {
      etcd_.pass(kElectionTurn);
      now_ += kElectionTurn;
      for (Election* one : awake) one->advance(now_);
    }
  }

  void record_state_of(const std::string& holder) {
    v1::StateRecord state;
    state.add_holders(holder);
    etcdserverpb::TxnRequest request;
    *request.add_success() = put(EtcdKeys("lab").state, state.SerializeAsString());
    etcd_.transact(request).wait();
  }

  FakeEtcd etcd_;
  std::chrono::nanoseconds now_{};
  static constexpr std::chrono::seconds kLong{10};
};

TEST_F(ElectionTest, OneLeadsAndTheOthersKnowIt) {
  Election a = candidate("a");
  Election b = candidate("b");
  pass(kLong, {&a, &b});
  EXPECT_EQ(a.role(), Election::Role::kLeads);
  EXPECT_EQ(b.role(), Election::Role::kStandsBy);
  ASSERT_TRUE(b.leader());
  EXPECT_EQ(b.leader()->address(), "a:7300");
  EXPECT_EQ(b.leader_epoch(), a.epoch());
}

TEST_F(ElectionTest, AfterTheLeaderFallsSilentTheOtherLeadsWithALargerEpoch) {
  Election a = candidate("a");
  Election b = candidate("b");
  pass(kLong, {&a, &b});
  const std::int64_t before = a.epoch();
  pass(kLong, {&b});
  EXPECT_EQ(b.role(), Election::Role::kLeads);
  EXPECT_GT(b.epoch(), before);
  pass(kElectionTurn, {&a, &b});  // it comes back
  EXPECT_EQ(a.role(), Election::Role::kLost);
  a.stand_by();
  pass(kLong, {&a, &b});
  EXPECT_EQ(a.role(), Election::Role::kStandsBy);
  EXPECT_EQ(b.role(), Election::Role::kLeads);
}

TEST_F(ElectionTest, OnesThatHasEndedIsNotWaitedFor) {
  Election a = candidate("a");
  Election b = candidate("b");
  pass(kLong, {&a, &b});
  b.leader_has_ended();
  pass(std::chrono::milliseconds(300), {&b});
  EXPECT_EQ(b.role(), Election::Role::kLeads);
  // The process in the place of one that has ended knows it without being told.
  Election other = candidate("b");
  pass(std::chrono::milliseconds(500), {&other});
  EXPECT_EQ(other.role(), Election::Role::kLeads);
}

TEST_F(ElectionTest, ALeaderThatResignsIsFollowedAtOnceAndOneThatEndsTheClusterEndsTheOthers) {
  Election a = candidate("a");
  Election b = candidate("b");
  pass(kLong, {&a, &b});
  a.resign(/*ends_cluster=*/false);
  pass(std::chrono::milliseconds(400), {&b});
  EXPECT_EQ(b.role(), Election::Role::kLeads);
  Election c = candidate("c");
  pass(kLong, {&b, &c});
  b.resign(/*ends_cluster=*/true);
  pass(std::chrono::milliseconds(400), {&c});
  EXPECT_TRUE(c.cluster_has_ended());
  Election d = candidate("d");  // begins anew
  pass(kLong, {&d});
  EXPECT_EQ(d.role(), Election::Role::kLeads);
}

TEST_F(ElectionTest, OnlyWhoHoldsTheStateMayLead) {
  record_state_of("b");
  Election a = candidate("a");
  Election b = candidate("b");
  pass(kLong, {&a});
  EXPECT_EQ(a.role(), Election::Role::kStandsBy);
  pass(kLong, {&a, &b});
  EXPECT_EQ(b.role(), Election::Role::kLeads);
}

TEST_F(ElectionTest, AnEtcdThatIsGoneForAMomentChangesNothingAndForLongerEndsLeading) {
  Election a = candidate("a");
  pass(kLong, {&a});
  etcd_.answers = false;
  pass(std::chrono::seconds(1), {&a});
  EXPECT_EQ(a.role(), Election::Role::kLeads);
  etcd_.answers = true;
  pass(kLong, {&a});
  EXPECT_EQ(a.role(), Election::Role::kLeads);
  etcd_.answers = false;
  pass(kLong, {&a});
  EXPECT_EQ(a.role(), Election::Role::kLost);
  EXPECT_FALSE(a.trouble().ok());
  etcd_.answers = true;
  a.stand_by();
  pass(kLong, {&a});
  EXPECT_EQ(a.role(), Election::Role::kLeads);
}

TEST_F(ElectionTest, AnAnswerThatIsLostLeavesALeader) {
  Election a = candidate("a");
  etcd_.faults = {FakeEtcd::Fault::kNone, FakeEtcd::Fault::kUnanswered};  // a look, a campaign
  pass(std::chrono::seconds(2), {&a});
  EXPECT_EQ(a.role(), Election::Role::kLeads);
  EXPECT_NE(a.epoch(), 0);
}

// At most one of those whose lease etcd has not ended leads, and sooner or later one does.
TEST_F(ElectionTest, WithAnyPausesAndFaultsAtMostOneHasTheKey) {
  const auto seed = std::random_device()();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::vector<std::unique_ptr<Election>> all;
  for (const char* name : {"a", "b", "c"}) all.push_back(std::make_unique<Election>(candidate(name)));
  std::int64_t epoch = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<Election*> awake;
    for (const auto& one : all) {
      if (random() % 4 != 0) awake.push_back(one.get());
    }
    etcd_.answers = random() % 8 != 0;
    for (int n = 0; n < 6; ++n) etcd_.faults.push_back(static_cast<FakeEtcd::Fault>(random() % 4));
    pass(std::chrono::milliseconds(200 + random() % 4000), awake);
    etcd_.faults.clear();
    for (const auto& one : all) {
      if (one->role() == Election::Role::kLost) one->stand_by();
      if (one->role() != Election::Role::kLeads) continue;
      etcdserverpb::TxnRequest mine;
      *mine.add_compare() = created_at(EtcdKeys("lab").leader, one->epoch());
      etcd_.answers = true;
      if (!etcd_.transact(mine).get()->succeeded()) continue;
      EXPECT_GE(one->epoch(), epoch);
      epoch = one->epoch();
    }
  }
  etcd_.answers = true;
  std::vector<Election*> everybody;
  for (const auto& one : all) everybody.push_back(one.get());
  for (int n = 0; n < 3; ++n) {
    pass(kLong, everybody);
    for (Election* one : everybody) {
      if (one->role() == Election::Role::kLost) one->stand_by();
    }
  }
  EXPECT_EQ(std::count_if(everybody.begin(), everybody.end(),
                          [](Election* one) { return one->role() == Election::Role::kLeads; }),
            1);
}

}  // namespace
}  // namespace tessera
