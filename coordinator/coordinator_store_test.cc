// What a coordinator does while its store cannot be written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// In memory; writes fail while it is told so.
class FailingStore final : public WorldStore {
 public:
  std::optional<StoredWorld> take_stored() override { return std::nullopt; }
  absl::Status begin(std::uint64_t, const StoredState&) override { return failure; }
  absl::Status end() override { return failure; }
  absl::Status append(const std::vector<v1::StoredInput>& more) override {
    if (!failure.ok()) return failure;
    inputs.insert(inputs.end(), more.begin(), more.end());
    return absl::OkStatus();
  }
  std::uint64_t position() const override { return inputs.size(); }
  bool wants_whole() const override { return false; }
  bool change(StateChange, std::uint64_t) override { return true; }
  absl::Status tend() override { return state_failure; }

  std::size_t commands() const {
    std::size_t count = 0;
    for (const v1::StoredInput& input : inputs) count += input.commands().commands_size() > 0 ? 1 : 0;
    return count;
  }

  absl::Status failure;
  absl::Status state_failure;
  std::vector<v1::StoredInput> inputs;
};

class CoordinatorStoreTest : public ::testing::Test {
 protected:
  void start(bool waits) {
    CoordinatorOptions options;
    options.checkpoint_every = std::chrono::hours(1);
    options.store = &store_;
    options.wait_for_store = waits;
    options.log = [this](const LogLine& line) {
      if (line.severity != Severity::kInfo) log_.push_back(line.text);
    };
    cluster_ = loaded_cluster(options);
  }

  HeardReply push(RequestId id = {}) { return cluster_->apply(tessera::push("ball"), id); }
  HeardReply step(std::uint64_t ticks) { return cluster_->step(ticks); }
  void fail() { store_.failure = absl::UnavailableError("no room"); }
  void mend() {
    store_.failure = absl::OkStatus();
    cluster_->advance(kStoreRetry);
  }

  FailingStore store_;
  std::vector<std::string> log_;
  std::unique_ptr<TestCluster> cluster_;
};

TEST_F(CoordinatorStoreTest, TheWorldWaitsAndGoesOnByItself) {
  start(/*waits=*/true);
  fail();
  const auto pushed = push();
  const auto stepped = step(3);
  EXPECT_FALSE(pushed->status) << "it is not stored, so nobody is told";
  EXPECT_THAT(cluster_->take_grants(kFirst), IsEmpty()) << "nor does it take effect";
  EXPECT_EQ(push()->code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(push()->message(), HasSubstr("no room"));
  EXPECT_EQ(cluster_->status().store_failure(), "no room");
  EXPECT_TRUE(cluster_->status().waits_for_store());
  EXPECT_THAT(log_,
              ::testing::ElementsAre(HasSubstr("the world waits, for its store cannot be written: no room")));

  cluster_->advance(kStoreRetry);
  EXPECT_FALSE(pushed->status) << "it was tried again in vain";
  mend();
  EXPECT_TRUE(pushed->ok());
  EXPECT_EQ(store_.commands(), 1u);
  cluster_->work_all();
  EXPECT_TRUE(stepped->ok());
  EXPECT_FALSE(cluster_->status().waits_for_store());
  EXPECT_EQ(cluster_->status().store_failure(), "");
  EXPECT_THAT(log_.back(), HasSubstr("can be written again"));
}

TEST_F(CoordinatorStoreTest, WhatWasGrantedBeforeGoesOn) {
  start(/*waits=*/true);
  const auto stepped = step(100);
  fail();
  const auto pushed = push();
  cluster_->work_all();
  EXPECT_FALSE(stepped->status);
  EXPECT_GT(cluster_->status().tick(), 0u);
  mend();
  cluster_->work_all();
  EXPECT_TRUE(stepped->ok());
  EXPECT_TRUE(pushed->ok());
}

TEST_F(CoordinatorStoreTest, OrTheWorldGoesOnAndIsStoredLater) {
  start(/*waits=*/false);
  fail();
  EXPECT_TRUE(push()->ok());
  const auto stepped = step(3);
  cluster_->work_all();
  EXPECT_TRUE(stepped->ok());
  EXPECT_TRUE(push()->ok());
  EXPECT_FALSE(cluster_->status().waits_for_store());
  EXPECT_EQ(cluster_->status().store_failure(), "no room");
  EXPECT_EQ(store_.commands(), 0u);
  EXPECT_THAT(log_, ::testing::ElementsAre(HasSubstr("would be set back")));
  mend();
  EXPECT_EQ(store_.commands(), 2u);
  EXPECT_EQ(cluster_->status().store_failure(), "");
}

TEST_F(CoordinatorStoreTest, ACheckpointThatCannotBeStoredStopsNothing) {
  start(/*waits=*/true);
  store_.state_failure = absl::UnavailableError("no room for that");
  EXPECT_TRUE(push()->ok());
  EXPECT_EQ(cluster_->status().store_failure(), "no room for that");
  EXPECT_FALSE(cluster_->status().waits_for_store());
  const auto stepped = step(3);
  cluster_->work_all();
  EXPECT_TRUE(stepped->ok());
}

TEST_F(CoordinatorStoreTest, ACoordinatorThatEndsMeanwhileAnswersWithAnError) {
  start(/*waits=*/true);
  fail();
  const auto pushed = push();
  cluster_->coordinator->retire();
  EXPECT_EQ(pushed->code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(cluster_->coordinator->finished());
}

TEST_F(CoordinatorStoreTest, AnUnloadMeanwhileSaysThatTheStoreStillHasTheWorld) {
  start(/*waits=*/true);
  fail();
  const auto pushed = push();
  const auto unloaded = cluster_->ask<v1::UnloadReply>(v1::UnloadRequest());
  EXPECT_EQ(pushed->code(), absl::StatusCode::kFailedPrecondition) << pushed->message();
  EXPECT_EQ(unloaded->code(), absl::StatusCode::kUnavailable) << unloaded->message();
  EXPECT_EQ(cluster_->status().state(), "empty");
  EXPECT_THAT(log_.back(), HasSubstr("the store still has the world"));
}

// Who makes a call again hears what the one before was told, not what it would have been told.
TEST_F(CoordinatorStoreTest, ACommandThatWasNeverStoredIsNotRememberedAsDone) {
  start(/*waits=*/true);
  fail();
  const RequestId call{.session = 7, .number = 1};
  const auto pushed = push(call);
  const auto again = push(call);
  EXPECT_FALSE(pushed->status);
  EXPECT_FALSE(again->status);
  cluster_->ask<v1::UnloadReply>(v1::UnloadRequest());
  for (const auto& heard : {pushed, again, push(call)})
    EXPECT_EQ(heard->code(), absl::StatusCode::kFailedPrecondition) << heard->message();
}

TEST_F(CoordinatorStoreTest, ACommandThatIsStoredIsRememberedAsDone) {
  start(/*waits=*/true);
  fail();
  const RequestId call{.session = 7, .number = 1};
  const auto pushed = push(call);
  mend();
  EXPECT_TRUE(pushed->ok());
  EXPECT_TRUE(push(call)->ok());
  EXPECT_EQ(store_.commands(), 1u);
}

TEST_F(CoordinatorStoreTest, AServerThatJoinsMeanwhileIsWelcomed) {
  start(/*waits=*/true);
  fail();
  const auto pushed = push();
  const NodeId third{300};
  cluster_->join(third);
  EXPECT_FALSE(pushed->status);
  EXPECT_THAT(cluster_->take(third, v1::ClusterMessage::kWelcome), SizeIs(1));
}

TEST_F(CoordinatorStoreTest, AWorldThatCannotBeStoredIsNotLoaded) {
  start(/*waits=*/true);
  fail();
  v1::LoadRequest request;
  request.set_replace(true);
  *request.mutable_world() = to_proto(small_world());
  const auto loaded = cluster_->ask<v1::LoadReply>(std::move(request));
  cluster_->finish_loads();
  EXPECT_EQ(loaded->code(), absl::StatusCode::kUnavailable) << loaded->message();
  EXPECT_EQ(cluster_->status().state(), "recovering") << "the one before comes back";
  cluster_->finish_loads();
  EXPECT_EQ(cluster_->status().state(), "paused");
}

// Whose part of a tick takes long is named.
TEST(SlowServer, IsNamed) {
  std::vector<std::string> log;
  CoordinatorOptions options;
  options.log = [&log](const LogLine& line) {
    if (line.severity == Severity::kWarning) log.push_back(line.text);
  };
  const auto cluster = loaded_cluster(options);
  v1::ResumeRequest resume;
  resume.set_real_time_factor(1);
  cluster->ask<v1::ResumeReply>(resume);
  const std::uint64_t world = 1;
  std::uint64_t awake_at_first = 1;  // sectors
  const auto do_ticks = [&](Tick from, Tick to, std::uint64_t second_us) {
    for (Tick tick = from; tick <= to; ++tick) {
      cluster->advance(milliseconds(10));
      for (const auto& [node, own_us] :
           {std::pair(kFirst, std::uint64_t{1000}), std::pair(kSecond, second_us)}) {
        v1::TickReport report;
        report.set_tick(tick);
        report.set_work_us(std::max<std::uint64_t>(second_us, 1000));
        report.set_own_us(own_us);
        write({.sectors_awake = node == kFirst ? awake_at_first : 1}, *report.mutable_counts());
        cluster->report(node, world, tick, {report});
      }
    }
  };
  do_ticks(1, 100, 5000);
  EXPECT_THAT(log, ::testing::ElementsAre(::testing::AllOf(HasSubstr("c8"), HasSubstr("slows the world"))));
  const v1::StatusReply status = cluster->status();
  for (const v1::ServerStatus& server : status.servers()) {
    EXPECT_EQ(server.slow(), server.node() == kSecond.value);
  }
  EXPECT_NEAR(status.servers(1).own_ms(), 5, 2);
  do_ticks(101, 400, 1000);
  EXPECT_FALSE(cluster->status().servers(1).slow());
  awake_at_first = 0;
  do_ticks(401, 700, 5000);
  EXPECT_FALSE(cluster->status().servers(1).slow()) << "it alone has work";
  EXPECT_THAT(log, SizeIs(1));
}

}  // namespace
}  // namespace tessera
