#include "sector_server/grant_queue.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

v1::Grant grant(std::uint64_t serial, std::uint64_t ticks, int questions = 0) {
  v1::Grant grant;
  grant.set_serial(serial);
  grant.set_ticks(ticks);
  grant.set_commands("commands");
  for (int n = 0; n < questions; ++n) grant.add_questions()->set_id(static_cast<std::uint64_t>(n) + 1);
  return grant;
}

TEST(GrantQueue, GrantsAreCarriedOutInTheirOrder) {
  GrantQueue queue(5);
  EXPECT_TRUE(queue.take(grant(6, 0)).ok());
  EXPECT_FALSE(queue.has_work()) << "the one before is yet to come";
  EXPECT_TRUE(queue.take(grant(5, 0)).ok());
  for (const std::uint64_t serial : {5u, 6u}) {
    ASSERT_TRUE(queue.has_work());
    EXPECT_EQ(queue.begin_next()->serial(), serial);
    EXPECT_FALSE(queue.take_question());
  }
  EXPECT_FALSE(queue.has_work());
}

TEST(GrantQueue, AGrantIsItsMapThenItsTicksThenItsQuestions) {
  GrantQueue queue(1);
  v1::Grant all = grant(1, 2, 2);
  all.mutable_map()->set_epoch(7);
  ASSERT_TRUE(queue.take(std::move(all)).ok());
  EXPECT_NE(queue.begin_next(), nullptr);
  const v1::SectorMap* map = queue.take_map();
  ASSERT_NE(map, nullptr);
  EXPECT_EQ(map->epoch(), 7u);
  EXPECT_EQ(queue.begin_next(), nullptr) << "it is under way";
  EXPECT_EQ(queue.take_map(), nullptr);
  EXPECT_EQ(*queue.take_tick()->commands, "commands");
  EXPECT_EQ(queue.take_tick()->commands, nullptr) << "commands apply at the first tick";
  EXPECT_FALSE(queue.take_tick());
  EXPECT_EQ(queue.take_question()->id(), 1u);
  EXPECT_TRUE(queue.has_work());
  EXPECT_EQ(queue.take_question()->id(), 2u);
  EXPECT_FALSE(queue.has_work());
}

TEST(GrantQueue, WhatIsOverOrTooFarAheadIsRefused) {
  GrantQueue queue(1);
  EXPECT_EQ(queue.take(grant(0, 1)).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(queue.take(grant(1 + 65'536, 1)).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(queue.take(grant(65'536, 1)).ok());
}

}  // namespace
}  // namespace tessera
