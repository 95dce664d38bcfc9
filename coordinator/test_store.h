// What tests of the stores write, and what they find again.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "coordinator/world_store.h"
#include "proto/disk.h"
#include "proto/snapshot.h"

namespace tessera {

// Files in memory, for tests that damage them.
class MemoryDisk final : public Disk {
 public:
  using Files = std::map<std::filesystem::path, std::string>;
  Files files;

  absl::StatusOr<std::unique_ptr<Lock>> lock(const std::filesystem::path&) override {
    return std::make_unique<Lock>();
  }
  absl::Status make_folder(const std::filesystem::path&) override { return absl::OkStatus(); }
  std::vector<std::filesystem::path> files_in(const std::filesystem::path&) override {
    std::vector<std::filesystem::path> names;
    for (const auto& [name, bytes] : files) names.push_back(name);
    return names;
  }
  absl::StatusOr<std::unique_ptr<File>> create(const std::filesystem::path& file) override {
    files[file].clear();
    return std::make_unique<Opened>(*this, file);
  }
  absl::Status rename(const std::filesystem::path& from, const std::filesystem::path& to) override {
    renamed_[from] = to;
    files[to] = std::exchange(files[from], {});
    files.erase(from);
    return absl::OkStatus();
  }
  void remove(const std::filesystem::path& file) override { files.erase(file); }
  absl::Status read(const std::filesystem::path& file,
                    const std::function<absl::Status(std::string_view)>& take) override {
    const auto found = files.find(file);
    return found == files.end() ? absl::NotFoundError(file.string()) : take(found->second);
  }
  std::unique_ptr<Work> in_background(std::function<absl::Status()> work) override {
    return std::make_unique<DoneWork>(work());
  }

 private:
  class Opened final : public File {
   public:
    Opened(MemoryDisk& disk, std::filesystem::path file) : disk_(disk), file_(std::move(file)) {}
    absl::Status append(std::string_view bytes) override {
      const auto renamed = disk_.renamed_.find(file_);
      disk_.files[renamed == disk_.renamed_.end() ? file_ : renamed->second] += bytes;
      return absl::OkStatus();
    }
    absl::Status sync() override { return absl::OkStatus(); }

   private:
    MemoryDisk& disk_;
    const std::filesystem::path file_;
  };
  class DoneWork final : public Work {
   public:
    explicit DoneWork(absl::Status status) : status_(std::move(status)) {}
    bool done() override { return true; }
    absl::Status wait() override { return status_; }

   private:
    const absl::Status status_;
  };

  std::map<std::filesystem::path, std::filesystem::path> renamed_;
};

inline v1::StoredInput stored_removal(Tick tick) {
  v1::StoredInput input;
  input.mutable_commands()->set_tick(tick);
  input.mutable_commands()->add_commands()->mutable_remove()->mutable_body()->set_id(tick);
  return input;
}

inline std::vector<Tick> ticks_of(const std::optional<StoredWorld>& world) {
  std::vector<Tick> ticks;
  if (!world) return ticks;
  for (const v1::StoredInput& input : world->inputs) ticks.push_back(input.commands().tick());
  return ticks;
}

inline SnapshotChunks snapshot_of(Tick tick) {
  SnapshotChunks chunks(1);
  chunks[0].mutable_head()->set_tick(tick);
  chunks.push_back(end_chunk(1));
  return chunks;
}

// The same as a state that takes the place of all that is stored.
inline StateChange state_of(Tick tick) {
  StateChange state{.is_whole = true, .chunks = {}};
  auto chunk = std::make_shared<v1::SnapshotChunk>();
  chunk->set_key(chunk_key(v1::SnapshotChunk::kHead));
  chunk->mutable_head()->set_tick(tick);
  put(std::move(chunk), state.chunks);
  return state;
}

inline KeptChunk sector_chunk(std::int64_t sector, std::string bytes) {
  auto chunk = std::make_shared<v1::SnapshotChunk>();
  chunk->set_key(sector_key({sector, 0, 0}));
  chunk->set_sectors(std::move(bytes));
  return chunk;
}

}  // namespace tessera
