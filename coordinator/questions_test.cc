#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/queries.h"
#include "coordinator/test_cluster.h"

namespace tessera {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

v1::Answer answer_to(const v1::Query& query, std::uint64_t hash) {
  v1::Answer answer;
  answer.set_query(query.id());
  answer.set_tick(7);
  answer.set_hash_low(hash);
  return answer;
}

class QueriesTest : public ::testing::Test {
 protected:
  v1::Query ask_hash() {
    return queries_.hash([this](const absl::Status& status, Tick, const WorldHash& hash) {
      answers_.push_back(status.ok() ? hash.to_string() : std::string(status.message()));
    });
  }

  Queries queries_;
  std::vector<std::string> answers_;
};

TEST_F(QueriesTest, AllServersAnswerOnce) {
  const v1::Query query = ask_hash();
  queries_.asked(query.id(), std::vector{kFirst, kSecond});
  EXPECT_TRUE(queries_.answer(kSecond, answer_to(query, 1)).ok());
  EXPECT_FALSE(queries_.answer(kSecond, answer_to(query, 1)).ok());
  EXPECT_THAT(answers_, IsEmpty());
  EXPECT_TRUE(queries_.answer(kFirst, answer_to(query, 2)).ok());
  EXPECT_THAT(answers_, SizeIs(1));
  EXPECT_FALSE(queries_.answer(kFirst, answer_to(query, 2)).ok());
}

// The sequence still has the one that was not asked, and would ask it twice.
TEST_F(QueriesTest, AWorldThatGoesBackAsksAgainWhatItHasAsked) {
  const v1::Query asked = ask_hash();
  const v1::Query waiting = ask_hash();
  queries_.asked(asked.id(), std::vector{kFirst, kSecond});
  const std::vector<v1::Query> again = queries_.restart(absl::UnavailableError("set back"));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again.front().id(), asked.id());
  EXPECT_THAT(queries_.restart(absl::UnavailableError("set back")), IsEmpty());
  for (const v1::Query& query : {asked, waiting}) {
    queries_.asked(query.id(), std::vector{kFirst});
    EXPECT_TRUE(queries_.answer(kFirst, answer_to(query, 1)).ok());
  }
  EXPECT_THAT(answers_, SizeIs(2));
}

}  // namespace
}  // namespace tessera
