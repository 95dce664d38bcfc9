// Commands that end the servers that carry them out.
#include "coordinator/fatal_tick.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "coordinator/folder_store.h"
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "coordinator/test_store.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

TEST(FatalTickTest, IsTheOneThatThreeEndsHaveInCommon) {
  FatalTick fatal;
  fatal.on_end(TicksUnderWay{5, 9});
  fatal.on_end(TicksUnderWay{7, 7});
  EXPECT_EQ(fatal.found(), std::nullopt) << "it may be by chance";
  fatal.on_end(std::nullopt);
  fatal.on_end(TicksUnderWay{7, 7});
  EXPECT_EQ(fatal.found(), 7u);
}

TEST(FatalTickTest, EndsOfDifferentTicksAreChance) {
  FatalTick fatal;
  for (const Tick tick : {3, 4, 4, 5, 5}) fatal.on_end(TicksUnderWay{tick, tick});
  EXPECT_EQ(fatal.found(), std::nullopt);
  fatal = {};
  for (int n = 0; n < 5; ++n) fatal.on_end(TicksUnderWay{3, 4});
  EXPECT_EQ(fatal.found(), std::nullopt) << "it may be either";
}

// Servers that end where they are to spawn anything.
class PoisonTest : public ::testing::Test {
 protected:
  PoisonTest() {
    CoordinatorOptions options;
    options.checkpoint_every = std::chrono::hours(1);
    store_ = open_folder_store("store", disk_).value();
    options.store = store_.get();
    options.log = [this](const LogLine& line) { log_ += line.text + "\n"; };
    options.inputs = [this](const v1::RecordedInput& input) {
      if (input.has_world() || input.has_snapshot()) recorded_.clear();
      if (input.has_commands()) recorded_.push_back(input.commands());
    };
    cluster_ = loaded_cluster(options);
  }

  // Works until there is nothing to do; false where the server ends.
  bool work(NodeId node) {
    for (;;) {
      const std::vector<v1::Grant> grants = cluster_->take_grants(node);
      if (grants.empty()) return true;
      for (const v1::Grant& grant : grants) {
        if (grant.new_shapes_size() > 0) {
          cluster_->coordinator->ended(node, cluster_->now);
          cluster_->inbox.erase(node);
          cluster_->collect();
          return false;
        }
        cluster_->tick[node] += grant.ticks();
        if (grant.ticks() > 0) cluster_->report(node, grant.world(), cluster_->tick[node]);
      }
    }
  }

  void join(NodeId node) {
    cluster_->join(node);
    cluster_->advance(kGatherServers);
    cluster_->finish_loads();
  }

  // One after the other, at the same tick.
  void end_three() {
    EXPECT_FALSE(work(kFirst));
    cluster_->take_grants(kSecond);  // it loads the world anew instead
    cluster_->finish_loads();
    EXPECT_FALSE(work(kSecond));
    join(NodeId{300});
    EXPECT_FALSE(work(NodeId{300}));
  }

  MemoryDisk disk_;
  std::unique_ptr<WorldStore> store_;
  std::string log_;
  std::vector<v1::RecordedCommands> recorded_;
  std::unique_ptr<TestCluster> cluster_;
};

TEST_F(PoisonTest, IsLeftOutAndTold) {
  ASSERT_TRUE(cluster_->step(1)->status == std::nullopt);
  cluster_->work_all();
  EXPECT_TRUE(cluster_->apply(push("ball"))->ok());
  const auto stepped = cluster_->step(3);
  cluster_->work_all();
  EXPECT_TRUE(stepped->ok());

  const HeardReply poison = cluster_->apply(spawn("poison", 0.25), {7, 1});
  ASSERT_TRUE(poison->ok());
  const auto poisoned = cluster_->step(10);
  EXPECT_TRUE(cluster_->apply(removal("poison"), {7, 2})->ok());
  EXPECT_TRUE(cluster_->apply(push("egg"))->ok());
  end_three();
  EXPECT_EQ(poisoned->code(), absl::StatusCode::kUnavailable) << poisoned->message();
  join(NodeId{301});
  EXPECT_TRUE(work(NodeId{301}));

  const v1::StatusReply status = cluster_->status();
  EXPECT_EQ(status.state(), "paused");
  EXPECT_EQ(status.tick(), 14u);
  ASSERT_EQ(status.left_out_size(), 2);
  EXPECT_EQ(status.left_out(0).tick(), 5u);
  EXPECT_THAT(status.left_out(0).commands(), HasSubstr("poison"));
  EXPECT_THAT(status.left_out(1).reason(), HasSubstr("poison")) << "what needs it goes with it";
  EXPECT_THAT(log_, HasSubstr("goes on without"));

  EXPECT_EQ(cluster_->find_bodies().bodies_size(), 4);
  EXPECT_EQ(recorded_.size(), 2u) << "the pushes";
  EXPECT_TRUE(cluster_->apply(spawn("poison", 0.25), {7, 1})->ok())
      << "it was answered, and is not done again";
  EXPECT_EQ(cluster_->find_bodies().bodies_size(), 4);
  const HeardReply next = cluster_->apply(spawn("next"));
  ASSERT_TRUE(next->ok()) << next->message();
  EXPECT_GT(next->answer.applied().created(0).first_body(), poison->answer.applied().created(0).first_body())
      << "ids are never given twice";
}

TEST_F(PoisonTest, IsLeftOutByWhoeverReadsTheStore) {
  EXPECT_TRUE(cluster_->apply(spawn("poison", 0.25))->ok());
  static_cast<void>(cluster_->step(2));
  end_three();
  cluster_.reset();

  store_.reset();
  store_ = open_folder_store("store", disk_).value();
  CoordinatorOptions options;
  options.checkpoint_every = std::chrono::hours(1);
  options.store = store_.get();
  TestCluster next(options);
  ASSERT_TRUE(next.coordinator->resume_stored().ok());
  next.join(kFirst);
  next.advance(kGatherServers);
  next.finish_loads();
  next.work_all();
  EXPECT_EQ(next.status().tick(), 2u);
  EXPECT_EQ(next.status().left_out_size(), 1);
  EXPECT_EQ(next.find_bodies().bodies_size(), 4);
}

}  // namespace
}  // namespace tessera
