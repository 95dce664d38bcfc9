#include "coordinator/link_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr NodeId kNear{10};
constexpr NodeId kFar{20};
constexpr NodeId kThird{30};

class LinkWatchTest : public ::testing::Test {
 protected:
  // `from` misses `node`, which the network does not see either, unless it `is_seen`.
  void report(NodeId from, std::optional<NodeId> node = {}, milliseconds waited = {}, bool is_seen = false) {
    std::vector<v1::Unheard> unheard;
    if (node) {
      unheard.emplace_back().set_node(node->value);
      unheard.back().set_waited_ms(static_cast<std::uint64_t>(waited.count()));
      unheard.back().set_silent(!is_seen);
    }
    watch_.on_report(from, unheard, now_);
  }

  // Who is dropped, at the moment when that is decided.
  std::vector<NodeId> dropped() {
    now_ += seconds(1);
    std::vector<NodeId> nodes;
    for (const LinkWatch::Dropped& one : watch_.take_dropped(now_)) nodes.push_back(one.node);
    return nodes;
  }

  LinkWatch::Nanoseconds now_{};
  LinkWatch watch_{seconds(1), seconds(10)};
};

TEST_F(LinkWatchTest, ACutIsFoundByWhatBothReport) {
  for (int ms = 250; ms <= 1000; ms += 250) {
    EXPECT_THAT(dropped(), IsEmpty()) << ms;
    report(kNear, kFar, milliseconds(ms));
    report(kFar, kNear, milliseconds(ms));
  }
  ASSERT_TRUE(watch_.next_deadline());
  EXPECT_LE(*watch_.next_deadline(), now_ + milliseconds(250));
  EXPECT_TRUE(watch_.is_doubtful(kNear));
  EXPECT_TRUE(watch_.is_doubtful(kFar));
  now_ += seconds(1);
  const std::vector<LinkWatch::Dropped> dropped = watch_.take_dropped(now_);
  ASSERT_EQ(dropped.size(), 1u);
  EXPECT_EQ(dropped[0].node, kFar);
  EXPECT_THAT(dropped[0].unheard_by, ElementsAre(kNear));
  EXPECT_EQ(dropped[0].waited, seconds(1));
  EXPECT_EQ(watch_.next_deadline(), std::nullopt);
}

TEST_F(LinkWatchTest, AServerThatComputesIsWaitedFor) {
  for (int ms = 250; ms <= 100'000; ms += 250) report(kNear, kFar, milliseconds(ms));
  EXPECT_THAT(dropped(), IsEmpty()) << "it has said nothing to anybody";
  EXPECT_FALSE(watch_.is_doubtful(kFar));
  report(kFar);
  report(kNear, kFar, milliseconds(100'250));
  EXPECT_THAT(dropped(), IsEmpty()) << "its answer is on its way";
  report(kNear);
  report(kFar);
  EXPECT_THAT(dropped(), IsEmpty());
}

TEST_F(LinkWatchTest, OneThatReportsAndDoesNotAnswerIsCutOff) {
  report(kNear, kFar, milliseconds(250));
  report(kFar);
  report(kNear, kFar, milliseconds(750));
  EXPECT_THAT(dropped(), IsEmpty()) << "not for long enough";
  report(kNear, kFar, milliseconds(1000));
  EXPECT_THAT(dropped(), ElementsAre(kFar));
}

TEST_F(LinkWatchTest, ALongMessageMayBeOnItsWay) {
  report(kNear, kFar, milliseconds(250), /*is_seen=*/true);
  report(kFar);
  report(kNear, kFar, milliseconds(9750), /*is_seen=*/true);
  EXPECT_THAT(dropped(), IsEmpty());
  report(kNear, kFar, milliseconds(10'000), /*is_seen=*/true);
  EXPECT_THAT(dropped(), ElementsAre(kFar));
}

TEST_F(LinkWatchTest, WhatIsHeardBeforeItIsDecidedCounts) {
  report(kNear, kFar, milliseconds(250));
  report(kFar);
  report(kNear, kFar, milliseconds(1000));
  ASSERT_TRUE(watch_.next_deadline());
  report(kNear);
  EXPECT_THAT(dropped(), IsEmpty());
}

TEST_F(LinkWatchTest, OneDecisionIsForAllThatWait) {
  for (const NodeId node : {kNear, kFar}) report(node, kThird, milliseconds(250));
  report(kThird, kNear, milliseconds(250));
  report(kNear, kThird, milliseconds(1000));  // the first of them
  report(kFar, kThird, milliseconds(750));
  EXPECT_THAT(dropped(), ElementsAre(kThird));
  report(kFar, kThird, milliseconds(1000));
  EXPECT_TRUE(watch_.next_deadline()) << "nobody has restarted the world";
  watch_.restart();
  EXPECT_FALSE(watch_.next_deadline());
}

TEST_F(LinkWatchTest, ThoseThatAreCutOffStayApartUntilTheyHaveMet) {
  report(kNear, kFar, milliseconds(250));
  report(kFar);
  report(kNear, kFar, milliseconds(1000));
  EXPECT_THAT(dropped(), ElementsAre(kFar));
  watch_.restart();
  EXPECT_THAT(watch_.apart({kNear, kFar, kThird}), ElementsAre(kFar));
  EXPECT_THAT(watch_.apart({kFar, kThird}), IsEmpty());
  watch_.have_met(kFar, {kThird});
  EXPECT_THAT(watch_.apart({kNear, kFar, kThird}), ElementsAre(kFar));
  watch_.have_met(kFar, {kNear, kThird});
  EXPECT_THAT(watch_.apart({kNear, kFar, kThird}), IsEmpty());
}

}  // namespace
}  // namespace tessera
