// A request that a client makes again is carried out once.
#include "coordinator/sessions.h"

#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

constexpr auto kAborted = absl::StatusCode::kAborted;
constexpr auto kExhausted = absl::StatusCode::kResourceExhausted;

struct Answered {
  int times = 0;
  absl::Status status;
  v1::Reply reply;
};

Sessions::Call call(RequestId id, Answered& heard, v1::Request request = {}) {
  return {std::move(request),
          [&heard](const absl::Status& status, const v1::Reply& reply) {
            ++heard.times;
            heard.status = status;
            heard.reply = reply;
          },
          id};
}

v1::Reply reply_at(Tick tick) {
  v1::Reply reply;
  reply.mutable_applied()->set_tick(tick);
  return reply;
}

v1::Request answered_up_to(std::uint64_t number, const std::vector<std::uint64_t>& also = {}) {
  v1::Request request;
  request.set_answered(number);
  request.mutable_also_answered()->Add(also.begin(), also.end());
  return request;
}

TEST(NumberSet, HasWhatWasAddedInAnyOrder) {
  NumberSet set;
  EXPECT_FALSE(set.contains(1));
  for (const std::uint64_t number : {5, 3, 9, 4, 1}) set.add(number);
  for (const std::uint64_t number : {1, 3, 4, 5, 9}) EXPECT_TRUE(set.contains(number)) << number;
  for (const std::uint64_t number : {2, 6, 8, 10}) EXPECT_FALSE(set.contains(number)) << number;
  EXPECT_EQ(set.gaps(), 2u);
  set.add(2);
  EXPECT_EQ(set.gaps(), 1u);
  set.add_up_to(7);
  EXPECT_TRUE(set.contains(6) && set.contains(7) && set.contains(9));
  EXPECT_FALSE(set.contains(8));
  set.add(8);
  EXPECT_EQ(set.gaps(), 0u);
  EXPECT_TRUE(set.contains(9));
  EXPECT_FALSE(set.contains(10));
  set.add_up_to(4);
  EXPECT_TRUE(set.contains(9)) << "it never shrinks";
}

TEST(NumberSet, IsAsGoodAsOneOfAllNumbers) {
  std::uint64_t state = 1;
  const auto next = [&](std::uint64_t below) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (state >> 33) % below;
  };
  NumberSet set;
  std::vector<bool> all(200);
  all[0] = true;
  for (int n = 0; n < 400; ++n) {
    const std::uint64_t number = 1 + next(199);
    set.add(number);
    all[number] = true;
    if (n % 50 == 49) {
      const std::uint64_t up_to = next(40);
      set.add_up_to(up_to);
      for (std::uint64_t k = 0; k <= up_to; ++k) all[k] = true;
    }
    for (std::uint64_t k = 0; k < all.size(); ++k) ASSERT_EQ(set.contains(k), all[k]) << n << " " << k;
  }
}

TEST(Sessions, GiveTheSameReplyAgain) {
  Sessions sessions;
  Answered first;
  Answered second;
  Sessions::Call made = call({7, 1}, first);
  ASSERT_FALSE(sessions.admit(made).is_taken);
  made.reply(absl::OkStatus(), reply_at(42));
  Sessions::Call again = call({7, 1}, second);
  EXPECT_TRUE(sessions.admit(again).is_taken);
  EXPECT_EQ(first.reply.applied().tick(), 42u);
  EXPECT_EQ(second.times, 1);
  EXPECT_TRUE(second.status.ok());
  EXPECT_EQ(second.reply.applied().tick(), 42u);
}

TEST(Sessions, GiveAnErrorAgain) {
  Sessions sessions;
  Answered first;
  Answered second;
  Sessions::Call made = call({7, 1}, first);
  ASSERT_FALSE(sessions.admit(made).is_taken);
  made.reply(absl::NotFoundError("no such body"), {});
  Sessions::Call again = call({7, 1}, second);
  EXPECT_TRUE(sessions.admit(again).is_taken);
  EXPECT_EQ(second.status, first.status);
}

TEST(Sessions, WhoAsksAgainMeanwhileWaits) {
  Sessions sessions;
  Answered first;
  std::vector<Answered> later(kCallsAgainMax + 1);
  Sessions::Call made = call({7, 1}, first);
  ASSERT_FALSE(sessions.admit(made).is_taken);
  for (Answered& heard : later) {
    Sessions::Call again = call({7, 1}, heard);
    EXPECT_TRUE(sessions.admit(again).is_taken);
  }
  EXPECT_EQ(later.front().times, 0);
  EXPECT_EQ(later.back().status.code(), kExhausted) << "so many wait, and no more";
  made.reply(absl::OkStatus(), reply_at(42));
  EXPECT_EQ(first.times, 1);
  for (std::size_t n = 0; n < kCallsAgainMax; ++n) {
    EXPECT_EQ(later[n].times, 1);
    EXPECT_EQ(later[n].reply.applied().tick(), 42u);
  }
}

TEST(Sessions, OtherRequestsAndClientsAreOthers) {
  Sessions sessions;
  Answered heard;
  for (const RequestId id : {RequestId{7, 1}, RequestId{7, 2}, RequestId{8, 1}, RequestId{}, RequestId{}}) {
    Sessions::Call made = call(id, heard);
    EXPECT_FALSE(sessions.admit(made).is_taken) << id.session << " " << id.number;
  }
}

TEST(Sessions, RequestsAreCountedFromOne) {
  Sessions sessions;
  Answered heard;
  Sessions::Call made = call({7, 0}, heard);
  EXPECT_TRUE(sessions.admit(made).is_taken);
  EXPECT_EQ(heard.status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(heard.status.message()), HasSubstr("number = 0 must be at least 1"));
}

// As long as the client has not said that it has the reply.
TEST(Sessions, WhatWasAnsweredIsForgottenAndRefused) {
  Sessions sessions;
  std::vector<Sessions::Call> made;
  Answered heard;
  for (std::uint64_t number = 1; number <= 6; ++number) {
    made.push_back(call({7, number}, heard));
    ASSERT_FALSE(sessions.admit(made.back()).is_taken);
  }
  // All but the third, which takes long.
  for (const std::size_t n : {0, 1, 3, 4, 5}) made[n].reply(absl::OkStatus(), reply_at(n + 1));
  Sessions::Call next = call({7, 7}, heard, answered_up_to(2, {5, 4}));
  ASSERT_FALSE(sessions.admit(next).is_taken);
  const auto again = [&](std::uint64_t number) {
    Answered answered;
    Sessions::Call made_again = call({7, number}, answered);
    EXPECT_TRUE(sessions.admit(made_again).is_taken);
    return answered;
  };
  for (const std::uint64_t number : {1, 2, 4, 5}) {
    const Answered refused = again(number);
    EXPECT_EQ(refused.status.code(), kAborted) << number;
    EXPECT_THAT(std::string(refused.status.message()), HasSubstr("made before"));
  }
  EXPECT_EQ(again(6).reply.applied().tick(), 6u) << "the client may not have this reply";
}

// A client that has given up waiting says so, too: nothing of it is kept once it is over.
TEST(Sessions, AReplyThatNobodyWantsIsNotKept) {
  Sessions sessions;
  Answered heard;
  Sessions::Call slow = call({7, 1}, heard);
  ASSERT_FALSE(sessions.admit(slow).is_taken);
  Sessions::Call next = call({7, 2}, heard, answered_up_to(1));
  ASSERT_FALSE(sessions.admit(next).is_taken);
  slow.reply(absl::OkStatus(), reply_at(1));
  Answered late;
  Sessions::Call again = call({7, 1}, late);
  EXPECT_TRUE(sessions.admit(again).is_taken);
  EXPECT_EQ(late.status.code(), kAborted);
}

// A large one without its results, which the client asks for anew.
TEST(Sessions, LargeRepliesAreKeptWithoutResults) {
  Sessions sessions;
  Answered heard;
  Sessions::Call made = call({7, 1}, heard);
  ASSERT_FALSE(sessions.admit(made).is_taken);
  v1::Reply reply = reply_at(42);
  reply.set_tick(43);
  reply.add_results()->mutable_hash()->set_hash(std::string(kKeptReplyBytesMax, 'x'));
  made.reply(absl::OkStatus(), reply);
  EXPECT_EQ(heard.reply.results_size(), 1);
  Answered late;
  Sessions::Call again = call({7, 1}, late);
  EXPECT_TRUE(sessions.admit(again).is_taken);
  EXPECT_EQ(late.reply.applied().tick(), 42u);
  EXPECT_EQ(late.reply.tick(), 43u);
  EXPECT_TRUE(late.reply.results().empty());
}

TEST(Sessions, SoManyRepliesOfAClientAreKept) {
  Sessions sessions;
  Answered heard;
  for (std::uint64_t number = 1; number <= kUnansweredMax; ++number) {
    Sessions::Call made = call({7, number}, heard);
    ASSERT_FALSE(sessions.admit(made).is_taken);
    made.reply(absl::OkStatus(), {});
  }
  Answered refused;
  Sessions::Call more = call({7, kUnansweredMax + 1}, refused);
  EXPECT_TRUE(sessions.admit(more).is_taken);
  EXPECT_EQ(refused.status.code(), kExhausted);
  more = call({7, kUnansweredMax + 1}, heard, answered_up_to(1));
  EXPECT_FALSE(sessions.admit(more).is_taken) << "the client has taken one";
}

TEST(Sessions, ThoseThatHaveNotCalledForLongestAreForgotten) {
  Sessions sessions;
  Answered heard;
  Answered waiting;
  Sessions::Call pending = call({9, 1}, heard);
  ASSERT_FALSE(sessions.admit(pending).is_taken);
  Sessions::Call again = call({9, 1}, waiting);
  EXPECT_TRUE(sessions.admit(again).is_taken);
  for (std::uint64_t session = 100; session < 100 + kSessionsMax; ++session) {
    Sessions::Call made = call({session, 1}, heard);
    ASSERT_FALSE(sessions.admit(made).is_taken);
  }
  EXPECT_EQ(waiting.status.code(), kAborted) << "nobody waits for ever";
  const int before = heard.times;
  pending.reply(absl::OkStatus(), {});
  EXPECT_EQ(heard.times, before + 1) << "whoever made it first is answered in any case";
}

// Of what an earlier coordinator carried out, its commands are not, but there is no reply yet.
TEST(Sessions, WhatIsRememberedIsRepliedToOnce) {
  Sessions sessions;
  v1::Applied applied;
  applied.set_tick(5);
  sessions.remember({7, 3}, applied);
  sessions.remember({0, 0}, applied);
  Answered heard;
  Sessions::Call made = call({7, 3}, heard);
  const Sessions::Admission admission = sessions.admit(made);
  EXPECT_FALSE(admission.is_taken);
  ASSERT_TRUE(admission.carried_out);
  EXPECT_EQ(admission.carried_out->tick(), 5u);
  Answered meanwhile;
  Sessions::Call again = call({7, 3}, meanwhile);
  EXPECT_TRUE(sessions.admit(again).is_taken);
  made.reply(absl::OkStatus(), reply_at(5));
  EXPECT_EQ(heard.times, 1);
  EXPECT_EQ(meanwhile.reply.applied().tick(), 5u);
  Sessions::Call other = call({7, 4}, heard, answered_up_to(3));
  EXPECT_FALSE(sessions.admit(other).carried_out);
  Answered late;
  Sessions::Call too_late = call({7, 3}, late);
  EXPECT_TRUE(sessions.admit(too_late).is_taken);
  EXPECT_EQ(late.status.code(), kAborted);
}

// Those that were made last are the ones that may be made again.
TEST(Sessions, OfManyThatAreRememberedTheLastOnesCount) {
  Sessions sessions;
  v1::Applied applied;
  for (std::uint64_t number = 1; number <= kUnansweredMax + 2; ++number) {
    applied.set_tick(number);
    sessions.remember({7, number}, applied);
  }
  Answered refused;
  Sessions::Call first = call({7, 2}, refused);
  EXPECT_TRUE(sessions.admit(first).is_taken);
  EXPECT_EQ(refused.status.code(), kAborted) << "it is not carried out twice";
  Answered heard;
  Sessions::Call last = call({7, kUnansweredMax + 2}, heard);
  EXPECT_EQ(sessions.admit(last).carried_out->tick(), kUnansweredMax + 2);
  last.reply(absl::OkStatus(), {});
  Sessions::Call next = call({7, kUnansweredMax + 3}, heard, answered_up_to(kUnansweredMax + 1));
  EXPECT_FALSE(sessions.admit(next).is_taken) << "what it has the replies to takes no room";
}

// The whole coordinator: a body is spawned once.
TEST(Sessions, ACommandThatIsGivenAgainRunsOnce) {
  const auto cluster = loaded_cluster();
  for (int time = 0; time < 3; ++time) {
    const auto heard = cluster->apply(spawn("new"), {7, 1});
    ASSERT_TRUE(heard->ok()) << heard->message();
    EXPECT_EQ(heard->answer.applied().created(0).first_body(), 5u);
  }
  EXPECT_EQ(cluster->status().bodies(), 5u);
}

// A step that takes long is waited for by both.
TEST(Sessions, TicksThatAreAskedForAgainRunOnce) {
  const auto cluster = loaded_cluster();
  const v1::Request request = request_of({}, 5, {hash_query()});
  const auto first = cluster->send(request, {7, 1});
  const auto again = cluster->send(request, {7, 1});
  EXPECT_FALSE(first->status || again->status);
  cluster->work_all();
  EXPECT_TRUE(first->ok()) << first->message();
  EXPECT_TRUE(again->ok()) << again->message();
  EXPECT_EQ(again->answer.results(0).hash().hash(), first->answer.results(0).hash().hash());
  EXPECT_EQ(cluster->status().tick(), 5u);
}

// They change nothing, so they are answered anew.
TEST(Sessions, QueriesThatAreMadeAgainAreAskedAgain) {
  const auto cluster = loaded_cluster();
  const v1::Request request = request_of({}, 0, {hash_query()});
  const auto first = cluster->send(request, {7, 1});
  cluster->work_all();
  cluster->step(3);
  cluster->work_all();
  const auto again = cluster->send(request, {7, 1});
  cluster->work_all();
  ASSERT_TRUE(first->ok() && again->ok());
  EXPECT_EQ(first->answer.tick(), 0u);
  EXPECT_EQ(again->answer.tick(), 3u);
}

// What a client has is said by requests of any kind.
TEST(Sessions, RequestsOfQueriesTellWhatIsAnswered) {
  const auto cluster = loaded_cluster();
  ASSERT_TRUE(cluster->apply(push("ball"), {7, 1})->ok());
  v1::Request request = answered_up_to(0, {1});
  request.mutable_queries()->Add()->mutable_find_bodies();
  ASSERT_TRUE(cluster->send(request, {7, 2})->ok());
  EXPECT_EQ(cluster->apply(push("ball"), {7, 1})->code(), kAborted);
}

}  // namespace
}  // namespace tessera
