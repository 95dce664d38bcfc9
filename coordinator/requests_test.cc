// Requests of commands, ticks and queries: one reply, to all of it.
#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "lpss/observe/world_hash.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

TEST(Requests, DoTheirCommandsThenTheirTicksThenAnswerTheirQueries) {
  const auto cluster = loaded_cluster();
  cluster->step(5);
  cluster->work_all();
  v1::Query find;
  find.mutable_find_bodies()->set_name_prefix("new");
  const auto heard = cluster->send(request_of({spawn("new"), push("new")}, 40, {hash_query(), find}));
  EXPECT_FALSE(heard->status);
  cluster->work(kFirst);
  EXPECT_FALSE(heard->status) << "a window is not all of the ticks";
  cluster->work_all();
  ASSERT_TRUE(heard->ok()) << heard->message();
  EXPECT_EQ(heard->answer.applied().tick(), 6u);
  EXPECT_EQ(heard->answer.applied().created(0).first_body(), 5u);
  EXPECT_EQ(heard->answer.tick(), 45u);
  EXPECT_EQ(cluster->tick[kFirst], 45u);
  ASSERT_EQ(heard->answer.results_size(), 2);
  WorldHash sum(45, kFirst.value);
  sum.add(WorldHash(45, kSecond.value));
  EXPECT_EQ(heard->answer.results(0).hash().hash(), sum.to_string()) << "at the end of the last tick";
  EXPECT_EQ(heard->answer.results(1).find_bodies().bodies_size(), 1);
  EXPECT_EQ(cluster->status().state(), "paused");
}

// Whatever of it is wrong.
TEST(Requests, DoNothingWhereAnythingIsWrong) {
  const auto cluster = loaded_cluster();
  v1::Query bad;
  bad.mutable_ray();
  v1::Request of_another = request_of({spawn("mine"), push("mine"), push("ball")}, 3, {hash_query()});
  of_another.set_owner("alice");
  const std::pair<v1::Request, std::string> wrong[] = {
      {request_of({spawn("new"), removal("nobody")}, 3, {hash_query()}), "commands[1] (remove)"},
      {request_of({spawn("new")}, 3, {hash_query(), bad}), "queries[1] (ray)"},
      {request_of({spawn("new")}, kStepTicksMax + 1), "ticks = "},
      {of_another, "commands[2] (apply_impulse): body 'ball': it is not owned by 'alice'"},
  };
  for (const auto& [request, words] : wrong) {
    const auto heard = cluster->send(request);
    EXPECT_EQ(heard->status ? heard->message().substr(0, words.size()) : "", words);
    EXPECT_EQ(cluster->status().bodies(), 4u);
    EXPECT_TRUE(cluster->inbox[kFirst].empty());
  }
  EXPECT_EQ(cluster->apply(spawn("new"))->answer.applied().created(0).first_body(), 5u);
}

TEST(Requests, OfTicksDoNothingWhileTheWorldRuns) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::ResumeReply>(v1::ResumeRequest());
  const auto heard = cluster->send(request_of({spawn("new")}, 3));
  EXPECT_EQ(heard->code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(heard->message(), HasSubstr("must be paused"));
  EXPECT_EQ(cluster->status().bodies(), 4u);
  EXPECT_TRUE(cluster->apply(spawn("new"))->ok());
}

// A step is under way as long as another one.
TEST(Requests, OfTicksComeOneAfterTheOther) {
  const auto cluster = loaded_cluster();
  const auto first = cluster->step(3);
  EXPECT_EQ(cluster->step(3)->code(), absl::StatusCode::kFailedPrecondition);
  cluster->work_all();
  EXPECT_TRUE(first->ok());
  const auto second = cluster->step(3);
  cluster->work_all();
  EXPECT_EQ(second->answer.tick(), 6u);
}

TEST(Requests, APauseCutsTheirTicksShort) {
  const auto cluster = loaded_cluster();
  const auto heard = cluster->send(request_of({spawn("new")}, 1000, {hash_query()}));
  cluster->work(kFirst);
  const auto paused = cluster->ask<v1::PauseReply>(v1::PauseRequest());
  cluster->work_all();
  EXPECT_TRUE(paused->ok());
  EXPECT_EQ(heard->code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(heard->message(), HasSubstr("cut short by a pause"));
  EXPECT_EQ(cluster->status().bodies(), 5u) << "its commands have taken effect";
}

// Of a world that runs: at the end of that tick, or of one soon after.
TEST(Requests, QueriesAfterATickWaitForIt) {
  const auto cluster = loaded_cluster();
  cluster->ask<v1::ResumeReply>(v1::ResumeRequest());
  const auto command = cluster->apply(push("ball"));
  ASSERT_TRUE(command->ok());
  const Tick at = command->answer.applied().tick();
  EXPECT_GT(at, 1u);
  v1::Request request = request_of({}, 0, {hash_query()});
  request.set_after(at);
  const auto after = cluster->send(request);
  const auto now = cluster->query(hash_query());
  EXPECT_FALSE(after->status);
  for (int n = 0; n < 3; ++n) {
    for (const NodeId node : cluster->nodes()) cluster->work(node);
  }
  ASSERT_TRUE(after->ok() && now->ok());
  EXPECT_GE(after->answer.tick(), at);
  EXPECT_LT(now->answer.tick(), at);
}

TEST(Requests, QueriesAfterATickThatAPausedWorldDoesNotReachAreAnsweredAtOnce) {
  const auto cluster = loaded_cluster();
  v1::Request request = request_of({}, 0, {hash_query()});
  request.set_after(100);
  const auto heard = cluster->send(request);
  cluster->work_all();
  ASSERT_TRUE(heard->ok()) << heard->message();
  EXPECT_EQ(heard->answer.tick(), 0u);
}

TEST(Requests, AWorldThatEndsAnswersAllOfThem) {
  const auto cluster = loaded_cluster();
  const auto stepped = cluster->send(request_of({spawn("new")}, 1000, {hash_query()}));
  const auto asked = cluster->query(hash_query());
  const auto unloaded = cluster->ask<v1::UnloadReply>(v1::UnloadRequest());
  EXPECT_TRUE(unloaded->ok());
  for (const auto& heard : {stepped, asked, cluster->step(1)}) {
    EXPECT_EQ(heard->code(), absl::StatusCode::kFailedPrecondition) << heard->message();
  }
}

}  // namespace
}  // namespace tessera
