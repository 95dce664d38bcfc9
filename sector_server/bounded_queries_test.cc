// Queries that may take only so much of a server between two ticks.
#include "proto/ray_columns.h"
#include "sector_server/test_server.h"

namespace tessera {
namespace {

using Kind = v1::ClusterMessage::KindCase;
using std::chrono::milliseconds;

// A server by whose clock each look takes a millisecond.
class SlowServer : public testing::Test {
 protected:
  SlowServer()
      : machine_(
            SectorServerOptions(), load_engine, [this] { return now_ += milliseconds(1); },
            [](Tick, TickMachine&) {}) {
    machine_.start(kFirst, now_);
    v1::ClusterMessage message;
    message.mutable_welcome()->set_heartbeat_ms(500);
    machine_.receive(kCoordinatorNode, message, now_);
    *message.mutable_load_world() = loads_of(small_tower(), {kFirst})[0];
    machine_.receive(kCoordinatorNode, message, now_);
  }

  // Of a grant of so many ticks, with questions of so many hashes each after them.
  std::vector<v1::Answer> ask(std::uint64_t ticks, const std::vector<int>& hashes, std::uint64_t work_us_max,
                              std::uint64_t bytes_max = 0) {
    std::vector<v1::Queries> all;
    for (const int count : hashes) {
      v1::Queries& queries = all.emplace_back();
      queries.set_work_us_max(work_us_max);
      queries.set_bytes_max(bytes_max);
      for (int n = 0; n < count; ++n) queries.add_all()->mutable_hash();
    }
    return ask(ticks, all);
  }

  std::vector<v1::Answer> ask(std::uint64_t ticks, const std::vector<v1::Queries>& all) {
    v1::ClusterMessage message;
    v1::Grant& grant = *message.mutable_grant() = grant_of(++serial_, ticks);
    for (const v1::Queries& queries : all) *grant.add_questions()->mutable_queries() = queries;
    machine_.receive(kCoordinatorNode, message, now_);
    while (machine_.work_left()) machine_.proceed(now_);
    std::vector<v1::Answer> answers;
    for (const SectorServer::Outgoing& out : machine_.take_messages()) {
      EXPECT_TRUE(message.ParseFromString(out.payload));
      if (message.has_answer()) answers.push_back(message.answer());
    }
    return answers;
  }

  Nanoseconds now_{1'000'000'000};
  SectorServer machine_;
  std::uint64_t serial_ = 0;
};

TEST_F(SlowServer, SaysHowLongQueriesTook) {
  const std::vector<v1::Answer> answers = ask(0, {3}, 0);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].results_size(), 3);
  EXPECT_EQ(answers[0].work_us(), 3000u);
}

TEST_F(SlowServer, AnswersWithinTheBoundAndNothingBeyond) {
  std::vector<v1::Answer> answers = ask(1, {4, 1}, 5000);
  ASSERT_EQ(answers.size(), 2u);
  for (const v1::Answer& answer : answers) EXPECT_EQ(answer.excess(), v1::Answer::NONE);
  answers = ask(1, {6}, 5000);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].excess(), v1::Answer::WORK);
  EXPECT_EQ(answers[0].results_size(), 0);
  EXPECT_EQ(answers[0].work_us(), 5000u) << "it stops there";
}

// Of however many clients.
TEST_F(SlowServer, QuestionsShareTheBoundUntilTheNextTick) {
  std::vector<v1::Answer> answers = ask(1, {3, 3, 1}, 5000);
  ASSERT_EQ(answers.size(), 3u);
  EXPECT_EQ(answers[0].excess(), v1::Answer::NONE);
  EXPECT_EQ(answers[1].excess(), v1::Answer::WORK);
  EXPECT_EQ(answers[2].excess(), v1::Answer::WORK);
  answers = ask(0, {1}, 5000);
  EXPECT_EQ(answers.at(0).excess(), v1::Answer::WORK);
  answers = ask(0, {1}, 0);
  EXPECT_EQ(answers.at(0).results_size(), 1) << "others have no bound";
  answers = ask(1, {3}, 5000);
  EXPECT_EQ(answers.at(0).results_size(), 3);
}

TEST_F(SlowServer, OneQueryIsAnsweredHoweverLongItTakes) {
  const std::vector<v1::Answer> answers = ask(1, {1}, 500);
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].results_size(), 1);
  EXPECT_EQ(answers[0].work_us(), 1000u);
}

// Rays in columns are many: it looks at the clock among them.
TEST_F(SlowServer, OfRaysInColumnsNoMoreIsAnsweredThanThereIsTimeFor) {
  const auto answer_to = [this](int rays, std::uint64_t work_us_max) {
    v1::Queries queries;
    queries.set_work_us_max(work_us_max);
    RayWriter writer(*queries.add_all()->mutable_rays());
    for (int n = 0; n < rays; ++n) writer.add({{{0, 0, 1}, {0, 0, 12}}, {0, 0, -1}, 5, {}});
    return ask(1, std::vector<v1::Queries>{queries}).at(0);
  };
  v1::Answer answer = answer_to(100, 0);
  EXPECT_EQ(answer.results(0).result().rays().bodies_size(), 100);
  answer = answer_to(1, 500);
  EXPECT_EQ(answer.results(0).result().rays().bodies_size(), 1) << "one is answered, at least";
  answer = answer_to(100, 3000);
  EXPECT_EQ(answer.excess(), v1::Answer::WORK);
  EXPECT_EQ(answer.results_size(), 0);
  EXPECT_EQ(answer.work_us(), 3000u) << "it stops there";
}

TEST_F(SlowServer, ResultsHaveABoundInBytes) {
  EXPECT_EQ(ask(0, {4}, 0, 1000).at(0).results_size(), 4);
  const std::vector<v1::Answer> answers = ask(0, {4}, 0, 20);
  EXPECT_EQ(answers.at(0).excess(), v1::Answer::BYTES);
  EXPECT_EQ(answers.at(0).results_size(), 0);
}

}  // namespace
}  // namespace tessera
