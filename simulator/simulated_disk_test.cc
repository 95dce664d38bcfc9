// The disk of simulations, and the production store on it.
#include "simulator/simulated_disk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "coordinator/folder_store.h"

namespace tessera {
namespace {

// Removal of body n at tick n.
v1::StoredInput input(std::uint64_t n) {
  v1::StoredInput input;
  input.mutable_commands()->set_tick(n);
  input.mutable_commands()->add_commands()->mutable_remove()->mutable_body()->set_id(n);
  return input;
}

StoredState state(const std::string& name) {
  v1::World world;
  world.set_name(name);
  return world;
}

std::uint64_t ticks_stored(SimulatedDisk& disk) {
  const auto store = open_folder_store("store", disk);
  EXPECT_TRUE(store.ok()) << store.status();
  const auto world = store.ok() ? (*store)->take_stored() : std::nullopt;
  EXPECT_TRUE(world);
  return world ? world->inputs.size() : 0;
}

TEST(SimulatedDisk, KeepsWhatWasSyncedAndMayForgetTheRest) {
  int forgotten = 0;
  int torn = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SimulatedDisk disk(seed);
    const auto file = disk.create("file");
    ASSERT_TRUE(file.ok());
    const std::string first(2000, 'a');
    const std::string second(2000, 'b');
    ASSERT_TRUE((*file)->append(first).ok());
    ASSERT_TRUE((*file)->sync().ok());
    ASSERT_TRUE(disk.rename("file", "name").ok());
    ASSERT_TRUE((*file)->append(second).ok());
    EXPECT_EQ(disk.contents("name"), first + second);
    disk.lose_power();
    const std::string left = disk.contents("name");
    ASSERT_EQ(left.substr(0, first.size()), first);
    forgotten += left == first ? 1 : 0;
    torn += left != first && left != first + second ? 1 : 0;
  }
  EXPECT_GT(forgotten, 0);
  EXPECT_GT(torn, 0);
}

TEST(SimulatedDisk, EndsItsUserInTheMiddleOfAnything) {
  SimulatedDisk disk(1);
  const auto file = disk.create("file");
  disk.end_user_after(1);
  EXPECT_TRUE((*file)->append("a").ok());
  EXPECT_FALSE(disk.user_has_ended());
  EXPECT_FALSE((*file)->append("b").ok());
  EXPECT_TRUE(disk.user_has_ended());
  disk.begin_user();
  EXPECT_EQ(disk.contents("file"), "a");
}

TEST(SimulatedDisk, AStoreSurvivesTheLossOfPowerAtAnyOperation) {
  for (std::uint64_t operations = 0; operations < 400; operations += 3) {
    SimulatedDisk disk(operations);
    {
      const auto store = open_folder_store("store", disk);
      ASSERT_TRUE((*store)->begin(1, state("w")).ok());
    }
    std::uint64_t acknowledged = 0;
    std::uint64_t tried = 0;
    {
      const auto store = open_folder_store("store", disk);
      disk.end_user_after(operations);
      while (!disk.user_has_ended()) {
        if (!(*store)->append({input(++tried)}).ok()) break;
        acknowledged = tried;
      }
      disk.end_user();
    }
    disk.lose_power();
    disk.begin_user();
    const std::uint64_t stored = ticks_stored(disk);
    EXPECT_GE(stored, acknowledged) << operations;
    EXPECT_LE(stored, tried) << operations;
  }
}

// Wherever the process ends, the world is in its place or set aside.
TEST(SimulatedDisk, AWorldIsSetAsideAsAWhole) {
  for (std::uint64_t operations = 0; operations < 60; ++operations) {
    SimulatedDisk disk(operations);
    {
      const auto store = open_folder_store("store", disk);
      ASSERT_TRUE((*store)->begin(1, state("w")).ok());
      ASSERT_TRUE((*store)->append({input(1), input(2)}).ok());
      disk.end_user_after(operations);
      (*store)->set_aside("why").IgnoreError();
      disk.end_user();
    }
    disk.lose_power();
    disk.begin_user();
    const std::optional<StoredWorld> here = (*open_folder_store("store", disk))->take_stored();
    const std::optional<StoredWorld> aside =
        here ? here : (*open_folder_store("store/failed", disk))->take_stored();
    ASSERT_TRUE(aside) << operations;
    EXPECT_EQ(aside->inputs.size(), 2u);
  }
}

TEST(SimulatedDisk, AStoreGoesOnOnceThereIsRoomAgain) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SimulatedDisk disk(seed);
    {
      const auto store = open_folder_store("store", disk);
      ASSERT_TRUE((*store)->begin(1, state("w")).ok());
      ASSERT_TRUE((*store)->append({input(1)}).ok());
      disk.set_full(true);
      const absl::Status full = (*store)->append({input(2)});
      EXPECT_EQ(full.code(), absl::StatusCode::kUnavailable) << full;
      EXPECT_EQ((*store)->position(), 1u);
      disk.set_full(false);
      ASSERT_TRUE((*store)->append({input(2), input(3)}).ok());
      EXPECT_EQ((*store)->position(), 3u);
      disk.end_user();
    }
    disk.lose_power();
    disk.begin_user();
    EXPECT_EQ(ticks_stored(disk), 3u) << seed;
  }
}

TEST(SimulatedDisk, AStoreKeepsWhatItAcknowledgedOnADiskThatFails) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SimulatedDisk disk(seed);
    std::uint64_t acknowledged = 0;
    {
      const auto store = open_folder_store("store", disk);
      ASSERT_TRUE((*store)->begin(1, state("w")).ok());
      disk.set_failing(true);
      for (int n = 0; n < 40; ++n) {
        if ((*store)->append({input(acknowledged + 1)}).ok()) ++acknowledged;
      }
      disk.end_user();
    }
    disk.set_failing(false);
    disk.lose_power();
    disk.begin_user();
    const std::uint64_t stored = ticks_stored(disk);
    EXPECT_GE(stored, acknowledged) << seed;
    EXPECT_LE(stored, acknowledged + 1) << seed;
  }
}

}  // namespace
}  // namespace tessera
