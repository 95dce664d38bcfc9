// Stores are read by the process that comes after the one that wrote them.
#include "coordinator/folder_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "coordinator/test_cluster.h"
#include "coordinator/test_store.h"
#include "proto/snapshot.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

class FolderStoreTest : public ::testing::Test {
 protected:
  FolderStoreTest() : folder_(::testing::TempDir() + "tessera_store_" + std::to_string(getpid())) {
    std::filesystem::remove_all(folder_);
  }
  ~FolderStoreTest() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<WorldStore> open() {
    absl::StatusOr<std::unique_ptr<WorldStore>> store = open_folder_store(folder_);
    EXPECT_TRUE(store.ok()) << store.status();
    return store.ok() ? *std::move(store) : nullptr;
  }

  std::filesystem::path folder_;
};

TEST_F(FolderStoreTest, IsEmptyAtFirstAndAfterTheEndOfItsWorld) {
  EXPECT_EQ(open()->take_stored(), std::nullopt);
  {
    const auto store = open();
    ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
    ASSERT_TRUE(store->append({stored_removal(1)}).ok());
    ASSERT_TRUE(store->end().ok());
  }
  EXPECT_EQ(open()->take_stored(), std::nullopt);
}

TEST_F(FolderStoreTest, HasTheWorldAndTheInputsSince) {
  {
    const auto store = open();
    ASSERT_TRUE(store->begin(7, to_proto(small_world())).ok());
    ASSERT_TRUE(store->append({stored_removal(1), stored_removal(2)}).ok());
    ASSERT_TRUE(store->append({stored_removal(3)}).ok());
  }
  const auto stored = open()->take_stored();
  ASSERT_TRUE(stored);
  EXPECT_EQ(stored->load, 7u);
  EXPECT_EQ(std::get<v1::World>(stored->state).SerializeAsString(),
            to_proto(small_world()).SerializeAsString());
  EXPECT_EQ(ticks_of(*stored), (std::vector<Tick>{1, 2, 3}));
}

TEST_F(FolderStoreTest, ACheckpointTakesThePlaceOfTheInputsThatItHas) {
  {
    const auto store = open();
    ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
    ASSERT_TRUE(store->append({stored_removal(1), stored_removal(2)}).ok());
    ASSERT_TRUE(store->change(state_of(2), store->position()));
    ASSERT_TRUE(store->append({stored_removal(3)}).ok());
    while (!store->change(state_of(9), store->position())) ASSERT_TRUE(store->tend().ok());
  }
  // The second one was not tended: the store has what it had before.
  const auto store = open();
  const auto stored = store->take_stored();
  ASSERT_TRUE(stored);
  EXPECT_EQ(std::get<SnapshotChunks>(stored->state)[0].head().tick(), 2u);
  EXPECT_EQ(ticks_of(*stored), std::vector<Tick>{3});
  ASSERT_TRUE(store->append({stored_removal(4)}).ok());
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    files += entry.path().extension() == ".state" ? 1 : 0;
  }
  EXPECT_EQ(files, 1u);
}

TEST_F(FolderStoreTest, IsOfOneProcessAtATime) {
  const auto store = open();
  const absl::Status second = open_folder_store(folder_).status();
  EXPECT_EQ(second.code(), absl::StatusCode::kAlreadyExists) << second;
  EXPECT_THAT(std::string(second.message()), HasSubstr("another coordinator"));
}

TEST_F(FolderStoreTest, DamageIsSeen) {
  {
    const auto store = open();
    ASSERT_TRUE(store->begin(1, snapshot_of(2)).ok());
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    if (entry.path().extension() != ".state") continue;
    std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(40);
    file.put('\x55');
  }
  EXPECT_EQ(open_folder_store(folder_).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace tessera
