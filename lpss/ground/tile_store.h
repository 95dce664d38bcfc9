// Tiles of ground that a process has at hand: made on threads of their own before they are needed, and
// forgotten when others are needed more.
#pragma once

#include <absl/container/flat_hash_map.h>
#include <absl/container/flat_hash_set.h>
#include <absl/status/statusor.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "lpss/ground/tile.h"
#include "lpss/model/shape.h"

namespace tessera {

inline constexpr std::size_t kTilesAskedMax = 65'536;  // that wait to be made; what is asked beyond is not

// Nothing that a tick computes depends on what is in the store, or on when it came. Safe to call from any
// thread.
class TileStore {
 public:
  struct Options {
    std::size_t bytes_max = std::size_t{256} << 20;  // of tiles; what is in use beside does not count
    int threads = 1;                                 // 0: tiles are made only when they are needed
  };

  // A source that the store knows, for its tiles. Sources of equal grounds are the same.
  struct Source {
    std::uint64_t id = 0;
    Ground ground;
    std::unique_ptr<TileSource> tiles;
  };
  using SourceRef = std::shared_ptr<const Source>;

  // Opens grounds of files; see set_opener().
  using Opener = std::function<absl::StatusOr<std::unique_ptr<TileSource>>(const Ground&)>;

  struct Counts {
    std::uint64_t tiles = 0;    // at hand
    std::uint64_t bytes = 0;    // of these
    std::uint64_t made = 0;     // so far
    std::uint64_t waits = 0;    // tiles that were not there when they were needed, so far
    std::uint64_t waiting = 0;  // callers of get(), now
    std::uint64_t pending = 0;  // asked for, and not made yet
  };

  explicit TileStore(Options options);
  ~TileStore();
  TileStore(const TileStore&) = delete;
  TileStore& operator=(const TileStore&) = delete;

  // The one that partitions use, unless they are given another.
  static TileStore& of_process();

  // From now on. Threads that run go on.
  void set_options(Options options);

  // What opens grounds from files: whoever knows disks gives it, before such a ground is opened.
  void set_opener(Opener opener);

  // Errors: those of the opener; UNIMPLEMENTED for a ground of files if there is none.
  absl::StatusOr<SourceRef> open(const Ground& ground);

  // The tile; waits until it is there. Stops the process with a message where it cannot be made: nothing can
  // go on without the ground.
  std::shared_ptr<const Tile> get(const Source& source, const TileKey& key);

  // Has the tiles made soon, on the store's threads.
  void ask(const SourceRef& source, const std::vector<TileKey>& keys);

  Counts counts() const;

 private:
  using Id = std::pair<std::uint64_t, TileKey>;  // of the source, and in it
  struct Entry {
    std::shared_ptr<const Tile> tile;   // null while it is made
    std::list<Id>::iterator last_used;  // of one that is there
  };
  struct Asked {
    SourceRef source;
    TileKey key;
  };

  void work();
  // Makes a tile that nobody else makes, without the lock.
  absl::StatusOr<std::shared_ptr<const Tile>> make(std::unique_lock<std::mutex>& lock, const Source& source,
                                                   const TileKey& key);
  void evict();

  mutable std::mutex mutex_;
  std::condition_variable asked_changed_;
  std::condition_variable made_;
  Options options_;
  Opener opener_;
  std::uint64_t next_id_ = 1;
  std::vector<std::weak_ptr<const Source>> sources_;
  absl::flat_hash_map<Id, Entry> entries_;
  std::list<Id> used_;  // of those that are there, the longest unused first
  std::deque<Asked> asked_;
  absl::flat_hash_set<Id> asked_ids_;
  Counts counts_;
  bool ends_ = false;
  std::vector<std::thread> threads_;
};

// Whether all grounds of these shapes can be opened: to be asked before a partition gets a shape. Errors:
// those of TileStore::open().
absl::Status open_grounds(std::span<const Shape> shapes, TileStore& store = TileStore::of_process());
absl::Status open_grounds(std::span<const ShapeEntry> shapes, TileStore& store = TileStore::of_process());

}  // namespace tessera
