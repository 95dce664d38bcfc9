// A state is several files, of which each has what changed; whoever reads them finds the last one.
#include "coordinator/state_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <map>
#include <random>

#include "coordinator/folder_store.h"
#include "coordinator/test_cluster.h"
#include "coordinator/test_store.h"

namespace tessera {
namespace {

using ::testing::IsEmpty;

StateChange change_of(std::vector<KeptChunk> chunks, bool is_whole = false) {
  StateChange change{.is_whole = is_whole, .chunks = {}};
  for (KeptChunk& chunk : chunks) put(std::move(chunk), change.chunks);
  return change;
}

class StatePartsTest : public ::testing::Test {
 protected:
  StatePartsTest() : folder_(::testing::TempDir() + "tessera_parts_" + std::to_string(getpid())) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~StatePartsTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path path_of(const std::string& name) const { return folder_ / (name + ".state"); }

  void write(const StateChange& change) {
    last_ = parts_.add(std::to_string(++written_), change);
    const absl::Status written = write_part(
        last_, change, [this](const std::string& name) { return path_of(name); }, system_disk());
    ASSERT_TRUE(written.ok()) << written;
    bytes_written_ += std::filesystem::file_size(path_of(last_.name));
    std::erase_if(files_, [&](const std::string& file) {
      return std::find(last_.kept.begin(), last_.kept.end(), file) == last_.kept.end();
    });
    ASSERT_EQ(files_, last_.kept);
    files_.push_back(last_.name);
  }

  // Sectors with their bytes, in the order of the snapshot.
  std::map<std::int64_t, std::string> read() const {
    const auto chunks = read_parts(
        last_.name, [this](const std::string& part) { return path_of(part); }, system_disk());
    EXPECT_TRUE(chunks.ok()) << chunks.status();
    std::map<std::int64_t, std::string> sectors;
    if (!chunks.ok()) return sectors;
    EXPECT_EQ(chunks->back().end().chunks() + 1, chunks->size());
    for (const v1::SnapshotChunk& chunk : *chunks) {
      EXPECT_THAT(chunk.key(), IsEmpty());
      if (chunk.has_sectors()) sectors.emplace(static_cast<std::int64_t>(sectors.size()), chunk.sectors());
    }
    return sectors;
  }

  std::filesystem::path folder_;
  StateParts parts_;
  StatePart last_;
  std::vector<std::string> files_;
  int written_ = 0;
  std::uint64_t bytes_written_ = 0;
};

TEST_F(StatePartsTest, TheLastChangeOfEachKeyCounts) {
  write(change_of({sector_chunk(-1, std::string(10'000, 'a')), sector_chunk(2, "b"), sector_chunk(3, "c")},
                  true));
  write(change_of({sector_chunk(2, "d"), absence_of(sector_key({3, 0, 0}))}));
  EXPECT_EQ(files_.size(), 2u);
  EXPECT_THAT(parts_before(path_of(last_.name), system_disk()), ::testing::ElementsAre("1"));
  EXPECT_EQ(read(), (std::map<std::int64_t, std::string>{{0, std::string(10'000, 'a')}, {1, "d"}}));
}

TEST_F(StatePartsTest, SharedBlocksAreOneChunkAgain) {
  StateChange change = change_of({sector_chunk(1, "x")}, true);
  for (std::uint64_t block = 0; block < 3; ++block) {
    auto chunk = std::make_shared<v1::SnapshotChunk>();
    chunk->set_key(chunk_key(v1::SnapshotChunk::kShared, block));
    chunk->set_shared(std::string(2, static_cast<char>('a' + block)));
    put(std::move(chunk), change.chunks);
  }
  const std::vector<v1::SnapshotChunk> chunks = snapshot_of(change.chunks);
  ASSERT_EQ(chunks.size(), 3u);
  EXPECT_EQ(chunks[0].shared(), "aabbcc");
}

// Any changes are read again, from a few files, which together are not much larger than the state, and little
// more is written than what has changed.
TEST_F(StatePartsTest, ManyChangesAreFewFiles) {
  std::mt19937 random(1);
  std::map<std::int64_t, std::string> state;
  const auto bytes_of_state = [&] {
    std::uint64_t bytes = 0;
    for (const auto& [sector, contents] : state) bytes += contents.size() + 60;
    return bytes;
  };
  StateChange first{.is_whole = true, .chunks = {}};
  for (int sector = 0; sector < 1000; ++sector) {
    put(sector_chunk(sector, state[sector] = std::string(100 + random() % 900, 'a')), first.chunks);
  }
  write(first);
  bytes_written_ = 0;
  std::uint64_t changed = 0;
  for (int n = 0; n < 400; ++n) {
    StateChange change;
    for (unsigned count = 1 + random() % 8; count > 0; --count) {
      const std::int64_t sector = random() % 1000;
      if (random() % 8 == 0) {
        state.erase(sector);
        put(absence_of(sector_key({sector, 0, 0})), change.chunks);
      } else {
        state[sector] = std::string(100 + random() % 900, static_cast<char>('a' + n % 26));
        put(sector_chunk(sector, state[sector]), change.chunks);
      }
    }
    for (const auto& [key, chunk] : change.chunks) changed += chunk->ByteSizeLong() + 16;
    write(change);
    ASSERT_LE(files_.size(), 12u);
  }
  std::vector<std::string> expected;
  for (const auto& [sector, contents] : state) expected.push_back(contents);
  std::vector<std::string> found;
  for (const auto& [n, contents] : read()) found.push_back(contents);
  EXPECT_EQ(found, expected);
  std::uint64_t on_disk = 0;
  for (const std::string& file : files_) on_disk += std::filesystem::file_size(path_of(file));
  EXPECT_LT(on_disk, 3 * bytes_of_state());
  EXPECT_LT(bytes_written_, 8 * changed);
}

// A world of which everything moves but what has never changed.
TEST_F(StatePartsTest, FilesOfWhichNothingIsLeftAreDroppedUnread) {
  write(change_of({sector_chunk(1, std::string(40'000, 'a')), sector_chunk(2, std::string(50'000, 'b')),
                   sector_chunk(3, std::string(50'000, 'c'))},
                  true));
  for (char tick = 'd'; tick < 'm'; ++tick) {
    write(
        change_of({sector_chunk(2, std::string(50'000, tick)), sector_chunk(3, std::string(50'000, tick))}));
    EXPECT_THAT(last_.merged, IsEmpty());
    EXPECT_EQ(files_.size(), 2u);
  }
  EXPECT_LT(bytes_written_, 140'000u + 9 * 100'000u + 4096u);
  EXPECT_EQ(read(), (std::map<std::int64_t, std::string>{{0, std::string(40'000, 'a')},
                                                         {1, std::string(50'000, 'l')},
                                                         {2, std::string(50'000, 'l')}}));
  // What had never changed does, so the first file is needed no more.
  write(change_of({sector_chunk(1, "e")}));
  EXPECT_EQ(files_.size(), 2u);
  write(change_of({absence_of(sector_key({1, 0, 0}))}));
  write(change_of({absence_of(sector_key({2, 0, 0})), sector_chunk(3, "f")}));
  EXPECT_EQ(read(), (std::map<std::int64_t, std::string>{{0, "f"}}));
}

TEST_F(StatePartsTest, AStoreFindsTheStateAndRemovesFilesThatItDoesNotNeed) {
  const auto open = [&] {
    auto store = open_folder_store(folder_);
    EXPECT_TRUE(store.ok()) << store.status();
    return *std::move(store);
  };
  const auto files = [&] {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      count += entry.path().extension() == ".state" ? 1 : 0;
    return count;
  };
  {
    const auto store = open();
    ASSERT_TRUE(store->begin(1, to_proto(small_world())).ok());
    EXPECT_TRUE(store->wants_whole());
    const auto change = [&](const StateChange& next, std::uint64_t position) {
      while (!store->change(next, position)) ASSERT_TRUE(store->tend().ok());
    };
    StateChange whole = state_of(1);
    put(sector_chunk(1, std::string(50'000, 'a')), whole.chunks);
    change(whole, 0);
    EXPECT_FALSE(store->wants_whole());
    for (Tick tick = 2; tick < 20; ++tick) {
      ASSERT_TRUE(store->append({stored_removal(tick)}).ok());
      StateChange next = state_of(tick);
      next.is_whole = false;
      change(next, store->position());
    }
    // The second is being written once the first is there, at the latest.
    change(StateChange(), store->position());
    EXPECT_EQ(files(), 2u);
  }
  auto store = open();
  const auto stored = store->take_stored();
  ASSERT_TRUE(stored);
  const auto& chunks = std::get<SnapshotChunks>(stored->state);
  EXPECT_EQ(chunks[0].head().tick(), 19u);
  EXPECT_EQ(chunks[1].sectors().size(), 50'000u);
  EXPECT_THAT(stored->inputs, IsEmpty());
  EXPECT_TRUE(store->wants_whole());
  ASSERT_TRUE(store->end().ok());
  EXPECT_EQ(files(), 0u);
}

}  // namespace
}  // namespace tessera
