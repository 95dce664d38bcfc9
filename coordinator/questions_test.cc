#include "coordinator/questions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/limits.h"
#include "coordinator/test_cluster.h"
#include "lpss/observe/world_hash.h"

namespace tessera {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

v1::Answer answer_to(const v1::Question& question, std::uint64_t hash) {
  v1::Answer answer;
  answer.set_question(question.id());
  answer.set_tick(7);
  answer.add_results()->set_hash_low(hash);
  return answer;
}

class QuestionsTest : public ::testing::Test {
 protected:
  v1::Question ask_hash() {
    const v1::Request request = request_of({}, 0, {hash_query()});
    return questions_.queries(AskedQueries::checked(request.queries(), world_).value(),
                              [this](const absl::Status& status, Tick tick, AskedQueries& queries) {
                                if (!status.ok()) return answers_.push_back(std::string(status.message()));
                                EXPECT_EQ(tick, 7u);
                                answers_.push_back(queries.results(world_).value()[0].hash().hash());
                              });
  }

  WorldRegistry world_ = registry_of(small_world());
  Questions questions_;
  std::vector<std::string> answers_;
};

TEST_F(QuestionsTest, AllServersAnswerOnce) {
  const v1::Question question = ask_hash();
  questions_.asked(question.id(), std::vector{kFirst, kSecond});
  EXPECT_TRUE(questions_.answer(kSecond, answer_to(question, 1)).ok());
  EXPECT_FALSE(questions_.answer(kSecond, answer_to(question, 1)).ok());
  EXPECT_THAT(answers_, IsEmpty());
  EXPECT_TRUE(questions_.answer(kFirst, answer_to(question, 2)).ok());
  EXPECT_THAT(answers_, SizeIs(1));
  EXPECT_FALSE(questions_.answer(kFirst, answer_to(question, 2)).ok());
}

// The sequence still has the one that was not asked, and would ask it twice.
TEST_F(QuestionsTest, AWorldThatGoesBackAsksAgainWhatItHasAsked) {
  const v1::Question asked = ask_hash();
  const v1::Question waiting = ask_hash();
  questions_.asked(asked.id(), std::vector{kFirst, kSecond});
  const std::vector<v1::Question> again = questions_.restart(absl::UnavailableError("set back"));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again.front().id(), asked.id());
  EXPECT_THAT(questions_.restart(absl::UnavailableError("set back")), IsEmpty());
  for (const v1::Question& question : {asked, waiting}) {
    questions_.asked(question.id(), std::vector{kFirst});
    EXPECT_TRUE(questions_.answer(kFirst, answer_to(question, 1)).ok());
  }
  EXPECT_THAT(answers_, ::testing::ElementsAre(WorldHash(1, 0).to_string(), WorldHash(1, 0).to_string()));
}

// It would be taken for an answer to other queries.
TEST_F(QuestionsTest, AnAnswerToSoManyQueriesIsToAsMany) {
  const v1::Question question = ask_hash();
  questions_.asked(question.id(), std::vector{kFirst});
  v1::Answer two = answer_to(question, 1);
  two.add_results();
  EXPECT_EQ(questions_.answer(kFirst, two).code(), absl::StatusCode::kInternal);
  two.clear_results();
  EXPECT_EQ(questions_.answer(kFirst, two).code(), absl::StatusCode::kInternal);
  EXPECT_THAT(answers_, IsEmpty());
  EXPECT_TRUE(questions_.answer(kFirst, answer_to(question, 1)).ok());
  EXPECT_THAT(answers_, SizeIs(1));
}

// What a server has answered before the world goes back does not count.
TEST_F(QuestionsTest, AWorldThatGoesBackForgetsAnswers) {
  const v1::Question question = ask_hash();
  questions_.asked(question.id(), std::vector{kFirst, kSecond});
  EXPECT_TRUE(questions_.answer(kFirst, answer_to(question, 100)).ok());
  EXPECT_THAT(questions_.restart(absl::UnavailableError("set back")), SizeIs(1));
  questions_.asked(question.id(), std::vector{kFirst, kSecond});
  EXPECT_TRUE(questions_.answer(kFirst, answer_to(question, 1)).ok());
  EXPECT_TRUE(questions_.answer(kSecond, answer_to(question, 2)).ok());
  EXPECT_THAT(answers_, ::testing::ElementsAre(WorldHash(3, 0).to_string()));
}

TEST_F(QuestionsTest, AreBoundedAndAllAnsweredInTheEnd) {
  for (std::size_t n = 0; n < kOpenQuestionsMax; ++n) {
    ASSERT_TRUE(questions_.room().ok());
    ask_hash();
  }
  EXPECT_EQ(questions_.room().code(), absl::StatusCode::kResourceExhausted);
  questions_.abandon(absl::UnavailableError("it is over"));
  EXPECT_THAT(answers_, SizeIs(kOpenQuestionsMax));
  EXPECT_THAT(answers_, ::testing::Each("it is over"));
  EXPECT_TRUE(questions_.room().ok());
}

}  // namespace
}  // namespace tessera
