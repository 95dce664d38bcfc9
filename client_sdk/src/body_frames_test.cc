// Frames of bodies have what has changed, once, whatever servers tell again or hand to each other.
#include "client_sdk/src/body_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

BodySample sample(std::uint64_t id, std::uint64_t server, double x = 0, bool asleep = true) {
  BodySample body;
  body.id = BodyId{id};
  body.pose.position.local.x() = x;
  body.server = server;
  body.asleep = asleep;
  return body;
}

// What one server tells.
BodyNews news(std::uint64_t server, const std::vector<BodySample>& bodies,
              const std::vector<std::uint64_t>& gone = {}, bool whole = false) {
  BodyNews told;
  told.bodies = bodies;
  for (const std::uint64_t id : gone) told.gone.push_back({BodyId{id}, server});
  told.servers = {server};
  if (whole) told.whole = {server};
  return told;
}

BodyNews both(BodyNews a, BodyNews b) {
  join(a, std::move(b));
  return a;
}

std::vector<std::uint64_t> ids_in(const BodyFrame& frame) {
  std::vector<std::uint64_t> result;
  for (const BodySample& body : frame.bodies) result.push_back(body.id.value);
  return result;
}

std::vector<std::uint64_t> gone_in(const BodyFrame& frame) {
  std::vector<std::uint64_t> result;
  for (const BodyId id : frame.gone) result.push_back(id.value);
  return result;
}

TEST(KnownBodies, AreInAFrameOnceTheyHaveChanged) {
  KnownBodies known(false);
  EXPECT_THAT(ids_in(known.take(news(1, {sample(1, 1), sample(2, 1)}, {}, true))), ElementsAre(1, 2));
  EXPECT_THAT(ids_in(known.take(news(1, {}))), IsEmpty());
  EXPECT_THAT(ids_in(known.take(news(1, {sample(1, 1), sample(2, 1, 0, false)}))), ElementsAre(2))
      << "what sleeps and is told again has not changed, what is awake has";
  EXPECT_THAT(ids_in(known.take(news(1, {sample(2, 1)}))), ElementsAre(2)) << "it has fallen asleep";
  EXPECT_THAT(ids_in(known.take(news(1, {sample(1, 1, 5)}))), ElementsAre(1)) << "it was moved";
  EXPECT_THAT(gone_in(known.take(news(1, {}, {2}))), ElementsAre(2));
  EXPECT_THAT(gone_in(known.take(news(1, {}, {2}))), IsEmpty());
  EXPECT_THAT(ids_in(known.take(news(1, {sample(2, 1)}))), ElementsAre(2)) << "it is new again";
}

TEST(KnownBodies, AreAllInEachCompleteFrame) {
  KnownBodies known(true);
  known.take(news(1, {sample(1, 1), sample(3, 1)}, {}, true));
  EXPECT_THAT(ids_in(known.take(news(1, {sample(2, 1)}))), ElementsAre(1, 2, 3));
  const BodyFrame frame = known.take(news(1, {}, {1}));
  EXPECT_THAT(ids_in(frame), ElementsAre(2, 3));
  EXPECT_THAT(gone_in(frame), ElementsAre(1));
}

TEST(KnownBodies, AreNotGoneWhereTheyMoveToAnotherServer) {
  KnownBodies known(false);
  known.take(both(news(1, {sample(1, 1), sample(2, 1)}, {}, true), news(2, {}, {}, true)));
  const BodyFrame frame = known.take(both(news(1, {}, {1, 2}), news(2, {sample(1, 2)})));
  EXPECT_THAT(ids_in(frame), IsEmpty()) << "it sleeps as before";
  EXPECT_THAT(gone_in(frame), ElementsAre(2));
  EXPECT_THAT(gone_in(known.take(both(news(1, {}, {1}), news(2, {})))), IsEmpty()) << "it is not there";
  EXPECT_THAT(gone_in(known.take(both(news(1, {}), news(2, {}, {1})))), ElementsAre(1));
}

TEST(KnownBodies, AreGoneWithAServerUnlessAnotherOneHasThem) {
  KnownBodies known(false);
  known.take(both(news(1, {sample(1, 1)}, {}, true), news(2, {sample(2, 2), sample(3, 2)}, {}, true)));
  const BodyFrame frame = known.take(news(1, {sample(3, 1)}));
  EXPECT_THAT(ids_in(frame), IsEmpty());
  EXPECT_THAT(gone_in(frame), ElementsAre(2));
}

TEST(KnownBodies, AreThoseThatAServerTellsWhenItBeginsAnew) {
  KnownBodies known(false);
  known.take(news(1, {sample(1, 1), sample(2, 1), sample(3, 1)}, {}, true));
  const BodyFrame frame = known.take(news(1, {sample(1, 1), sample(3, 1, 1)}, {}, true));
  EXPECT_THAT(ids_in(frame), ElementsAre(3));
  EXPECT_THAT(gone_in(frame), ElementsAre(2));
}

// A stream that begins while a sector moves may hear of it from both servers.
TEST(KnownBodies, AreKeptWhereTwoServersToldOfThemAndOneHasThem) {
  for (const std::uint64_t loser : {1, 2}) {
    KnownBodies known(false);
    const BodyFrame first =
        known.take(both(news(1, {sample(1, 1)}, {}, true), news(2, {sample(1, 2)}, {}, true)));
    EXPECT_THAT(ids_in(first), ElementsAre(1));
    const BodyFrame second = known.take(both(news(loser, {}, {1}), news(3 - loser, {})));
    EXPECT_THAT(gone_in(second), IsEmpty());
    EXPECT_THAT(gone_in(known.take(both(news(loser, {}), news(3 - loser, {}, {1})))), ElementsAre(1));
  }
}

TEST(BodyNews, KeepWhatWasLeftOut) {
  BodyNews later = news(1, {sample(2, 1, 7)}, {3});
  carry_over(later, news(1, {sample(1, 1), sample(2, 1), sample(3, 1)}, {4, 2}, true));
  KnownBodies known(false);
  known.take(news(1, {sample(4, 1), sample(5, 1)}, {}, true));
  const BodyFrame frame = known.take(later);
  EXPECT_THAT(ids_in(frame), ElementsAre(1, 2));
  EXPECT_EQ(frame.bodies[1].pose.position.local.x(), 7);
  EXPECT_THAT(gone_in(frame), ElementsAre(4, 5)) << "what was left out was whole";
  BodyNews whole = news(1, {sample(1, 1)}, {}, true);
  carry_over(whole, news(1, {sample(2, 1)}));
  EXPECT_EQ(whole.bodies.size(), 1u);
}

PartOrigin from(std::uint64_t node, std::size_t servers, std::uint64_t epoch = 1, Tick since = 0) {
  return {.load = 1, .epoch = epoch, .servers = servers, .node = node, .since = since};
}

BodyNews at(Tick tick, BodyNews told) {
  told.tick = tick;
  return told;
}

// What a merger gives in a frame after all that was pushed.
BodyFrame next_frame(StreamMerger<BodyNews>& merger, KnownBodies& known) {
  absl::StatusOr<BodyNews> told = merger.next(absl::ZeroDuration());
  EXPECT_TRUE(told.ok()) << told.status();
  return told.ok() ? known.take(*told) : BodyFrame();
}

TEST(BodyNews, OfTicksThatNotAllTellOfAreInTheNextFrame) {
  StreamMerger<BodyNews> merger;
  KnownBodies known(false);
  merger.push(from(1, 2), at(2, news(1, {sample(1, 1), sample(3, 1)}, {}, true)));
  merger.push(from(1, 2), at(3, news(1, {sample(4, 1)}, {3})));
  merger.push(from(1, 2), at(4, news(1, {})));
  merger.push(from(2, 2), at(4, news(2, {sample(2, 2)}, {}, true)));
  const BodyFrame frame = next_frame(merger, known);
  EXPECT_EQ(frame.tick, 4u);
  EXPECT_THAT(ids_in(frame), ElementsAre(1, 2, 4));
}

TEST(BodyNews, OfTicksThatComeAgainAreInTheFirstFrameThatIsNew) {
  StreamMerger<BodyNews> merger;
  KnownBodies known(false);
  merger.push(from(1, 2), at(5, news(1, {sample(1, 1)}, {}, true)));
  merger.push(from(2, 2), at(5, news(2, {sample(2, 2)}, {}, true)));
  EXPECT_THAT(ids_in(next_frame(merger, known)), ElementsAre(1, 2));
  merger.push(from(1, 2), at(6, news(1, {sample(7, 1)})));
  // The world is set back to tick 3; server 3 has what server 2 had, and body 2 is removed anew.
  merger.push(from(1, 2, 2), at(4, news(1, {sample(1, 1, 0, false)}, {}, true)));
  merger.push(from(3, 2, 2), at(4, news(3, {sample(2, 3)}, {}, true)));
  merger.push(from(1, 2, 2), at(5, news(1, {sample(1, 1)})));
  merger.push(from(3, 2, 2), at(5, news(3, {})));
  merger.push(from(1, 2, 2), at(6, news(1, {})));
  merger.push(from(3, 2, 2), at(6, news(3, {}, {2})));
  const BodyFrame frame = next_frame(merger, known);
  EXPECT_EQ(frame.tick, 6u);
  EXPECT_THAT(ids_in(frame), IsEmpty());
  EXPECT_THAT(gone_in(frame), ElementsAre(2));
}

TEST(BodyNews, OfAServerThatLeavesAreNotLost) {
  StreamMerger<BodyNews> merger;
  KnownBodies known(false);
  merger.push(from(1, 2), at(1, news(1, {sample(1, 1)}, {}, true)));
  merger.push(from(2, 2), at(1, news(2, {sample(2, 2), sample(3, 2)}, {}, true)));
  next_frame(merger, known);
  merger.push(from(1, 2), at(2, news(1, {sample(1, 1, 4)})));  // tick 2 is never whole
  merger.push(from(1, 1, 1, 3), at(3, news(1, {sample(3, 1)})));
  merger.ended(2);
  const BodyFrame frame = next_frame(merger, known);
  EXPECT_EQ(frame.tick, 3u);
  EXPECT_THAT(ids_in(frame), ElementsAre(1));
  EXPECT_THAT(gone_in(frame), ElementsAre(2));
  EXPECT_EQ(merger.skipped(), 1u);
}

}  // namespace
}  // namespace tessera
