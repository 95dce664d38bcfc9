// Clones are in an engine world only while contact is imminent; statics are there as far as bodies go.
#include "lpss/tick/cloning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

TEST(Cloning, ACloneIsInTheEngineWorldOnlyWhileContactIsImminent) {
  for (const std::uint32_t servers : {1, 2}) {
    TestWorld world(servers);
    world.add(box(1, kLow, kBeforeBorder));
    world.add(box(2, kHigh, {-7.5, 4, 0}));
    const auto placed = [&] {
      const Sector& low = world.sector(kLow);
      const bool in_world = low.clones.at(BodyId{2}).slot != Clone::kNotPlaced;
      EXPECT_EQ(low.clones_placed, in_world ? 1u : 0u);
      return in_world;
    };
    world.exchange();
    EXPECT_FALSE(placed());
    put(world.host(kHigh), 2, {-7.25, 0, 0});
    world.exchange();
    EXPECT_TRUE(placed());
    put(world.host(kHigh), 2, {-7.5, 4, 0});
    world.exchange();
    EXPECT_FALSE(placed());
    EXPECT_TRUE(world.host(kHigh).sectors.at(kHigh)->clones.empty()) << "the lower home detects";
  }
}

TEST(Cloning, ACloneFollowsItsOriginal) {
  TestWorld world;
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
  const auto clone = [&] {
    const Sector& low = world.sector(kLow);
    return low.world->state(low.clones.at(BodyId{2}).slot);
  };
  world.exchange();
  EXPECT_THAT(clone().position, testing::ElementsAre(kBehindBorder.x() + 16, 0, 0));
  put(world[0], 2, kBehindBorder + Eigen::Vector3d(0, 0.25, 0));
  world.exchange();
  EXPECT_THAT(clone().position, testing::ElementsAre(kBehindBorder.x() + 16, 0.25, 0));
}

TEST(Cloning, StaticsAreThereAsFarAsABodyGoesInATick) {
  for (const bool fast : {false, true}) {
    TestWorld world;
    world.add(moving(box(1, kHigh, {0, 0, 0}), {fast ? 64 * 32.0 : 0, 0, 0}));
    world.add(box(2, {2, 0, 0}, {0, 0, 0}, Motion::kStatic));
    world.exchange();
    EXPECT_EQ(world.sector(kHigh).statics.contains(BodyId{2}), fast);
  }
}

}  // namespace
}  // namespace tessera
