// What a coordinator does where its servers do not hear each other, or it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Kind = v1::ClusterMessage::KindCase;

class CoordinatorCutsTest : public ::testing::Test {
 protected:
  explicit CoordinatorCutsTest(Nanoseconds checkpoint_every = seconds(1)) {
    CoordinatorOptions options;
    options.checkpoint_every = checkpoint_every;
    options.log = [this](const LogLine& line) { log_.push_back(line.text); };
    cluster_ = loaded_cluster(options);
    step_ = cluster_->step(10);
    for (const NodeId node : {kFirst, kSecond}) cluster_->take_grants(node);  // nobody carries them out
  }

  // `node` has waited for `other` for so long.
  void miss(NodeId node, NodeId other, milliseconds waited) {
    v1::ClusterMessage message;
    v1::Report& report = *message.mutable_report();
    report.set_world(world_);
    report.set_map_epoch(1);
    v1::Unheard& unheard = *report.add_unheard();
    unheard.set_node(other.value);
    unheard.set_waited_ms(static_cast<std::uint64_t>(waited.count()));
    unheard.set_silent(true);
    cluster_->receive(node, message);
  }

  void say(NodeId node, bool is_deaf) {
    v1::ClusterMessage message;
    message.mutable_report()->set_world(world_);
    message.mutable_report()->set_map_epoch(1);
    message.mutable_report()->set_deaf(is_deaf);
    cluster_->receive(node, message);
  }

  // Neither hears the other, for so long.
  void miss_each_other(milliseconds waited) {
    for (milliseconds time{250}; time <= waited; time += milliseconds(250)) {
      miss(kFirst, kSecond, time);
      miss(kSecond, kFirst, time);
      cluster_->advance(milliseconds(250));
    }
  }

  std::uint64_t world_ = 1;
  std::vector<std::string> log_;
  std::unique_ptr<TestCluster> cluster_;
  HeardReply step_;
};

TEST_F(CoordinatorCutsTest, TheWorldGoesOnWithoutOneOfTwoThatMissEachOther) {
  miss_each_other(milliseconds(750));
  EXPECT_EQ(cluster_->status().servers_size(), 2);
  EXPECT_TRUE(cluster_->status().servers(0).suspect()) << "either may be cut off";
  EXPECT_TRUE(cluster_->status().servers(1).suspect());
  miss_each_other(milliseconds(1000));
  const v1::StatusReply status = cluster_->status();
  ASSERT_EQ(status.servers_size(), 1);
  EXPECT_EQ(status.servers(0).node(), kFirst.value);
  ASSERT_EQ(status.cut_off_size(), 1);
  EXPECT_EQ(status.cut_off(0).node(), kSecond.value);
  EXPECT_EQ(status.cut_off(0).stream_address(), "127.0.0.1:1");
  EXPECT_THAT(status.cut_off(0).unheard_by(), ElementsAre(kFirst.value));
  EXPECT_EQ(status.cut_off(0).seconds(), 1);
  EXPECT_EQ(status.cut_off_servers(), 1u);
  EXPECT_THAT(log_,
              Contains(HasSubstr("server c8 (127.0.0.1:1) is given up: for 1.00 s it has not been heard by, "
                                 "or has not heard, server 64 (127.0.0.1:1)")));

  const auto refusals = cluster_->take(kSecond, Kind::kRefusal);
  ASSERT_EQ(refusals.size(), 1u);
  EXPECT_TRUE(refusals[0].refusal().may_rejoin());
  cluster_->finish_loads();
  cluster_->inbox.erase(kSecond);
  cluster_->work_all();
  EXPECT_TRUE(step_->ok()) << step_->message();
  EXPECT_EQ(cluster_->status().recoveries(), 1u);
}

TEST_F(CoordinatorCutsTest, OneThatIsCutOffIsAGuestUntilAllAnswerIt) {
  miss_each_other(milliseconds(1000));
  cluster_->finish_loads();
  cluster_->join(kSecond);
  cluster_->work_all();
  const auto loads = cluster_->take(kSecond, Kind::kLoadWorld);
  ASSERT_EQ(loads.size(), 1u);
  EXPECT_TRUE(loads[0].load_world().has_guest());
  world_ = loads[0].load_world().world();
  miss(kSecond, kFirst, milliseconds(1000));
  EXPECT_THAT(log_,
              Contains(HasSubstr("server c8 (127.0.0.1:1) cannot take part in the world yet: server 64")));
  cluster_->advance(seconds(1));
  EXPECT_EQ(cluster_->status().servers_size(), 2) << "nobody waits for a guest";
  EXPECT_EQ(cluster_->status().cut_off_servers(), 1u);
}

TEST_F(CoordinatorCutsTest, OneThatIsWaitedForAndSaysNothingHasTheTimeOfATick) {
  for (milliseconds time{250}; time < seconds(9); time += milliseconds(250)) {
    miss(kFirst, kSecond, time);
    cluster_->advance(milliseconds(250));
  }
  EXPECT_EQ(cluster_->status().servers_size(), 2);
  cluster_->advance(milliseconds(1250));
  EXPECT_EQ(cluster_->status().servers_size(), 1);
  EXPECT_THAT(cluster_->status().cut_off(), IsEmpty());
  EXPECT_THAT(log_, Contains(HasSubstr("was silent for")));
}

TEST_F(CoordinatorCutsTest, WhatIsSaidOfAnotherWorldDoesNotCount) {
  world_ = 7;
  miss_each_other(milliseconds(3000));
  EXPECT_EQ(cluster_->status().servers_size(), 2);
}

TEST_F(CoordinatorCutsTest, OneThatDoesNotHearTheCoordinatorIsGivenUp) {
  say(kSecond, /*is_deaf=*/true);
  EXPECT_TRUE(cluster_->status().servers(1).suspect());
  cluster_->advance(milliseconds(900));
  say(kSecond, /*is_deaf=*/true);
  cluster_->advance(milliseconds(100));
  EXPECT_EQ(cluster_->status().servers_size(), 2) << "it may stand still since";
  say(kSecond, /*is_deaf=*/true);
  const v1::StatusReply status = cluster_->status();
  ASSERT_EQ(status.servers_size(), 1);
  EXPECT_EQ(status.servers(0).node(), kFirst.value);
  EXPECT_THAT(log_, Contains(HasSubstr("server c8 (127.0.0.1:1) did not hear the coordinator for 1 s")));
}

TEST_F(CoordinatorCutsTest, NothingHappensWhereItHearsItAgain) {
  say(kSecond, /*is_deaf=*/true);
  cluster_->advance(milliseconds(900));
  say(kSecond, /*is_deaf=*/false);
  cluster_->advance(seconds(1));
  EXPECT_EQ(cluster_->status().servers_size(), 2);
  EXPECT_FALSE(cluster_->status().servers(1).suspect());
}

class CutsWithoutCheckpoints : public CoordinatorCutsTest {
 protected:
  CutsWithoutCheckpoints() : CoordinatorCutsTest(Nanoseconds::zero()) {}
};

TEST_F(CutsWithoutCheckpoints, AWorldThatCannotGoOnWaitsForAMinute) {
  miss_each_other(milliseconds(59'750));
  EXPECT_EQ(cluster_->status().state(), "running");
  miss(kFirst, kSecond, seconds(60));
  cluster_->advance(milliseconds(250));
  EXPECT_EQ(cluster_->status().state(), "failed");
  EXPECT_THAT(cluster_->status().failure(), HasSubstr("has not been heard by"));
}

}  // namespace
}  // namespace tessera
