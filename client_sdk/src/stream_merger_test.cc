#include "client_sdk/src/stream_merger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "client_sdk/src/body_news.h"

namespace tessera {
namespace {

constexpr absl::Duration kNow = absl::ZeroDuration();
constexpr absl::Duration kPatience = absl::Seconds(30);

PartOrigin server(std::uint64_t node, std::size_t servers, std::uint64_t epoch = 1) {
  return {.load = 1, .epoch = epoch, .servers = servers, .node = node};
}

BodyNews part(Tick tick, const std::vector<std::uint64_t>& ids) {
  BodyNews frame;
  frame.tick = tick;
  for (const std::uint64_t id : ids) frame.bodies.emplace_back().id = BodyId{id};
  return frame;
}

std::vector<std::uint64_t> ids(const BodyNews& frame) {
  std::vector<std::uint64_t> result;
  for (const BodySample& body : frame.bodies) result.push_back(body.id.value);
  return result;
}

TEST(StreamMergerTest, TickIsCompleteWhenAllHaveToldOfIt) {
  StreamMerger<BodyNews> merger;
  merger.push(server(0, 2), part(1, {2, 5}));
  merger.push(server(0, 2), part(2, {2}));
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.next(kNow).status()));
  merger.push(server(1, 2), part(1, {3}));
  const BodyNews frame = merger.next(kNow).value();
  EXPECT_EQ(frame.tick, 1u);
  EXPECT_EQ(ids(frame), (std::vector<std::uint64_t>{2, 3, 5}));
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.next(kNow).status()));
  merger.push(server(1, 2), part(2, {3, 5}));
  EXPECT_EQ(ids(merger.next(kNow).value()), (std::vector<std::uint64_t>{2, 3, 5}));
  EXPECT_EQ(merger.skipped(), 0u);
}

// A stream begins while sectors change servers, between two ticks: what one server told before the change
// does not fit to what another one tells after it, and is told again.
TEST(StreamMergerTest, WhatWasToldBeforeSectorsMovedDoesNotCount) {
  StreamMerger<BodyNews> merger;
  const auto since = [](std::uint64_t node, Tick tick) {
    PartOrigin origin = server(node, 2);
    origin.since = tick;
    return origin;
  };
  const auto whole = [](std::uint64_t node, Tick tick, const std::vector<std::uint64_t>& ids) {
    BodyNews news = part(tick, ids);
    news.servers = news.whole = {node};
    return news;
  };
  merger.push(since(0, 0), whole(0, 4, {1}));  // 2 is about to come here
  merger.push(since(1, 5), whole(1, 4, {3}));
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.next(kNow).status()));
  merger.push(since(0, 5), whole(0, 4, {1, 2}));
  const BodyNews frame = merger.next(kNow).value();
  EXPECT_EQ(frame.tick, 4u);
  EXPECT_EQ(ids(frame), (std::vector<std::uint64_t>{1, 2, 3}));
  merger.push(since(0, 5), part(5, {1}));
  merger.push(since(1, 5), part(5, {3}));
  EXPECT_EQ(merger.next(kNow)->tick, 5u);
}

// Whoever was told of the tick before the change gets it once.
TEST(StreamMergerTest, ATickThatIsToldAgainComesOnce) {
  StreamMerger<BodyNews> merger;
  PartOrigin origin = server(0, 1);
  merger.push(origin, part(4, {1}));
  EXPECT_EQ(merger.next(kNow)->tick, 4u);
  origin.since = 5;
  merger.push(origin, part(4, {1, 2}));
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.next(kNow).status()));
  merger.push(origin, part(5, {1}));
  const BodyNews frame = merger.next(kNow).value();
  EXPECT_EQ(frame.tick, 5u);
  EXPECT_EQ(ids(frame), (std::vector<std::uint64_t>{1, 2}));
}

TEST(StreamMergerTest, TicksThatNotAllTellOfAreLeftOut) {
  StreamMerger<BodyNews> merger;
  for (const Tick tick : {3, 4, 6}) merger.push(server(0, 2), part(tick, {1}));
  for (const Tick tick : {4, 5, 6}) merger.push(server(1, 2), part(tick, {2}));
  EXPECT_EQ(merger.next(kNow)->tick, 4u);
  EXPECT_EQ(merger.next(kNow)->tick, 6u);
  EXPECT_EQ(merger.skipped(), 2u);
}

// The server that has lost a body tells of it late, since what it told before was left out.
TEST(StreamMergerTest, OfAProgramToldTwiceTheLaterSampleCounts) {
  StreamMerger<ProgramFrame> merger;
  const auto told = [](Tick tick, std::vector<double> values) {
    return ProgramFrame{tick,
                        {{.body = BodyId{3}, .kind = "imu", .values = std::move(values), .tick = tick}}};
  };
  merger.push(server(0, 2), told(1, {0.5}));  // left out: the other one tells nothing of it
  merger.push(server(0, 2), {2, {}});
  merger.push(server(1, 2), told(2, {0.25}));
  const ProgramFrame frame = merger.next(kNow).value();
  ASSERT_EQ(frame.programs.size(), 1u);
  EXPECT_EQ(frame.programs[0].values, std::vector<double>{0.25});
}

TEST(StreamMergerTest, WhatOfProgramsWasLeftOutComesLater) {
  StreamMerger<ProgramFrame> merger;
  merger.push(server(0, 2),
              {1, {{.body = BodyId{3}, .values = {1}, .tick = 1}, {.body = BodyId{5}, .tick = 1}}});
  merger.push(server(0, 2), {2, {{.body = BodyId{3}, .values = {2}, .tick = 2}}});
  merger.push(server(1, 2), {2, {}});
  const ProgramFrame frame = merger.next(kNow).value();
  ASSERT_EQ(frame.programs.size(), 2u);
  EXPECT_EQ(frame.programs[0].values, std::vector<double>{2});
  EXPECT_EQ(frame.programs[1].body, BodyId{5});
}

// The end comes from the server that had the two bodies, the begin from the one that has them now.
TEST(StreamMergerTest, AContactEndsBeforeItBeginsAnew) {
  StreamMerger<ContactFrame> merger;
  const auto contact = [](ContactPhase phase) {
    ContactSample sample;
    sample.phase = phase;
    sample.a = BodyId{1};
    sample.b = BodyId{2};
    return ContactFrame{1, {sample}};
  };
  merger.push(server(0, 2), contact(ContactPhase::kBegin));
  merger.push(server(1, 2), contact(ContactPhase::kEnd));
  const ContactFrame frame = merger.next(kNow).value();
  ASSERT_EQ(frame.contacts.size(), 2u);
  EXPECT_EQ(frame.contacts[0].phase, ContactPhase::kEnd);
  EXPECT_EQ(frame.contacts[1].phase, ContactPhase::kBegin);
}

TEST(StreamMergerTest, PartsOfAnIslandBecomeOne) {
  StreamMerger<SeamFrame> merger;
  merger.push(
      server(0, 2),
      SeamFrame{1, {{BodyId{9}, {1, 0, 0}, 7}}, {{BodyId{2}, {BodyId{5}}}, {BodyId{3}, {BodyId{3}}}}});
  merger.push(server(1, 2), SeamFrame{1, {{BodyId{4}, {0, 0, 0}, 8}}, {{BodyId{2}, {BodyId{2}, BodyId{8}}}}});
  const SeamFrame frame = merger.next(kNow).value();
  ASSERT_EQ(frame.clones.size(), 2u);
  EXPECT_EQ(frame.clones[0].body, BodyId{4});
  ASSERT_EQ(frame.islands.size(), 2u);
  EXPECT_EQ(frame.islands[0].bodies, (std::vector<BodyId>{{2}, {5}, {8}}));
  EXPECT_EQ(frame.islands[1].bodies, std::vector<BodyId>{BodyId{3}});
}

TEST(StreamMergerTest, PartThatNobodyVouchesForMakesAnEmptyFrame) {
  StreamMerger<BodyNews> merger;
  merger.push(server(0, 2), part(3, {}), false);
  merger.push(server(0, 2), part(4, {1}));
  merger.push(server(1, 2), part(4, {}), false);
  const BodyNews frame = merger.next(kNow).value();
  EXPECT_EQ(frame.tick, 4u);
  EXPECT_TRUE(frame.bodies.empty());
}

TEST(StreamMergerTest, WholeTicksAreReadBeforeTheEnd) {
  StreamMerger<BodyNews> merger;
  merger.push(server(0, 1), part(1, {1}));
  merger.end(absl::UnavailableError("server b is gone"));
  merger.end(absl::CancelledError("later"));
  EXPECT_FALSE(merger.push(server(0, 1), part(2, {1})));
  EXPECT_EQ(merger.next(kNow)->tick, 1u);
  EXPECT_EQ(merger.next(kNow).status(), absl::UnavailableError("server b is gone"));
}

TEST(StreamMergerTest, AnotherWorldEndsTheStream) {
  StreamMerger<BodyNews> merger;
  merger.push(server(0, 1), part(7, {1}));
  PartOrigin other = server(0, 1, 2);
  other.load = 2;
  EXPECT_FALSE(merger.push(other, part(0, {1})));
  EXPECT_EQ(merger.next(kNow)->tick, 7u);
  EXPECT_TRUE(absl::IsAborted(merger.next(kNow).status()));
}

// Server 0 is lost after it told of tick 2: what server 1 alone told is void, and comes again.
TEST(StreamMergerTest, EachTickIsReadOnceWhereTheWorldIsSetBack) {
  StreamMerger<BodyNews> merger;
  for (const Tick tick : {1, 2}) merger.push(server(0, 2), part(tick, {1}));
  for (const Tick tick : {1, 2, 3, 4}) merger.push(server(1, 2), part(tick, {2}));
  EXPECT_EQ(merger.next(kNow)->tick, 1u);
  for (const Tick tick : {0, 1, 2, 3}) merger.push(server(1, 1, 2), part(tick, {1, 2}));
  merger.push(server(0, 2), part(3, {1}));  // from the lost server, late
  EXPECT_EQ(merger.next(kNow)->tick, 2u);
  const BodyNews frame = merger.next(kNow).value();
  EXPECT_EQ(frame.tick, 3u);
  EXPECT_EQ(ids(frame), (std::vector<std::uint64_t>{1, 2}));
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.next(kNow).status()));
  merger.push(server(1, 1, 2), part(4, {1, 2}));
  EXPECT_EQ(merger.next(kNow)->tick, 4u);
  EXPECT_EQ(merger.skipped(), 0u);
}

TEST(StreamMergerTest, AServerThatJoinsIsWaitedFor) {
  StreamMerger<BodyNews> merger;
  for (const Tick tick : {1, 2}) merger.push(server(0, 1), part(tick, {1, 2}));
  merger.push(server(0, 2, 2), part(2, {1}));
  merger.push(server(0, 2, 2), part(3, {1}));
  EXPECT_EQ(merger.next(kNow)->tick, 1u);
  EXPECT_EQ(merger.next(kNow)->tick, 2u);
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.next(kNow).status()));
  merger.push(server(5, 2, 2), part(2, {2}), false);
  merger.push(server(5, 2, 2), part(3, {2}));
  EXPECT_EQ(ids(merger.next(kNow).value()), (std::vector<std::uint64_t>{1, 2}));
  EXPECT_EQ(merger.skipped(), 0u);
}

PartOrigin since(std::uint64_t node, std::size_t servers, Tick tick) {
  return {.load = 1, .epoch = 1, .servers = servers, .node = node, .since = tick};
}

// Whatever overtakes what.
TEST(StreamMergerTest, TicksAreThoseOfTheServersThatTakePartInThem) {
  StreamMerger<BodyNews> merger;
  for (const Tick tick : {1, 2}) merger.push(since(0, 2, 0), part(tick, {1}));
  merger.push(since(1, 2, 0), part(1, {2}));
  EXPECT_EQ(merger.next(kNow)->tick, 1u);
  // From tick 3 on with another one, from tick 5 on without the second.
  for (const Tick tick : {3, 4}) merger.push(since(0, 3, 3), part(tick, {1}));
  for (const Tick tick : {5, 6}) merger.push(since(0, 2, 5), part(tick, {1}));
  merger.push(since(9, 3, 3), part(2, {}), false);  // what it began with
  for (const Tick tick : {3, 4}) merger.push(since(9, 3, 3), part(tick, {3}));
  merger.push(since(9, 2, 5), part(5, {2, 3}));
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.next(kNow).status())) << "the second is late with tick 2";
  merger.push(since(1, 2, 0), part(2, {2}));
  EXPECT_EQ(ids(merger.next(kNow).value()), (std::vector<std::uint64_t>{1, 2}));
  merger.push(since(1, 3, 3), part(3, {2}));
  EXPECT_EQ(ids(merger.next(kNow).value()), (std::vector<std::uint64_t>{1, 2, 3}));
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.next(kNow).status())) << "it has yet to tell of tick 4";
  merger.push(since(1, 3, 3), part(4, {2}));
  merger.ended(1);
  EXPECT_EQ(ids(merger.next(kNow).value()), (std::vector<std::uint64_t>{1, 2, 3}));
  EXPECT_EQ(merger.next(kNow)->tick, 5u);
  EXPECT_EQ(merger.skipped(), 0u);
}

TEST(StreamMergerTest, WhatAServerDoesNotTellAnyMoreIsLeftOut) {
  StreamMerger<BodyNews> merger;
  for (const Tick tick : {1, 2}) merger.push(since(0, 2, 0), part(tick, {1}));
  merger.push(since(1, 2, 0), part(1, {2}));
  merger.push(since(0, 1, 3), part(3, {1, 2}));
  EXPECT_EQ(merger.next(kNow)->tick, 1u);
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.next(kNow).status()));
  merger.ended(1);
  EXPECT_EQ(merger.next(kNow)->tick, 3u);
  EXPECT_EQ(merger.skipped(), 1u);
}

// After the loss of everything, servers join one after the other: the second is not watched yet when it
// joins.
TEST(StreamMergerTest, AServerThatDidNotTellOfItsFirstPeriodHoldsNothingUp) {
  StreamMerger<BodyNews> merger;
  for (const Tick tick : {1, 2}) merger.push(since(0, 1, 0), part(tick, {1}));
  for (const Tick tick : {3, 4}) merger.push(since(0, 2, 3), part(tick, {1}));
  for (const Tick tick : {5, 6}) merger.push(since(0, 3, 5), part(tick, {1}));
  merger.push(since(8, 3, 5), part(5, {2}));
  merger.push(since(9, 3, 5), part(5, {3}));
  EXPECT_EQ(merger.next(kNow)->tick, 1u);
  EXPECT_EQ(merger.next(kNow)->tick, 2u);
  const absl::StatusOr<BodyNews> frame = merger.next(kNow);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->tick, 5u);
  EXPECT_EQ(ids(*frame), (std::vector<std::uint64_t>{1, 2, 3}));
  EXPECT_EQ(merger.skipped(), 2u);
}

TEST(StreamMergerTest, AllSourcesMustAnswer) {
  StreamMerger<BodyNews> merger;
  merger.push(server(0, 2), part(1, {}));
  EXPECT_TRUE(absl::IsDeadlineExceeded(merger.wait_for_all(kNow)));
  merger.push(server(1, 2), part(9, {}));
  EXPECT_TRUE(merger.wait_for_all(kNow).ok());
}

// Sources on threads of their own, far more ticks than the queue holds, a body that changes its source.
TEST(StreamMergerTest, NothingIsLostOrDoubledUnderLoad) {
  constexpr Tick kTicks = 20 * kFramesQueuedMax;
  constexpr std::size_t kSources = 4;
  StreamMerger<BodyNews> merger;
  std::vector<std::thread> sources;
  for (std::size_t source = 0; source < kSources; ++source) {
    sources.emplace_back([&merger, source] {
      for (Tick tick = 1; tick <= kTicks; ++tick) {
        std::vector<std::uint64_t> bodies;
        if (tick / 7 % kSources == source) bodies.push_back(1);
        bodies.push_back(100 + source);
        EXPECT_TRUE(merger.push(server(source, kSources), part(tick, bodies)));
      }
    });
  }
  for (Tick tick = 1; tick <= kTicks; ++tick) {
    const absl::StatusOr<BodyNews> frame = merger.next(kPatience);
    ASSERT_TRUE(frame.ok()) << frame.status();
    ASSERT_EQ(frame->tick, tick);
    ASSERT_EQ(ids(*frame), (std::vector<std::uint64_t>{1, 100, 101, 102, 103}));
  }
  for (std::thread& source : sources) source.join();
  EXPECT_EQ(merger.skipped(), 0u);
}

}  // namespace
}  // namespace tessera
