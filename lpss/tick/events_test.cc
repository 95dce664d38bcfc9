// Contacts begin, persist and end, each of it reported once.
#include "lpss/tick/events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;

// Of the server that hosts kLow, in a tick in which nothing is solved.
std::vector<ContactEvent> events_of_a_tick(TestWorld& world) {
  world.exchange();
  world.detect();
  TickContext& low = world.contexts[0];
  return gather_events(world[0], ++low.tick, low.stepped, low.vacated, {});
}

using Pair = std::pair<std::uint64_t, std::uint64_t>;

Pair pair_of(const ContactEvent& event) { return {event.a.value, event.b.value}; }

// Of all servers, in the order of ranks.
std::vector<ContactEvent> events_of_all(TestWorld& world) {
  std::vector<ContactEvent> events = events_of_a_tick(world);
  for (Rank rank = 1; rank < world.contexts.size(); ++rank) {
    TickContext& context = world.contexts[rank];
    for (ContactEvent& event :
         gather_events(world[rank], ++context.tick, context.stepped, context.vacated, {}))
      events.push_back(event);
  }
  return events;
}

// Two dynamic boxes over the border. The one behind it touches a static box and another dynamic one, which
// kLow clones and detects, too.
void add_what_two_sectors_detect(TestWorld& world) {
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
  world.add(box(3, kHigh, kBehindBorder + Eigen::Vector3d(0.5, 0, -0.984375), Motion::kStatic));
  world.add(box(4, kHigh, kBehindBorder + Eigen::Vector3d(0.5, 0, 0.984375)));
}

TEST(Events, AContactOverABorderBeginsPersistsAndEnds) {
  TestWorld world(2);
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, {-7.5, 4, 0}));
  EXPECT_THAT(events_of_a_tick(world), IsEmpty());
  for (const ContactPhase phase : {ContactPhase::kBegin, ContactPhase::kPersist, ContactPhase::kEnd}) {
    if (phase == ContactPhase::kBegin) {
      report_contacts(world[0], true);
      put(world[1], 2, kBehindBorder);
    } else if (phase == ContactPhase::kEnd) {
      put(world[1], 2, {-7.5, 4, 0});
    }
    const std::vector<ContactEvent> events = events_of_a_tick(world);
    ASSERT_EQ(events.size(), 1u);
    EXPECT_EQ(events[0].tick, world.contexts[0].tick);
    EXPECT_EQ(events[0].phase, phase);
    EXPECT_EQ(events[0].a, BodyId{1});
    EXPECT_EQ(events[0].b, BodyId{2});
    if (phase == ContactPhase::kEnd) continue;
    EXPECT_NEAR(events[0].depth, 1.0 / 64, 1e-4);
    EXPECT_NEAR(events[0].normal[0], -1, 1e-6) << "on b, pointing to a";
    EXPECT_EQ(events[0].position.sector, kLow);
    EXPECT_NEAR(events[0].position.local.x(), kBehindBorder.x() + 16 - 0.5, 1e-4) << "on b";
  }
  EXPECT_THAT(events_of_a_tick(world), IsEmpty());
}

TEST(Events, ContactsThatAreThereWhenEventsAreSwitchedOnDoNotBegin) {
  TestWorld world;
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
  EXPECT_THAT(events_of_a_tick(world), IsEmpty());
  report_contacts(world[0], true);
  EXPECT_EQ(events_of_a_tick(world).at(0).phase, ContactPhase::kPersist);
  report_contacts(world[0], false);
  EXPECT_THAT(events_of_a_tick(world), IsEmpty());
}

// Two bodies that are teleported together part where they were, and meet where they are.
TEST(Events, AContactEndsBeforeItBeginsAnew) {
  TestWorld world;
  world.add(box(1, kHigh, {0, 0, 0}));
  world.add(box(2, kHigh, {0.984375, 0, 0}));
  report_contacts(world[0], true);
  world.contexts[0].vacated.ended_contacts = {{BodyId{1}, BodyId{2}}};
  const std::vector<ContactEvent> events = events_of_a_tick(world);
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0].phase, ContactPhase::kEnd);
  EXPECT_EQ(events[1].phase, ContactPhase::kBegin);
}

TEST(Events, WhatTouchedInASectorThatIsGoneEndsInTheOrderOfIds) {
  TestWorld world;
  world.add(box(3, kHigh, {0, 0, 0}));
  world.add(box(4, kHigh, {0.984375, 0, 0}));
  report_contacts(world[0], true);
  world.contexts[0].vacated.ended_contacts = {{BodyId{5}, BodyId{6}}, {BodyId{1}, BodyId{2}}};
  const std::vector<ContactEvent> events = events_of_a_tick(world);
  ASSERT_EQ(events.size(), 3u);
  EXPECT_EQ(events[0].a, BodyId{1});
  EXPECT_EQ(events[0].phase, ContactPhase::kEnd);
  EXPECT_EQ(events[1].a, BodyId{3});
  EXPECT_EQ(events[1].phase, ContactPhase::kBegin);
  EXPECT_EQ(events[2].a, BodyId{5});
}

TEST(Events, OfOneTickAreInTheOrderOfBothIds) {
  TestWorld world;
  world.add(box(1, kHigh, {0, 0, 0}));
  world.add(box(3, kHigh, {0.984375, 0, 0}));
  report_contacts(world[0], true);
  world.contexts[0].vacated.ended_contacts = {{BodyId{1}, BodyId{4}}, {BodyId{1}, BodyId{2}}};
  std::vector<Pair> pairs;
  for (const ContactEvent& event : events_of_a_tick(world)) pairs.push_back(pair_of(event));
  EXPECT_THAT(pairs, ElementsAre(Pair(1, 2), Pair(1, 3), Pair(1, 4)));
}

TEST(Events, UnderThePolicyCloneAContactThatTwoSectorsDetectIsReportedOnce) {
  for (const std::uint32_t servers : {1, 2}) {
    TestWorld world(servers, clone_settings(2));
    add_what_two_sectors_detect(world);
    for (Rank rank = 0; rank < servers; ++rank) report_contacts(world[rank], true);
    std::vector<Pair> pairs;
    for (const ContactEvent& event : events_of_all(world)) pairs.push_back(pair_of(event));
    EXPECT_THAT(pairs, ElementsAre(Pair(1, 2), Pair(2, 3), Pair(2, 4))) << servers;
    EXPECT_EQ(world.sector(kLow).world->contacts().size(), 3u);
    EXPECT_EQ(world.sector(kHigh).world->contacts().size(), 3u);
    EXPECT_THAT(world.sector(kLow).touching, ElementsAre(std::pair(BodyId{1}, BodyId{2})))
        << "what it would end if it were gone";
  }
}

TEST(Events, UnderThePolicyCloneOnlyTheReportingSectorTakesOnWhatIsThereAlready) {
  for (const std::uint32_t servers : {1, 2}) {
    TestWorld world(servers, clone_settings(2));
    add_what_two_sectors_detect(world);
    EXPECT_THAT(events_of_all(world), IsEmpty());
    for (Rank rank = 0; rank < servers; ++rank) report_contacts(world[rank], true);
    const std::vector<ContactEvent> events = events_of_all(world);
    EXPECT_EQ(events.size(), 3u);
    EXPECT_THAT(events, Each(Field(&ContactEvent::phase, ContactPhase::kPersist)));
  }
}

}  // namespace
}  // namespace tessera
