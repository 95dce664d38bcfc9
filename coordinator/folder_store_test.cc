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

using ::testing::ElementsAre;
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

// A store with a state, and inputs in the logs before it and since.
class DamagedStore : public ::testing::Test {
 protected:
  DamagedStore() {
    const auto store = open_folder_store("store", disk_).value();
    EXPECT_TRUE(store->begin(7, to_proto(small_world())).ok());
    EXPECT_TRUE(store->append({stored_removal(1), stored_removal(2)}).ok());
    EXPECT_TRUE(store->change(state_of(2), 1)) << "the second one is only in the log before";
    EXPECT_TRUE(store->append({stored_removal(3)}).ok());
    EXPECT_TRUE(store->tend().ok());
    EXPECT_TRUE(store->append({stored_removal(4)}).ok());
    whole_ = disk_.files;
  }

  // All is there, or the damage is told and nothing is there.
  void expect_nothing_lost(const std::filesystem::path& damaged) {
    const absl::StatusOr<std::unique_ptr<WorldStore>> store = open_folder_store("store", disk_);
    if (!store.ok()) {
      EXPECT_EQ(store.status().code(), absl::StatusCode::kDataLoss) << store.status();
      EXPECT_EQ(damaged.extension(), ".state") << "inputs have a mirror: " << store.status();
      EXPECT_THAT(std::string(store.status().message()), HasSubstr(damaged.filename().string()));
      return;
    }
    const std::optional<StoredWorld> world = (*store)->take_stored();
    ASSERT_TRUE(world) << "a damaged store is not an empty one";
    EXPECT_EQ(world->load, 7u);
    EXPECT_EQ(std::get<SnapshotChunks>(world->state)[0].head().tick(), 2u);
    EXPECT_EQ(ticks_of(*world), (std::vector<Tick>{2, 3, 4}));
    ASSERT_TRUE((*store)->append({stored_removal(5)}).ok());
  }

  MemoryDisk disk_;
  MemoryDisk::Files whole_;
};

TEST_F(DamagedStore, HasTwoLogsAndAState) {
  std::vector<std::string> names;
  for (const auto& [file, bytes] : whole_) names.push_back(file.filename());
  EXPECT_THAT(names, ElementsAre("1.inputs", "1.mirror", "2.inputs", "2.mirror", "2.state"));
  expect_nothing_lost({});
}

TEST_F(DamagedStore, EachBitCounts) {
  for (const auto& [file, bytes] : whole_) {
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      disk_.files = whole_;
      std::string damaged = bytes;
      damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
      disk_.files[file] = damaged;
      SCOPED_TRACE(absl::StrCat("bit ", bit, " of ", file.string()));
      expect_nothing_lost(file);
    }
  }
}

TEST_F(DamagedStore, EachByteOfTheLengthCounts) {
  for (const auto& [file, bytes] : whole_) {
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      disk_.files = whole_;
      disk_.files[file] = bytes.substr(0, length);
      SCOPED_TRACE(absl::StrCat(length, " bytes of ", file.string()));
      expect_nothing_lost(file);
    }
  }
}

TEST_F(DamagedStore, EachFileCounts) {
  for (const auto& [file, bytes] : whole_) {
    disk_.files = whole_;
    disk_.files.erase(file);
    SCOPED_TRACE(file.string());
    expect_nothing_lost(file);
  }
}

// Two faults are more than a mirror makes good; they are told.
TEST_F(DamagedStore, BothCopiesOfALogAreTold) {
  for (const auto& [file, bytes] : whole_) {
    if (file.extension() != ".inputs") continue;
    std::filesystem::path mirror = file;
    mirror.replace_extension(".mirror");
    disk_.files = whole_;
    disk_.files.erase(file);
    disk_.files.erase(mirror);
    EXPECT_EQ(open_folder_store("store", disk_).status().code(), absl::StatusCode::kDataLoss) << file;
    disk_.files = whole_;
    std::string damaged = bytes;
    damaged[20] ^= 1;
    disk_.files[file] = damaged;
    disk_.files[mirror] = damaged;
    EXPECT_EQ(open_folder_store("store", disk_).status().code(), absl::StatusCode::kDataLoss) << file;
  }
}

// What check tells is what opening finds, and it changes nothing.
TEST_F(DamagedStore, IsCheckedWithoutAChange) {
  for (const auto& [file, bytes] : whole_) {
    disk_.files = whole_;
    disk_.files[file][bytes.size() / 2] ^= 1;
    const MemoryDisk::Files damaged = disk_.files;
    const absl::StatusOr<StoreContents> contents = check_folder_store("store", disk_);
    ASSERT_TRUE(contents.ok()) << contents.status();
    EXPECT_EQ(disk_.files, damaged);
    const bool is_log = file.extension() != ".state";
    EXPECT_EQ(contents->state.ok(), is_log) << file;
    EXPECT_EQ(contents->damage().size(), is_log ? 1u : 0u) << file;
    EXPECT_EQ(contents->lost, "") << file;
  }
}

TEST_F(DamagedStore, GoesOnWithoutWhatIsLostWhereThatIsAskedFor) {
  for (const char* copy : {"store/1.inputs", "store/1.mirror"})
    disk_.files[copy][70] ^= 1;  // the first entry
  EXPECT_EQ(open_folder_store("store", disk_).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(check_folder_store("store", disk_)->lost, HasSubstr("1.inputs"));
  ASSERT_TRUE(drop_what_is_lost("store", disk_).ok());
  const absl::StatusOr<std::unique_ptr<WorldStore>> store = open_folder_store("store", disk_);
  ASSERT_TRUE(store.ok()) << store.status();
  const std::optional<StoredWorld> world = (*store)->take_stored();
  ASSERT_TRUE(world);
  EXPECT_EQ(world->load, 7u);
  EXPECT_EQ(ticks_of(*world), std::vector<Tick>{}) << "those that came after it go with it";
  ASSERT_TRUE((*store)->append({stored_removal(5)}).ok());
}

TEST_F(FolderStoreTest, WhatWasMadeGoodIsTold) {
  {
    const auto store = open();
    ASSERT_TRUE(store->begin(1, snapshot_of(2)).ok());
    ASSERT_TRUE(store->append({stored_removal(1)}).ok());
  }
  std::filesystem::remove(folder_ / "1.mirror");
  const auto stored = open()->take_stored();
  ASSERT_TRUE(stored);
  EXPECT_THAT(stored->repaired, ElementsAre(HasSubstr("1.mirror: it is missing")));
  EXPECT_TRUE(open()->take_stored()->repaired.empty()) << "it was written anew";
}

TEST_F(FolderStoreTest, AWorldThatFailedIsSetAside) {
  {
    const auto store = open();
    EXPECT_EQ(store->set_aside("nothing").value(), "") << "there is no world";
    for (const Tick tick : {2, 5}) {  // the last one is kept
      ASSERT_TRUE(store->begin(tick, snapshot_of(tick)).ok());
      ASSERT_TRUE(store->append({stored_removal(tick + 1)}).ok());
      EXPECT_EQ(store->set_aside(absl::StrCat("tick ", tick)).value(), (folder_ / "failed").string());
    }
    EXPECT_EQ(open_folder_store(folder_ / "failed").value()->take_stored()->load, 5u);
    ASSERT_TRUE(store->begin(9, snapshot_of(9)).ok());
  }
  EXPECT_EQ(open()->take_stored()->load, 9u);
  const auto failed = open_folder_store(folder_ / "failed").value()->take_stored();
  ASSERT_TRUE(failed);
  EXPECT_EQ(std::get<SnapshotChunks>(failed->state)[0].head().tick(), 5u);
  EXPECT_EQ(ticks_of(*failed), std::vector<Tick>{6});
  std::string reason;
  std::getline(std::ifstream(folder_ / "failed" / "reason"), reason);
  EXPECT_EQ(reason, "tick 5");
}

TEST_F(FolderStoreTest, AStoreOfAnotherFormatIsTold) {
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / "inputs.db") << "SQLite format 3";
  const absl::Status status = open_folder_store(folder_).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("format 1"));
}

TEST_F(FolderStoreTest, AFolderThatVanishesIsNoticedAtTheNextWrite) {
  const auto store = open();
  ASSERT_TRUE(store->begin(1, snapshot_of(2)).ok());
  ASSERT_TRUE(store->append({stored_removal(1)}).ok());
  std::filesystem::remove_all(folder_);
  const absl::Status status = store->append({stored_removal(2)});
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
  EXPECT_FALSE(store->append({stored_removal(2)}).ok());
  EXPECT_EQ(store->position(), 1u);
}

}  // namespace
}  // namespace tessera
