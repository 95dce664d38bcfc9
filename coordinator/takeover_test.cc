// A coordinator that goes on with a stored world, for clients that make their requests again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "coordinator/test_cluster.h"
#include "lpss/observe/world_hash.h"

namespace tessera {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

// In memory, and fast.
class MemoryStore final : public WorldStore {
 public:
  std::optional<StoredWorld> take_stored() override { return std::exchange(found, std::nullopt); }
  absl::Status begin(std::uint64_t load, const StoredState& state) override {
    kept = {load, state, {}};
    return absl::OkStatus();
  }
  absl::Status end() override { return absl::OkStatus(); }
  absl::Status append(const std::vector<v1::StoredInput>& inputs) override {
    kept.inputs.insert(kept.inputs.end(), inputs.begin(), inputs.end());
    return absl::OkStatus();
  }
  std::uint64_t position() const override { return kept.inputs.size(); }
  bool wants_whole() const override { return false; }
  bool change(StateChange, std::uint64_t) override { return false; }
  absl::Status tend() override { return absl::OkStatus(); }

  std::optional<StoredWorld> found;
  StoredWorld kept;
};

CoordinatorOptions options_with(WorldStore& store) {
  CoordinatorOptions options;
  options.checkpoint_every = std::chrono::hours(1);
  options.store = &store;
  return options;
}

class Takeover : public ::testing::Test {
 protected:
  // The coordinator is gone, and another one has the world, and the servers.
  void take_over() {
    cluster_.reset();
    later_.found = std::exchange(store_.kept, {});
    cluster_ = std::make_unique<TestCluster>(options_with(later_));
    ASSERT_TRUE(cluster_->coordinator->resume_stored().ok());
    cluster_->join(kFirst);
    cluster_->join(kSecond);
    cluster_->advance(std::chrono::seconds(1));
    cluster_->finish_loads();
  }
  // In all ticks, as the first server is told.
  std::vector<Command> carried_out() {
    std::vector<Command> commands;
    for (bool any = true; any;) {
      any = false;
      for (const NodeId node : {kFirst, kSecond}) {
        for (const v1::Grant& grant : cluster_->work(node)) {
          any = true;
          if (node != kFirst || grant.ticks() == 0) continue;
          const std::vector<Command> granted = unpack_commands(grant.commands()).value();
          commands.insert(commands.end(), granted.begin(), granted.end());
        }
      }
    }
    return commands;
  }

  MemoryStore store_;
  MemoryStore later_;
  std::unique_ptr<TestCluster> cluster_ = loaded_cluster(options_with(store_));
  const RequestId id_{.session = 7, .number = 3};
};

TEST_F(Takeover, CommandsAreNotCarriedOutAgain) {
  const v1::Request request = request_of({spawn("new"), push("new")});
  const v1::Reply first = cluster_->send(request, id_)->answer;
  take_over();
  const auto again = cluster_->send(request, id_);
  ASSERT_TRUE(again->ok()) << again->message();
  EXPECT_EQ(again->answer.applied().SerializeAsString(), first.applied().SerializeAsString());
  EXPECT_EQ(cluster_->status().bodies(), 5u);
  cluster_->step(1);
  EXPECT_THAT(carried_out(), SizeIs(2));
  EXPECT_TRUE(cluster_->send(request, id_)->ok()) << "it is remembered here, too";
  EXPECT_EQ(cluster_->send(request, {7, 4})->code(), absl::StatusCode::kAlreadyExists) << "another request";
}

// A checkpoint has taken the place of its commands, and what they did is kept beside it.
TEST_F(Takeover, CommandsThatTheStateHasAreNotCarriedOutAgain) {
  const v1::Request request = request_of({spawn("new"), push("new")});
  const v1::Reply first = cluster_->send(request, id_)->answer;
  for (v1::StoredInput& input : store_.kept.inputs) {
    if (input.has_commands()) *input.mutable_carried_out() = first.applied();
  }
  take_over();
  const auto again = cluster_->send(request, id_);
  ASSERT_TRUE(again->ok()) << again->message();
  EXPECT_EQ(again->answer.applied().SerializeAsString(), first.applied().SerializeAsString());
  cluster_->step(1);
  EXPECT_THAT(carried_out(), IsEmpty());
}

// What comes after its commands is done, or is done still, and answered.
TEST_F(Takeover, TicksAndQueriesOfARequestAreDone) {
  const v1::Request request = request_of({spawn("new")}, 5, {hash_query()});
  EXPECT_FALSE(cluster_->send(request, id_)->status);
  take_over();
  const auto again = cluster_->send(request, id_);
  EXPECT_FALSE(again->status);
  EXPECT_THAT(carried_out(), SizeIs(1));
  ASSERT_TRUE(again->ok()) << again->message();
  EXPECT_EQ(again->answer.applied().tick(), 1u);
  EXPECT_EQ(again->answer.applied().created(0).first_body(), 5u);
  EXPECT_EQ(again->answer.tick(), 5u);
  EXPECT_EQ(cluster_->tick[kFirst], 5u);
  WorldHash sum(5, kFirst.value);
  sum.add(WorldHash(5, kSecond.value));
  EXPECT_EQ(again->answer.results(0).hash().hash(), sum.to_string());
}

TEST_F(Takeover, TicksAloneRunOnce) {
  const v1::Request request = request_of({}, 5);
  EXPECT_FALSE(cluster_->send(request, id_)->status);
  take_over();
  carried_out();
  EXPECT_EQ(cluster_->status().tick(), 5u) << "they go on by themselves";
  const auto again = cluster_->send(request, id_);
  carried_out();
  ASSERT_TRUE(again->ok()) << again->message();
  EXPECT_EQ(again->answer.tick(), 5u);
  EXPECT_EQ(cluster_->status().tick(), 5u);
}

// One that was refused before is not in the store, and is refused again.
TEST_F(Takeover, WhatWasRefusedIsTriedAnew) {
  EXPECT_EQ(cluster_->apply(removal("new"), id_)->code(), absl::StatusCode::kNotFound);
  take_over();
  EXPECT_EQ(cluster_->apply(removal("new"), id_)->code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace tessera
