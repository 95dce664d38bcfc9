// A disk in memory that tears writes, forgets what was not synced, fills up and fails, from a seed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "proto/disk.h"
#include "simulator/dice.h"

namespace tessera {

// How often each fault had an effect.
struct DiskFaultCounts {
  std::uint64_t torn_writes = 0;       // of which a part was lost with the power
  std::uint64_t forgotten_writes = 0;  // that were lost with it as a whole
  std::uint64_t full = 0;              // writes that found no room
  std::uint64_t failed = 0;            // reads, writes and syncs with an error
};

// What is written can be read at once. A process that ends loses nothing of it. When the power is lost, only
// what was synced is sure: of everything else any part may be there, in any order, by sectors of 512 bytes.
// Creations, renamings and removals last in their order, up to any of them that comes after the last sync of
// a new file or its folder.
class SimulatedDisk final : public Disk {
 public:
  explicit SimulatedDisk(std::uint64_t seed);
  SimulatedDisk(const SimulatedDisk&) = delete;
  SimulatedDisk& operator=(const SimulatedDisk&) = delete;

  // From now on, what would make files larger finds no room, or does again.
  void set_full(bool is_full) { is_full_ = is_full; }
  // From now on, every other read, write and sync fails; what was written may be forgotten in spite of a
  // later sync.
  void set_failing(bool is_failing) { is_failing_ = is_failing; }

  // The process that uses the disk ends after so many more operations, in the middle of one: later ones do
  // nothing, and fail.
  void end_user_after(std::uint64_t operations) { operations_left_ = operations; }
  // Whether it has ended.
  bool user_has_ended() const { return has_ended_; }
  // It ends now.
  void end_user() { has_ended_ = true; }
  // Another process begins to use it, once nothing of the last one is left.
  void begin_user();

  // Forgets what was not synced, or a part of it. While nobody uses it.
  void lose_power();

  // Makes what is there permanent for the tests that look at it: the bytes of one file, empty if there is
  // none.
  std::string contents(const std::filesystem::path& file) const;

  const DiskFaultCounts& faults() const { return faults_; }

  absl::Status make_folder(const std::filesystem::path& folder) override;
  std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) override;
  absl::StatusOr<std::unique_ptr<File>> create(const std::filesystem::path& file) override;
  absl::Status rename(const std::filesystem::path& from, const std::filesystem::path& to) override;
  void remove(const std::filesystem::path& file) override;
  absl::Status read(const std::filesystem::path& file,
                    const std::function<absl::Status(std::string_view)>& take) override;
  // One process at a time uses it.
  absl::StatusOr<std::unique_ptr<Lock>> lock(const std::filesystem::path& file) override;
  // It is done after some calls of done(), in the last of them.
  std::unique_ptr<Work> in_background(std::function<absl::Status()> work) override;

  // What files that are open use, too.
  enum class Outcome { kDone, kFull, kFailed };

  class Inode {
   public:
    const std::string& bytes() const { return now_; }

   private:
    friend class SimulatedDisk;

    // A change that has not been synced: bytes that were written.
    struct Change {
      std::size_t offset = 0;
      std::string bytes;
    };

    std::string now_;
    std::string synced_;
    std::vector<Change> unsynced_;
  };
  using InodePtr = std::shared_ptr<Inode>;

  Outcome append(Inode& inode, std::string_view bytes);
  Outcome sync(Inode& inode);

 private:
  using Names = std::map<std::string, InodePtr>;

  InodePtr find(const std::string& name) const;
  Outcome sync_names();

  // Counts an operation; whether it has an error of its own.
  bool fails();
  void settle(Inode& inode);
  void apply(const Inode::Change& change, std::string& bytes) const;

  Dice dice_;
  Names names_;
  std::vector<Names> unsynced_names_;  // as they were before each change since they were synced
  bool is_full_ = false;
  bool is_failing_ = false;
  bool has_ended_ = false;
  std::uint64_t operations_left_ = UINT64_MAX;
  DiskFaultCounts faults_;
};

}  // namespace tessera
