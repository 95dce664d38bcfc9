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

  HeardReply remove(const std::string& body) { return cluster_->apply(removal(body)); }
  void let_store_go_on() {
    store_.stored_inputs = store_.all.size();
    cluster_->collect();
  }
  std::vector<v1::StoredInput> inputs_with_commands() const {
    std::vector<v1::StoredInput> inputs;
    for (const v1::StoredInput& input : store_.all) {
      if (input.has_commands()) inputs.push_back(input);
    }
    return inputs;
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
  const auto removed = remove("ball");
  EXPECT_FALSE(removed->status);
  const auto stepped = cluster_->step(1);
  EXPECT_EQ(ticks_granted(), 0u);
  let_store_go_on();
  EXPECT_TRUE(removed->ok()) << removed->message();
  EXPECT_EQ(removed->answer.applied().tick(), 1u);
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

// It does not wait for the tick at which it takes effect.
TEST_F(JournalTest, ARunningWorldAnswersACommandOnceItIsStored) {
  v1::ResumeRequest resume;
  resume.set_real_time_factor(1);
  const auto resumed = cluster_->ask<v1::ResumeReply>(resume);
  let_store_go_on();
  EXPECT_TRUE(resumed->ok());
  const auto removed = remove("ball");
  EXPECT_FALSE(removed->status);
  const v1::StoredInput stored = inputs_with_commands().back();
  let_store_go_on();
  EXPECT_TRUE(removed->ok()) << removed->message();
  EXPECT_EQ(removed->answer.applied().tick(), stored.commands().tick());
  EXPECT_GT(stored.commands().tick(), cluster_->status().tick() + 1);
}

TEST_F(JournalTest, OneThatIsReplacedAnswersTheCommandsThatItHasStored) {
  v1::ResumeRequest resume;
  resume.set_real_time_factor(1);
  cluster_->ask<v1::ResumeReply>(resume);
  const auto removed = remove("ball");
  cluster_->coordinator->retire();
  EXPECT_FALSE(removed->status);
  let_store_go_on();
  EXPECT_TRUE(removed->ok()) << removed->message();
  EXPECT_TRUE(cluster_->coordinator->finished());
}

// Of a list, and of the request that it belongs to: also where it only runs ticks.
TEST_F(JournalTest, AListIsOneInputWithItsRequest) {
  store_.is_fast = true;
  cluster_->apply({removal("ball"), spawn("new"), push("new")}, {.session = 7, .number = 3});
  ASSERT_EQ(inputs_with_commands().size(), 1u);
  const v1::StoredInput list = inputs_with_commands().front();
  EXPECT_EQ(list.session(), 7u);
  EXPECT_EQ(list.number(), 3u);
  EXPECT_EQ(list.commands().tick(), 1u);
  EXPECT_EQ(list.commands().next_body(), 5u) << "before it";
  EXPECT_EQ(list.commands().commands_size(), 3);

  cluster_->send(request_of({}, 2), {.session = 7, .number = 4});
  ASSERT_EQ(inputs_with_commands().size(), 2u);
  const v1::StoredInput ticks = inputs_with_commands().back();
  EXPECT_EQ(ticks.number(), 4u);
  EXPECT_TRUE(ticks.commands().commands().empty());
}

// That a step has ended is clear from what is stored when it begins: the request, and the pace.
TEST_F(JournalTest, AStepIsStoredOnce) {
  store_.is_fast = true;
  for (int n = 0; n < 4; ++n) {
    const std::size_t before = store_.all.size();
    const auto stepped = cluster_->step(3);
    cluster_->work_all();
    EXPECT_TRUE(stepped->ok());
    EXPECT_EQ(store_.all.size(), before + 2);
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
  v1::RecordedCommands& commands = *found.inputs.emplace_back().mutable_commands();
  commands.set_tick(0);
  *commands.add_commands() = removal("ball");
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
