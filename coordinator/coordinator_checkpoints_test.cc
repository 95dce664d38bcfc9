// How often a coordinator takes down the state of its world.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class CoordinatorCheckpointsTest : public ::testing::Test {
 protected:
  CoordinatorCheckpointsTest() : cluster_(loaded_cluster({.checkpoint_every = seconds(1)}, small_world())) {
    v1::ResumeRequest request;
    request.set_real_time_factor(1);
    EXPECT_TRUE(cluster_->ask<v1::ResumeReply>(request)->ok());
  }

  // The number of checkpoints that servers were asked for, and sent, in `span`.
  int checkpoints_in(seconds span) {
    int asked = 0;
    for (milliseconds time{0}; time < span; time += milliseconds(10)) {
      cluster_->advance(milliseconds(10));
      for (const NodeId node : {kFirst, kSecond}) {
        for (const v1::Grant& grant : cluster_->take_grants(node)) asked += carry_out(node, grant);
      }
    }
    return asked / 2;
  }

  int anew_ = 0;  // requests for all that a server has
  std::unique_ptr<TestCluster> cluster_;

 private:
  int carry_out(NodeId node, const v1::Grant& grant) {
    std::vector<v1::TickReport> reports(grant.ticks());
    for (v1::TickReport& report : reports) {
      report.set_tick(++cluster_->tick[node]);
      write(TickCounts{}, *report.mutable_counts());
    }
    if (grant.ticks() > 0) cluster_->report(node, grant.world(), cluster_->tick[node], std::move(reports));
    int asked = 0;
    for (const v1::Question& question : grant.questions()) {
      if (!question.has_snapshot()) continue;
      ++asked;
      anew_ += question.snapshot().anew() ? 1 : 0;
      EXPECT_TRUE(question.snapshot().keeps());
      v1::ClusterMessage message;
      message.mutable_answer()->set_world(grant.world());
      message.mutable_answer()->set_question(question.id());
      message.mutable_answer()->set_tick(cluster_->tick[node]);
      message.mutable_answer()->set_parts(1);
      cluster_->receive(node, message);
    }
    return asked;
  }
};

TEST_F(CoordinatorCheckpointsTest, OnceASecond) { EXPECT_NEAR(checkpoints_in(seconds(20)), 20, 1); }

TEST_F(CoordinatorCheckpointsTest, OnlyTheFirstIsOfEverything) {
  checkpoints_in(seconds(3));
  EXPECT_EQ(anew_, 2) << "one for each server";
}

// Other servers know nothing of what those before had sent.
TEST_F(CoordinatorCheckpointsTest, TheFirstAfterALossIsOfEverythingAgain) {
  checkpoints_in(seconds(3));
  cluster_->leave(kSecond);
  const auto loads = cluster_->take(kFirst, v1::ClusterMessage::kLoadWorld);
  ASSERT_EQ(loads.size(), 1u);
  cluster_->tick[kFirst] = loads[0].load_world().restored().tick();
  cluster_->loaded(kFirst, loads[0].load_world().world());
  anew_ = 0;
  checkpoints_in(seconds(3));
  EXPECT_EQ(anew_, 1);
}

class CoordinatorServersTest : public CoordinatorCheckpointsTest {
 protected:
  static constexpr NodeId kThird{300};

  std::vector<v1::ClusterMessage> loads_of(NodeId node) {
    return cluster_->take(node, v1::ClusterMessage::kLoadWorld);
  }
};

TEST_F(CoordinatorServersTest, OneThatJoinsGetsReadyBesideTheWorld) {
  checkpoints_in(seconds(3));
  cluster_->join(kThird);
  const auto loads = loads_of(kThird);
  ASSERT_EQ(loads.size(), 1u);
  const v1::LoadWorld& load = loads[0].load_world();
  ASSERT_TRUE(load.has_guest());
  EXPECT_EQ(load.nodes_size(), 2);
  EXPECT_GT(load.restored().tick(), 0u);
  EXPECT_TRUE(load.restored().sectors().empty());
  checkpoints_in(seconds(1));
  for (const v1::Grant& grant : cluster_->take_grants(kThird)) EXPECT_FALSE(grant.has_map());
  cluster_->loaded(kThird, load.world());
  const std::vector<v1::Grant> grants = cluster_->take_grants(kThird);
  const auto map =
      std::find_if(grants.begin(), grants.end(), [](const auto& grant) { return grant.has_map(); });
  ASSERT_NE(map, grants.end());
  EXPECT_EQ(map->map().nodes_size(), 3);
  EXPECT_EQ(map->map().newcomers(), 1u);
  EXPECT_EQ(cluster_->status().joined_servers(), 1u);
  EXPECT_TRUE(loads_of(kFirst).empty()) << "nobody goes back";
  // From now on, the world needs it.
  cluster_->leave(kThird);
  EXPECT_EQ(loads_of(kFirst).size(), 1u);
}

TEST_F(CoordinatorServersTest, OneThatIsLostBeforeItTakesPartIsNoLoss) {
  cluster_->join(kThird);
  EXPECT_EQ(loads_of(kThird).size(), 1u);
  cluster_->leave(kThird);
  EXPECT_TRUE(loads_of(kFirst).empty());
  EXPECT_GT(checkpoints_in(seconds(3)), 0);
}

TEST_F(CoordinatorServersTest, OneThatCannotGetReadyIsLeftAlone) {
  cluster_->join(kThird);
  cluster_->loaded(kThird, loads_of(kThird).at(0).load_world().world(), "it has no room");
  EXPECT_GT(checkpoints_in(seconds(3)), 0);
  EXPECT_TRUE(loads_of(kThird).empty());
  EXPECT_EQ(cluster_->status().state(), "running");
}

// What it said when it was ready then may come only now.
TEST_F(CoordinatorServersTest, OneThatWasGivenUpWhileItGotReadyIsNotAskedAgain) {
  cluster_->join(kThird);
  const std::uint64_t world = loads_of(kThird).at(0).load_world().world();
  cluster_->leave(kThird);
  v1::ClusterMessage hello;
  *hello.mutable_hello() = TestCluster::hello();
  hello.mutable_hello()->set_newest_world(world);
  cluster_->receive(kThird, hello);
  cluster_->loaded(kThird, world);
  EXPECT_TRUE(loads_of(kThird).empty());
  EXPECT_EQ(cluster_->status().joined_servers(), 0u);
  cluster_->leave(kSecond);
  EXPECT_EQ(loads_of(kThird).size(), 1u) << "but it has its part where all go back";
}

}  // namespace
}  // namespace tessera
