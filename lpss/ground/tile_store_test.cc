#include "lpss/ground/tile_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace tessera {
namespace {

Ground rolling_plain() { return {.spacing = 8, .height = 60, .wavelength = 800, .octaves = 4}; }

// All that was asked for.
void wait_until_made(const TileStore& store) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (store.counts().pending > 0 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
}

TEST(TileStore, KeepsNoMoreThanItsLimit) {
  TileStore store({.bytes_max = 100'000, .threads = 0});
  const TileStore::SourceRef source = store.open(rolling_plain()).value();
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 40; ++i) EXPECT_EQ(store.get(*source, {0, i, 0})->triangles.size(), 512u);
  }
  const TileStore::Counts counts = store.counts();
  EXPECT_LE(counts.bytes, 100'000u);
  EXPECT_GT(counts.tiles, 1u);
  EXPECT_EQ(counts.made, 80u);
}

TEST(TileStore, ForgetsTheLongestUnused) {
  TileStore store({.bytes_max = 3 * 14'000, .threads = 0});
  const TileStore::SourceRef source = store.open(rolling_plain()).value();
  store.get(*source, {0, 0, 0});
  for (int i = 1; i < 10; ++i) {
    store.get(*source, {0, i, 0});
    store.get(*source, {0, 0, 0});
  }
  EXPECT_EQ(store.counts().made, 10u);
}

TEST(TileStore, HasWhatWasAskedFor) {
  TileStore store({.threads = 2});
  const TileStore::SourceRef source = store.open(rolling_plain()).value();
  std::vector<TileKey> keys;
  for (int i = 0; i < 50; ++i) keys.push_back({0, i, -i});
  store.ask(source, keys);
  wait_until_made(store);
  for (const TileKey& key : keys) store.get(*source, key);
  EXPECT_EQ(store.counts().waits, 0u);
  EXPECT_EQ(store.counts().made, 50u);
}

TEST(TileStore, MakesATileOnceForMany) {
  TileStore store({.threads = 2});
  const TileStore::SourceRef source = store.open(rolling_plain()).value();
  std::vector<std::thread> threads;
  for (int n = 0; n < 4; ++n) {
    threads.emplace_back([&] {
      for (int i = 0; i < 50; ++i) {
        store.ask(source, {{0, i + 5, 0}});
        store.get(*source, {0, i, 0});
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  wait_until_made(store);
  EXPECT_EQ(store.counts().made, 55u);
}

TEST(TileStore, GivesEqualGroundsOneSource) {
  TileStore store({});
  const TileStore::SourceRef one = store.open(rolling_plain()).value();
  EXPECT_EQ(store.open(rolling_plain()).value(), one);
  Ground other = rolling_plain();
  other.seed = 1;
  EXPECT_NE(store.open(other).value()->id, one->id);
}

TEST(TileStore, SaysWhereItCannotOpen) {
  TileStore store({});
  Ground files = {.source = Ground::Source::kFolder, .folder = "here"};
  EXPECT_EQ(store.open(files).status().code(), absl::StatusCode::kUnimplemented);
  store.set_opener([](const Ground&) { return absl::NotFoundError("no such folder"); });
  EXPECT_EQ(store.open(files).status().message(), "no such folder");
}

class Broken final : public TileSource {
 public:
  std::vector<TileKey> overlapping(const Eigen::AlignedBox3d&) const override { return {{}}; }
  absl::StatusOr<Tile> make(const TileKey&) const override { return absl::DataLossError("the disk is gone"); }
};

TEST(TileStoreDeathTest, NothingGoesOnWithoutTheGround) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  TileStore store({.threads = 0});
  store.set_opener([](const Ground&) { return std::make_unique<Broken>(); });
  const TileStore::SourceRef source =
      store.open({.source = Ground::Source::kFolder, .folder = "here"}).value();
  EXPECT_DEATH(store.get(*source, {}), "the ground cannot be read.*the disk is gone");
}

}  // namespace
}  // namespace tessera
