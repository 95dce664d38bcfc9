#include "simulator/simulated_disk.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <optional>

namespace tessera {
namespace {

constexpr std::uint32_t kDiskStream = 4;
constexpr std::size_t kSectorBytes = 512;
constexpr int kCallsToFinish = 5;  // of Work::done()

absl::Status status_of(SimulatedDisk::Outcome outcome, const std::filesystem::path& file) {
  switch (outcome) {
    case SimulatedDisk::Outcome::kDone:
      return absl::OkStatus();
    case SimulatedDisk::Outcome::kFull:
      return absl::UnavailableError(
          absl::StrCat("cannot write ", file.string(), ": No space left on device"));
    case SimulatedDisk::Outcome::kFailed:
      break;
  }
  return absl::UnavailableError(absl::StrCat("cannot use ", file.string(), ": Input/output error"));
}

class MemoryFile final : public Disk::File {
 public:
  MemoryFile(SimulatedDisk& disk, std::filesystem::path file, SimulatedDisk::InodePtr inode)
      : disk_(disk), file_(std::move(file)), inode_(std::move(inode)) {}

  absl::Status append(std::string_view bytes) override {
    return status_of(disk_.append(*inode_, bytes), file_);
  }
  absl::Status sync() override { return status_of(disk_.sync(*inode_), file_); }

 private:
  SimulatedDisk& disk_;
  const std::filesystem::path file_;
  const SimulatedDisk::InodePtr inode_;
};

class LateWork final : public Disk::Work {
 public:
  explicit LateWork(std::function<absl::Status()> work) : work_(std::move(work)) {}

  bool done() override {
    if (--calls_left_ == 0) result_ = work_();
    return result_.has_value();
  }
  absl::Status wait() override { return result_ ? *result_ : work_(); }

 private:
  std::function<absl::Status()> work_;
  int calls_left_ = kCallsToFinish;
  std::optional<absl::Status> result_;
};

}  // namespace

SimulatedDisk::SimulatedDisk(std::uint64_t seed) : dice_(seed, kDiskStream) {}

bool SimulatedDisk::fails() {
  if (has_ended_) return true;
  if (operations_left_ == 0) {
    has_ended_ = true;
    return true;
  }
  --operations_left_;
  if (!is_failing_ || dice_.one_in(2)) return false;
  ++faults_.failed;
  return true;
}

void SimulatedDisk::begin_user() {
  has_ended_ = false;
  operations_left_ = UINT64_MAX;
}

void SimulatedDisk::apply(const Inode::Change& change, std::string& bytes) const {
  const std::size_t end = change.offset + change.bytes.size();
  if (bytes.size() < end) bytes.resize(end);
  bytes.replace(change.offset, change.bytes.size(), change.bytes);
}

// Of each change, any sectors.
void SimulatedDisk::settle(Inode& inode) {
  for (const Inode::Change& change : inode.unsynced_) {
    const std::uint64_t fate = dice_.below(3);
    if (fate == 0) {
      ++faults_.forgotten_writes;
    } else if (fate == 1) {
      apply(change, inode.synced_);
    } else {
      bool any_lost = false;
      for (std::size_t at = 0; at < change.bytes.size();) {
        const std::size_t size =
            std::min(change.bytes.size() - at, kSectorBytes - (change.offset + at) % kSectorBytes);
        if (dice_.one_in(2)) {
          apply({change.offset + at, change.bytes.substr(at, size)}, inode.synced_);
        } else {
          any_lost = true;
        }
        at += size;
      }
      faults_.torn_writes += any_lost ? 1 : 0;
    }
  }
  inode.unsynced_.clear();
  inode.now_ = inode.synced_;
}

void SimulatedDisk::lose_power() {
  if (!unsynced_names_.empty()) {
    const std::size_t kept = dice_.below(unsynced_names_.size() + 1);
    if (kept < unsynced_names_.size()) names_ = unsynced_names_[kept];
    unsynced_names_.clear();
  }
  for (const auto& [name, inode] : names_) settle(*inode);
}

std::string SimulatedDisk::contents(const std::filesystem::path& file) const {
  const InodePtr inode = find(file.string());
  return inode ? inode->now_ : std::string();
}

SimulatedDisk::InodePtr SimulatedDisk::find(const std::string& name) const {
  const auto place = names_.find(name);
  return place == names_.end() ? nullptr : place->second;
}

SimulatedDisk::Outcome SimulatedDisk::append(Inode& inode, std::string_view bytes) {
  if (fails()) return Outcome::kFailed;
  Inode::Change change{inode.now_.size(), std::string(bytes)};
  if (is_full_) {
    ++faults_.full;
    change.bytes.resize(dice_.below(bytes.size() + 1));  // what there was room for
  }
  apply(change, inode.now_);
  inode.unsynced_.push_back(std::move(change));
  return is_full_ ? Outcome::kFull : Outcome::kDone;
}

// After a sync that failed, a later one does not help what the failed one has given up.
SimulatedDisk::Outcome SimulatedDisk::sync(Inode& inode) {
  if (fails()) {
    if (!has_ended_) {
      std::erase_if(inode.unsynced_, [&](const Inode::Change&) { return dice_.one_in(2); });
    }
    return Outcome::kFailed;
  }
  for (const Inode::Change& change : inode.unsynced_) apply(change, inode.synced_);
  inode.unsynced_.clear();
  return Outcome::kDone;
}

SimulatedDisk::Outcome SimulatedDisk::sync_names() {
  if (fails()) return Outcome::kFailed;
  unsynced_names_.clear();
  return Outcome::kDone;
}

absl::Status SimulatedDisk::make_folder(const std::filesystem::path& folder) {
  return fails() ? status_of(Outcome::kFailed, folder) : absl::OkStatus();
}

std::vector<std::filesystem::path> SimulatedDisk::files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& [name, inode] : names_) {
    const std::filesystem::path path(name);
    if (path.parent_path() == folder) files.push_back(path);
  }
  return files;
}

absl::StatusOr<std::unique_ptr<Disk::Lock>> SimulatedDisk::lock(const std::filesystem::path& file) {
  if (fails()) return status_of(Outcome::kFailed, file);
  return std::make_unique<Lock>();
}

absl::StatusOr<std::unique_ptr<Disk::File>> SimulatedDisk::create(const std::filesystem::path& file) {
  if (fails()) return status_of(Outcome::kFailed, file);
  unsynced_names_.push_back(names_);
  return std::make_unique<MemoryFile>(*this, file, names_[file.string()] = std::make_shared<Inode>());
}

absl::Status SimulatedDisk::rename(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (fails()) return status_of(Outcome::kFailed, to);
  unsynced_names_.push_back(names_);
  names_[to.string()] = names_.extract(from.string()).mapped();
  return status_of(sync_names(), to);
}

void SimulatedDisk::remove(const std::filesystem::path& file) {
  if (fails()) return;
  unsynced_names_.push_back(names_);
  names_.erase(file.string());
}

absl::Status SimulatedDisk::read(const std::filesystem::path& file,
                                 const std::function<absl::Status(std::string_view)>& take) {
  const InodePtr inode = find(file.string());
  if (!inode) return absl::NotFoundError(absl::StrCat("cannot read ", file.string()));
  if (fails()) return status_of(Outcome::kFailed, file);
  return take(inode->now_);
}

std::unique_ptr<Disk::Work> SimulatedDisk::in_background(std::function<absl::Status()> work) {
  return std::make_unique<LateWork>(std::move(work));
}

}  // namespace tessera
