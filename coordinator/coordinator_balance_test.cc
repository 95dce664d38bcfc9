// A coordinator that divides its world anew.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::Not;

class CoordinatorBalanceTest : public ::testing::Test {
 protected:
  void start(CoordinatorOptions options = {}, const WorldDescription& world = small_world()) {
    options.log = [this](const LogLine& line) { log_ += line.text + "\n"; };
    cluster_ = loaded_cluster(options, world);
  }
  void resume(double real_time_factor = 1) {
    v1::ResumeRequest request;
    request.set_real_time_factor(real_time_factor);
    ASSERT_TRUE(cluster_->ask<v1::ResumeReply>(request)->ok());
  }
  std::shared_ptr<Heard<v1::BalanceReply>> balance(bool dry_run = false, const std::string& policy = "") {
    v1::BalanceRequest request;
    request.set_dry_run(dry_run);
    request.set_policy(policy);
    return cluster_->ask<v1::BalanceReply>(request);
  }

  // A server carries out its grants; the first says that it has two sectors awake. Where servers wait for
  // each other, the second has a third one, until a map gives it away.
  void work(NodeId node) {
    for (const v1::Grant& grant : cluster_->work(node)) {
      if (grant.has_map()) maps_[node].push_back(grant);
      for (const v1::Question& question : grant.questions()) {
        if (!question.has_load()) continue;
        v1::ClusterMessage message;
        v1::Answer& answer = *message.mutable_answer();
        answer.set_world(grant.world());
        answer.set_question(question.id());
        answer.set_tick(cluster_->tick[node]);
        v1::ServerLoad& load = *answer.mutable_load();
        if (node == kFirst) {
          load.set_tick_us(first_us_);
          for (const std::int64_t i : {0, 1}) add_sector(i, load);
        }
        if (wait_us_ > 0 && (node == kSecond) == maps_.empty()) add_sector(100, load);
        if (node == kSecond && load.pieces_size() > 0) load.set_tick_us(first_us_);
        load.set_wait_us(wait_us_);
        cluster_->receive(node, message);
      }
    }
  }
  void work() {
    for (const NodeId node : {kFirst, kSecond}) work(node);
  }

  static void add_sector(std::int64_t i, v1::ServerLoad& load) {
    v1::LoadPiece& piece = *load.add_pieces();
    piece.mutable_first()->set_i(i);
    piece.set_work(1);
    piece.set_sectors(1);
    piece.set_bodies(3);
  }

  std::unique_ptr<TestCluster> cluster_;
  std::string log_;
  double first_us_ = 4000;
  double wait_us_ = 0;
  std::map<NodeId, std::vector<v1::Grant>> maps_;
};

TEST_F(CoordinatorBalanceTest, TheMapFollowsTheLoadOfARunningWorld) {
  start({.balance_every = seconds(5)});
  resume();
  for (int ms = 0; ms < 12'000; ms += 10) {
    cluster_->advance(milliseconds(10));
    work();
  }
  ASSERT_EQ(maps_[kFirst].size(), 1u) << "and not again where nothing would change";
  ASSERT_EQ(maps_[kSecond].size(), 1u);
  const v1::Grant& grant = maps_[kFirst].front();
  EXPECT_EQ(grant.serial(), maps_[kSecond].front().serial());
  EXPECT_EQ(grant.ticks(), 0u) << "between ticks";
  ASSERT_EQ(grant.map().splitters_size(), 1);
  EXPECT_EQ(grant.map().splitters(0).i(), 1);
  EXPECT_EQ(grant.map().epoch(), cluster_->status().map_epoch());
  EXPECT_THAT(log_, HasSubstr("change servers: the slowest part of a tick took 4.00 ms"));
}

TEST_F(CoordinatorBalanceTest, AWorldThatWaitsMoreThanItWorksGoesToOneServerAndStaysThere) {
  first_us_ = 700;
  wait_us_ = 900;
  start({.balance_every = seconds(1)});
  resume(4);  // a tick has 2.5 ms
  for (int ms = 0; ms < 30'000; ms += 10) {
    cluster_->advance(milliseconds(10));
    work();
  }
  ASSERT_EQ(maps_[kFirst].size(), 1u);
  EXPECT_THAT(
      log_,
      HasSubstr("1 sectors with 3 bodies join the others on one server: the slowest part of a tick took "
                "0.70 ms, waiting for others 0.90 ms; all of it takes at most about 1.40 ms"));
  EXPECT_THAT(log_, Not(HasSubstr("change servers")));
}

TEST_F(CoordinatorBalanceTest, NothingMovesWhereTicksAreShortOrNobodyAsked) {
  first_us_ = 100;
  start({.balance_every = seconds(1)});
  resume();
  for (int ms = 0; ms < 5000; ms += 10) {
    cluster_->advance(milliseconds(10));
    work();
  }
  EXPECT_TRUE(maps_.empty());
}

TEST_F(CoordinatorBalanceTest, ADryRunOnlySays) {
  start();
  const auto said = balance(/*dry_run=*/true);
  work();
  ASSERT_TRUE(said->ok()) << said->message();
  EXPECT_FALSE(said->answer.moves());
  EXPECT_EQ(said->answer.moved_sectors(), 1u);
  EXPECT_EQ(said->answer.moved_bodies(), 3u);
  ASSERT_EQ(said->answer.shares_size(), 2);
  EXPECT_EQ(said->answer.shares(0).node(), kFirst.value);
  EXPECT_EQ(said->answer.shares(0).tick_us(), 4000);
  EXPECT_EQ(said->answer.shares(0).tick_us_then(), 2000);
  EXPECT_EQ(said->answer.shares(1).tick_us_then(), 2000);

  EXPECT_TRUE(maps_.empty());
  const auto done = balance();
  work();
  EXPECT_TRUE(done->answer.moves());
  work();
  EXPECT_EQ(maps_[kFirst].size(), 1u) << "also while the world is paused";
}

TEST_F(CoordinatorBalanceTest, AGridStaysAsItIsUnlessAskedFor) {
  start({.balance_every = seconds(1), .balance_policy = BalancePolicy::kGrid});
  resume();
  for (int ms = 0; ms < 5000; ms += 10) {
    cluster_->advance(milliseconds(10));
    work();
  }
  EXPECT_TRUE(maps_.empty());
  const auto asked = balance(/*dry_run=*/false, "k-means");
  work();
  ASSERT_TRUE(asked->ok()) << asked->message();
  EXPECT_TRUE(asked->answer.moves());
}

TEST_F(CoordinatorBalanceTest, EveryPolicyIsAskedForByItsName) {
  start();
  for (const std::string& policy : balance_policy_names()) {
    const auto said = balance(/*dry_run=*/true, policy);
    work();
    ASSERT_TRUE(said->ok()) << said->message();
    EXPECT_EQ(said->answer.moved_sectors(), 1u) << policy;
  }
  const auto refused = balance(/*dry_run=*/true, "round-robin");
  EXPECT_EQ(refused->code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(refused->message(), HasSubstr("known are curve, k-means, hulls, graph, grid"));
}

TEST_F(CoordinatorBalanceTest, TheStatusCountsWhatHasMoved) {
  start();
  balance();
  work();
  EXPECT_EQ(cluster_->status().moved_sectors(), 1u);
  EXPECT_EQ(cluster_->status().moved_bodies(), 3u);
}

TEST_F(CoordinatorBalanceTest, ErrorsSayWhy) {
  {
    TestCluster empty;
    const auto refused = empty.ask<v1::BalanceReply>(v1::BalanceRequest());
    EXPECT_EQ(refused->code(), absl::StatusCode::kFailedPrecondition);
  }
  WorldDescription shuffled = small_world();
  shuffled.settings.shuffle = 3;
  start({.balance_every = milliseconds(10)}, shuffled);
  const auto refused = balance();
  EXPECT_EQ(refused->code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(refused->message(), HasSubstr("shuffle"));
}

TEST_F(CoordinatorBalanceTest, NumbersThatCannotBeMoveNothing) {
  first_us_ = std::numeric_limits<double>::quiet_NaN();
  start();
  const auto refused = balance();
  work();
  EXPECT_EQ(refused->code(), absl::StatusCode::kInternal);
}

}  // namespace
}  // namespace tessera
