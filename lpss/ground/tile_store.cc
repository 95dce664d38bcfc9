#include "lpss/ground/tile_store.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <variant>

namespace tessera {

TileStore::TileStore(Options options) : options_(options) {}

TileStore::~TileStore() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    asked_.clear();
  }
  asked_changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

TileStore& TileStore::of_process() {
  // Never destroyed: its threads may still be at work when the process ends.
  static TileStore& store = *new TileStore(Options{});
  return store;
}

void TileStore::set_options(Options options) {
  const std::lock_guard lock(mutex_);
  options_ = options;
  evict();
}

void TileStore::set_opener(Opener opener) {
  const std::lock_guard lock(mutex_);
  opener_ = std::move(opener);
}

absl::StatusOr<TileStore::SourceRef> TileStore::open(const Ground& ground) {
  const std::lock_guard lock(mutex_);
  std::unique_ptr<TileSource> tiles;
  if (ground.source == Ground::Source::kFolder) {
    if (!opener_) return absl::UnimplementedError("ground from files: this program does not read any");
    // Also where it is known: files may have changed.
    absl::StatusOr<std::unique_ptr<TileSource>> opened = opener_(ground);
    if (!opened.ok()) return opened.status();
    tiles = *std::move(opened);
  } else {
    tiles = make_hills(ground);
  }
  std::erase_if(sources_, [](const std::weak_ptr<const Source>& source) { return source.expired(); });
  for (const std::weak_ptr<const Source>& known : sources_) {
    SourceRef source = known.lock();
    if (source && source->ground == ground) return source;
  }
  auto source = std::make_shared<Source>();
  source->id = next_id_++;
  source->ground = ground;
  source->tiles = std::move(tiles);
  sources_.push_back(source);
  return source;
}

std::shared_ptr<const Tile> TileStore::get(const Source& source, const TileKey& key) {
  const Id id{source.id, key};
  std::unique_lock lock(mutex_);
  if (const auto entry = entries_.find(id); entry != entries_.end() && entry->second.tile) {
    used_.splice(used_.end(), used_, entry->second.last_used);
    return entry->second.tile;
  }
  ++counts_.waits;
  ++counts_.waiting;
  std::shared_ptr<const Tile> tile;
  while (!tile) {
    const auto entry = entries_.find(id);
    if (entry != entries_.end()) {
      tile = entry->second.tile;
      if (!tile) made_.wait(lock);
      continue;
    }
    const absl::StatusOr<std::shared_ptr<const Tile>> made = make(lock, source, key);
    if (!made.ok()) {
      std::fprintf(stderr, "the ground cannot be read, and nothing goes on without it: %s\n",
                   std::string(made.status().message()).c_str());
      std::abort();
    }
    tile = *made;
  }
  --counts_.waiting;
  return tile;
}

absl::StatusOr<std::shared_ptr<const Tile>> TileStore::make(std::unique_lock<std::mutex>& lock,
                                                            const Source& source, const TileKey& key) {
  const Id id{source.id, key};
  entries_.try_emplace(id);
  lock.unlock();
  absl::StatusOr<Tile> made = source.tiles->make(key);
  lock.lock();
  if (!made.ok()) {
    entries_.erase(id);
    made_.notify_all();
    return made.status();
  }
  auto tile = std::make_shared<const Tile>(*std::move(made));
  Entry& entry = entries_[id];
  entry.tile = tile;
  entry.last_used = used_.insert(used_.end(), id);
  ++counts_.made;
  ++counts_.tiles;
  counts_.bytes += tile->bytes();
  evict();
  made_.notify_all();
  return std::shared_ptr<const Tile>(std::move(tile));
}

void TileStore::evict() {
  while (counts_.bytes > options_.bytes_max && used_.size() > 1) {
    const auto entry = entries_.find(used_.front());
    --counts_.tiles;
    counts_.bytes -= entry->second.tile->bytes();
    entries_.erase(entry);
    used_.pop_front();
  }
}

void TileStore::ask(const SourceRef& source, const std::vector<TileKey>& keys) {
  {
    const std::lock_guard lock(mutex_);
    if (options_.threads == 0) return;
    for (const TileKey& key : keys) {
      const Id id{source->id, key};
      if (const auto entry = entries_.find(id); entry != entries_.end()) {
        if (entry->second.tile) used_.splice(used_.end(), used_, entry->second.last_used);
        continue;
      }
      if (asked_.size() >= kTilesAskedMax) break;
      if (!asked_ids_.insert(id).second) continue;
      asked_.push_back({source, key});
      ++counts_.pending;
    }
    if (asked_.empty()) return;
    while (static_cast<int>(threads_.size()) < options_.threads) threads_.emplace_back([this] { work(); });
  }
  asked_changed_.notify_all();
}

void TileStore::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    asked_changed_.wait(lock, [this] { return ends_ || !asked_.empty(); });
    if (ends_) return;
    const Asked asked = std::move(asked_.front());
    asked_.pop_front();
    const Id id{asked.source->id, asked.key};
    asked_ids_.erase(id);
    // One that fails is made again when it is needed, and fails there.
    if (!entries_.contains(id)) (void)make(lock, *asked.source, asked.key);
    --counts_.pending;
  }
}

TileStore::Counts TileStore::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

absl::Status open_grounds(std::span<const Shape> shapes, TileStore& store) {
  for (const Shape& shape : shapes) {
    for (const ShapePart& part : shape.parts) {
      const auto* ground = std::get_if<Ground>(&part.geometry);
      if (ground == nullptr) continue;
      if (absl::Status status = store.open(*ground).status(); !status.ok()) return status;
    }
  }
  return absl::OkStatus();
}

absl::Status open_grounds(std::span<const ShapeEntry> shapes, TileStore& store) {
  for (const ShapeEntry& entry : shapes) {
    if (absl::Status status = open_grounds({entry.shape.get(), 1}, store); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace tessera
