// Nothing is told before what it rests on is stored, and all of it afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/test_cluster.h"
#include "coordinator/unanswered.h"

namespace tessera {
namespace {

// A store that is as fast as a test lets it be.
class SlowStore final : public WorldStore {
 public:
  std::optional<StoredWorld> take_stored() override { return std::exchange(found, std::nullopt); }
  absl::Status begin(std::uint64_t, const StoredState&) override { return absl::OkStatus(); }
  absl::Status end() override {
    has_ended = ends.ok();
    return ends;
  }
  absl::Status append(const std::vector<v1::StoredInput>& inputs) override {
    all.insert(all.end(), inputs.begin(), inputs.end());
    if (is_fast) stored_inputs = all.size();
    return absl::OkStatus();
  }
  std::uint64_t position() const override { return all.size(); }
  std::uint64_t stored() const override { return stored_inputs; }
  bool wants_whole() const override { return false; }
  bool change(StateChange, std::uint64_t) override { return false; }
  absl::Status tend() override { return absl::OkStatus(); }

  std::optional<StoredWorld> found;
  std::vector<v1::StoredInput> all;
  std::uint64_t stored_inputs = 0;
  bool is_fast = true;
  bool has_ended = false;
  absl::Status ends;
};

class JournalTest : public ::testing::Test {
 protected:
  JournalTest() {
    CoordinatorOptions options;
    options.checkpoint_every = std::chrono::hours(1);
    options.store = &store_;
    cluster_ = loaded_cluster(options);
    store_.is_fast = false;
  }

  std::shared_ptr<Heard<v1::CommandReply>> remove(const std::string& body) {
    v1::RemoveRequest request;
    request.mutable_body()->set_name(body);
    return cluster_->ask<v1::CommandReply>(request);
  }
  void let_store_go_on() {
    store_.stored_inputs = store_.all.size();
    cluster_->collect();
  }
  // That were sent to the first server.
  std::uint64_t ticks_granted() {
    std::uint64_t ticks = 0;
    for (const v1::Grant& grant : cluster_->take_grants(kFirst)) ticks += grant.ticks();
    return ticks;
  }

  SlowStore store_;
  std::unique_ptr<TestCluster> cluster_;
};

TEST_F(JournalTest, ACommandIsAnsweredAndGrantedOnceItIsStored) {
  v1::StepRequest step;
  step.set_ticks(1);
  const auto removed = remove("ball");
  EXPECT_FALSE(removed->status);
  const auto stepped = cluster_->ask<v1::StepReply>(step);
  EXPECT_EQ(ticks_granted(), 0u);
  let_store_go_on();
  EXPECT_TRUE(removed->ok()) << removed->message();
  EXPECT_EQ(removed->answer.tick(), 1u);
  cluster_->work_all();
  let_store_go_on();
  EXPECT_TRUE(stepped->ok()) << stepped->message();
}

TEST_F(JournalTest, TicksWithoutCommandsAreGrantedAsFarAsTheyAreCertain) {
  v1::ResumeRequest resume;
  resume.set_real_time_factor(0);
  const auto resumed = cluster_->ask<v1::ResumeReply>(resume);
  EXPECT_EQ(ticks_granted(), 0u);
  let_store_go_on();
  EXPECT_TRUE(resumed->ok());
  // Half a second of ticks is certain; what comes next is stored while they are done.
  const Tick certain = store_.all.back().pace().certain();
  cluster_->advance({});
  std::uint64_t done = 0;
  for (std::vector<v1::Grant> grants = cluster_->take_grants(kFirst); !grants.empty();
       grants = cluster_->take_grants(kFirst)) {
    for (const v1::Grant& grant : grants) done += grant.ticks();
    for (const NodeId node : {kFirst, kSecond}) cluster_->report(node, grants.back().world(), done);
  }
  EXPECT_GT(done, 32u) << "more than the first window";
  EXPECT_LE(done, certain);
  EXPECT_GT(store_.all.size(), store_.stored_inputs);
  let_store_go_on();
  EXPECT_GT(ticks_granted(), 0u);
}

TEST_F(JournalTest, OneWhoDoesNotLeadAnyMoreAnswersAllAndTellsServersNothing) {
  const auto removed = remove("ball");
  cluster_->coordinator->abandon();
  EXPECT_EQ(removed->code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(is_unanswered(*removed->status)) << "the client is to ask whoever leads";
  cluster_->collect();
  EXPECT_TRUE(cluster_->inbox[kFirst].empty());
  EXPECT_TRUE(cluster_->coordinator->finished());
}

TEST_F(JournalTest, OneThatIsReplacedWaitsForItsStore) {
  const auto removed = remove("ball");
  cluster_->coordinator->retire();
  EXPECT_FALSE(cluster_->coordinator->finished());
  let_store_go_on();
  EXPECT_TRUE(removed->ok()) << removed->message();
  EXPECT_TRUE(cluster_->coordinator->finished());
}

// A running world answers a command once its tick is granted, which does not come here any more.
TEST_F(JournalTest, OneThatIsReplacedAnswersTheCommandsThatItHasStored) {
  store_.is_fast = true;
  v1::ResumeRequest resume;
  resume.set_real_time_factor(1);
  EXPECT_TRUE(cluster_->ask<v1::ResumeReply>(resume)->ok());
  const auto removed = remove("ball");
  EXPECT_FALSE(removed->status);
  const v1::StoredInput stored = store_.all.back();
  cluster_->coordinator->retire();
  EXPECT_TRUE(removed->ok()) << removed->message();
  EXPECT_EQ(removed->answer.tick(), stored.command().tick());
  EXPECT_TRUE(cluster_->coordinator->finished());
}

// That a step has ended is clear from what is stored when it begins.
TEST_F(JournalTest, AStepIsStoredOnce) {
  store_.is_fast = true;
  v1::StepRequest step;
  step.set_ticks(3);
  for (int n = 0; n < 4; ++n) {
    const std::size_t before = store_.all.size();
    const auto stepped = cluster_->ask<v1::StepReply>(step);
    cluster_->work_all();
    EXPECT_TRUE(stepped->ok());
    EXPECT_EQ(store_.all.size(), before + 1);
  }
}

// However fast a world is, the store is written a few times a second.
TEST_F(JournalTest, AFastWorldStoresItsPaceSeldom) {
  store_.is_fast = true;
  v1::ResumeRequest resume;
  resume.set_real_time_factor(0);
  EXPECT_TRUE(cluster_->ask<v1::ResumeReply>(resume)->ok());
  // A window of grants takes 8 ms: 4,000 ticks a second.
  const auto run = [&](int span_ms) {
    const std::size_t before = store_.all.size();
    for (int time_ms = 0; time_ms < span_ms; time_ms += 8) {
      cluster_->advance(std::chrono::milliseconds(8));
      for (const NodeId node : cluster_->nodes()) cluster_->work(node);
    }
    return store_.all.size() - before;
  };
  run(2000);
  EXPECT_GT(cluster_->tick[kFirst], 5000u);
  EXPECT_LE(run(2000), 20u);
}

// What a damaged store has does not reach the sequence.
TEST(ResumeStored, ACommandOfATickBeforeTheStateIsNotGivenAgain) {
  SlowStore store;
  StoredWorld& found = store.found.emplace();
  found.load = 1;
  found.state = to_proto(small_world());
  v1::RecordedCommand& command = *found.inputs.emplace_back().mutable_command();
  command.set_tick(0);
  command.mutable_remove()->mutable_body()->set_name("ball");
  CoordinatorOptions options;
  options.store = &store;
  Coordinator coordinator(options);
  const absl::Status status = coordinator.resume_stored();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string(status.message()), ::testing::HasSubstr("of tick 0"));
}

TEST_F(JournalTest, AnUnloadThatIsNotStoredIsNotAcknowledged) {
  store_.ends = absl::AbortedError("another coordinator leads");
  EXPECT_EQ(cluster_->ask<v1::UnloadReply>(v1::UnloadRequest())->code(), absl::StatusCode::kAborted);
}

}  // namespace
}  // namespace tessera
