// A call that a client makes again runs once.
#include "coordinator/sessions.h"

#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

using SpawnCall = ClientCall<v1::SpawnRequest, v1::SpawnReply>;

struct Answered {
  int times = 0;
  absl::Status status;
  v1::SpawnReply answer;
};

SpawnCall call(CallId id, Answered& heard) {
  return {{},
          [&heard](const absl::Status& status, const v1::SpawnReply& answer) {
            ++heard.times;
            heard.status = status;
            heard.answer = answer;
          },
          id};
}

v1::SpawnReply reply_with(std::uint64_t id) {
  v1::SpawnReply reply;
  reply.set_id(id);
  return reply;
}

TEST(Sessions, GiveTheSameAnswerAgain) {
  Sessions sessions;
  Answered first;
  Answered second;
  SpawnCall made = call({7, 1}, first);
  ASSERT_TRUE(sessions.admit(made));
  made.reply(absl::OkStatus(), reply_with(42));
  SpawnCall again = call({7, 1}, second);
  EXPECT_FALSE(sessions.admit(again));
  EXPECT_EQ(first.answer.id(), 42u);
  EXPECT_EQ(second.times, 1);
  EXPECT_TRUE(second.status.ok());
  EXPECT_EQ(second.answer.id(), 42u);
}

TEST(Sessions, GiveAnErrorAgain) {
  Sessions sessions;
  Answered first;
  Answered second;
  SpawnCall made = call({7, 1}, first);
  ASSERT_TRUE(sessions.admit(made));
  made.reply(absl::NotFoundError("no such body"), {});
  SpawnCall again = call({7, 1}, second);
  EXPECT_FALSE(sessions.admit(again));
  EXPECT_EQ(second.status, first.status);
}

TEST(Sessions, WhoAsksAgainMeanwhileWaits) {
  Sessions sessions;
  Answered first;
  Answered second;
  SpawnCall made = call({7, 1}, first);
  ASSERT_TRUE(sessions.admit(made));
  SpawnCall again = call({7, 1}, second);
  EXPECT_FALSE(sessions.admit(again));
  EXPECT_EQ(second.times, 0);
  made.reply(absl::OkStatus(), reply_with(42));
  EXPECT_EQ(first.times, 1);
  EXPECT_EQ(second.times, 1);
  EXPECT_EQ(second.answer.id(), 42u);
}

TEST(Sessions, OtherCallsAndClientsAreOthers) {
  Sessions sessions;
  Answered heard;
  for (const CallId id : {CallId{7, 1}, CallId{7, 2}, CallId{8, 1}, CallId{}, CallId{}}) {
    SpawnCall made = call(id, heard);
    EXPECT_TRUE(sessions.admit(made)) << id.session << " " << id.number;
  }
}

TEST(Sessions, AreBounded) {
  Sessions sessions;
  Answered heard;
  for (std::uint64_t number = 1; number <= kAnswersPerSessionMax + 1; ++number) {
    SpawnCall made = call({7, number}, heard);
    ASSERT_TRUE(sessions.admit(made));
    made.reply(absl::OkStatus(), {});
  }
  Answered late;
  SpawnCall forgotten = call({7, 1}, late);
  EXPECT_FALSE(sessions.admit(forgotten)) << "it may have run";
  EXPECT_EQ(late.status.code(), absl::StatusCode::kAborted);

  Answered waiting;
  SpawnCall pending = call({9, 1}, heard);
  ASSERT_TRUE(sessions.admit(pending));
  SpawnCall again = call({9, 1}, waiting);
  EXPECT_FALSE(sessions.admit(again));
  for (std::uint64_t session = 100; session < 100 + kSessionsMax; ++session) {
    SpawnCall made = call({session, 1}, heard);
    ASSERT_TRUE(sessions.admit(made));
  }
  EXPECT_EQ(waiting.status.code(), absl::StatusCode::kAborted) << "nobody waits for ever";
  const int before = heard.times;
  pending.reply(absl::OkStatus(), {});
  EXPECT_EQ(heard.times, before + 1) << "whoever made it first is answered in any case";
}

// The whole coordinator: a body is spawned once.
TEST(Sessions, ACommandThatIsGivenAgainRunsOnce) {
  const auto cluster = loaded_cluster();
  const std::uint64_t bodies = cluster->status().bodies();
  v1::SpawnRequest request;
  BodyDescription body;
  *request.mutable_body() = to_proto(body);
  *request.mutable_shape() = to_proto(Shape{{{Sphere{0.5}, {}}}});
  std::vector<std::uint64_t> ids;
  for (int time = 0; time < 3; ++time) {
    cluster->coordinator->handle(
        ClientCall<v1::SpawnRequest, v1::SpawnReply>{
            request,
            [&](const absl::Status& status, const v1::SpawnReply& answer) {
              EXPECT_TRUE(status.ok()) << status;
              ids.push_back(answer.id());
            },
            {7, 1}},
        cluster->now);
  }
  ASSERT_EQ(ids.size(), 3u);
  EXPECT_EQ(ids[1], ids[0]);
  EXPECT_EQ(ids[2], ids[0]);
  EXPECT_EQ(cluster->status().bodies(), bodies + 1);
}

}  // namespace
}  // namespace tessera
