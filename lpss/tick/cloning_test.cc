// Clones are in an engine world only while contact is imminent; statics are there as far as bodies go.
#include "lpss/tick/cloning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lpss/tick/test_world.h"

namespace tessera {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// The bodies of which a clone is in the sector's engine world.
std::vector<std::uint64_t> placed_in(const Sector& sector) {
  std::vector<std::uint64_t> ids;
  for (const Clone* clone : sector.placed) ids.push_back(clone->replica->id.value);
  return ids;
}

TEST(Cloning, ACloneIsInTheEngineWorldOnlyWhileContactIsImminent) {
  for (const std::uint32_t servers : {1, 2}) {
    TestWorld world(servers);
    world.add(box(1, kLow, kBeforeBorder));
    world.add(box(2, kHigh, {-7.5, 4, 0}));
    const auto placed = [&] {
      const Sector& low = world.sector(kLow);
      const bool in_world = low.clones.at(BodyId{2})->is_placed();
      EXPECT_EQ(low.placed.size(), in_world ? 1u : 0u);
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
    return low.world->state(low.clones.at(BodyId{2})->slot);
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

TEST(Cloning, UnderThePolicyCloneBothSectorsHaveACloneOfWhatTouchesOverTheirBorder) {
  TestWorld world(1, clone_settings());
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
  world.exchange();
  EXPECT_THAT(placed_in(world.sector(kLow)), ElementsAre(2));
  EXPECT_THAT(placed_in(world.sector(kHigh)), ElementsAre(1));
}

TEST(Cloning, UnderThePolicyCloneDeeperThanOneAllClonesArePlaced) {
  WorldSettings island = clone_settings(2);
  island.seams = SeamPolicy::kIsland;
  const auto placed = [](const WorldSettings& settings) {
    TestWorld world(1, settings);
    world.add(box(1, kLow, kBeforeBorder));
    world.add(box(2, kHigh, {-7.5, 4, 0}));
    world.exchange();
    return placed_in(world.sector(kLow));
  };
  EXPECT_THAT(placed(clone_settings(2)), ElementsAre(2));
  EXPECT_THAT(placed(clone_settings(1)), IsEmpty());
  EXPECT_THAT(placed(island), IsEmpty());
}

TEST(Cloning, UnderThePolicyCloneAJointToABodyOfTheSectorPlacesTheClone) {
  for (const bool clone : {false, true}) {
    TestWorld world(1, clone ? clone_settings() : test_settings());
    world.add(box(1, kLow, kBeforeBorder));
    world.add(box(2, kHigh, {-7.5, 4, 0}));
    world.add(box(3, kHigh, {-7.5, 5, 0}));
    world.add(hinge(1, 1, 2));
    world.add(hinge(2, 2, 3));
    world.exchange();
    const Sector& low = world.sector(kLow);
    ASSERT_TRUE(low.clones.contains(BodyId{3})) << "known, but jointed to another clone only";
    EXPECT_EQ(placed_in(low), clone ? std::vector<std::uint64_t>{2} : std::vector<std::uint64_t>{});
  }
}

// Around a planet every place has a pull of its own.
TEST(Cloning, UnderThePolicyCloneAClonesPullIsThatOfItsOriginal) {
  WorldSettings settings = clone_settings();
  settings.gravity = CentralGravity{{kHigh, {0, 0, -8}}, 8, 8};
  TestWorld world(1, settings);
  world.add(box(1, kLow, kBeforeBorder));
  world.add(box(2, kHigh, kBehindBorder));
  for (const double height : {0.0, 0.5}) {
    put(world[0], 2, kBehindBorder + Eigen::Vector3d(0, 0, height));
    world.exchange();
    world.detect();
    const Sector& low = world.sector(kLow);
    const std::array<double, 3> pull = low.world->total_wrench(low.clones.at(BodyId{2})->slot).force;
    const std::array<double, 3> original =
        world.sector(kHigh).world->total_wrench(body(world[0], 2).slot).force;
    EXPECT_THAT(pull, testing::Pointwise(testing::DoubleNear(1e-4), original)) << height;
    EXPECT_LT(pull[2], -1) << height;
  }
}

}  // namespace
}  // namespace tessera
