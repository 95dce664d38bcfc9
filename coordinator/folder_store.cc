#include "coordinator/folder_store.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/input_log.h"
#include "coordinator/state_parts.h"
#include "coordinator/store_reader.h"
#include "coordinator/stored_state.h"
#include "proto/whole_file.h"

namespace tessera {
namespace {

// Inputs since the state that is stored, as several logs one after the other: each says in its head which
// state that was when it began, and the last one counts.
class FolderStore final : public WorldStore {
 public:
  FolderStore(StoreFiles files, std::unique_ptr<Disk::Lock> lock, Disk& disk)
      : files_(std::move(files)), lock_(std::move(lock)), disk_(disk) {}

  absl::Status read() {
    absl::StatusOr<StoreContents> contents = read_store(files_, disk_);
    if (!contents.ok()) return contents.status();
    if (contents->logs.empty()) return absl::OkStatus();
    if (!contents->lost.empty()) return absl::DataLossError(contents->lost);
    if (contents->has_world() && !contents->state.ok()) return contents->state.status();
    if (absl::Status status = mend_logs(files_, *contents, disk_); !status.ok()) return status;
    take(*std::move(contents));
    if (head_.set_aside()) return move_aside();
    remove_others();
    return absl::OkStatus();
  }

  // All that is left becomes all that there was, without inputs that are lost.
  absl::Status read_what_is_left() {
    absl::StatusOr<StoreContents> contents = read_store(files_, disk_);
    if (!contents.ok()) return contents.status();
    if (!contents->has_world()) return absl::NotFoundError("no world is stored");
    if (!contents->state.ok()) return contents->state.status();
    take(*std::move(contents));
    const std::vector<v1::StoredInput> inputs = stored_->inputs;
    position_ = head_.position();
    if (absl::Status status = begin_log(head_); !status.ok()) return status;
    if (absl::Status status = append(inputs); !status.ok()) return status;
    remove_others();
    return absl::OkStatus();
  }

  std::optional<StoredWorld> take_stored() override { return std::exchange(stored_, std::nullopt); }

  absl::StatusOr<StoredWorld> read_again() override {
    absl::StatusOr<StoreContents> contents = read_store(files_, disk_);
    if (!contents.ok()) return contents.status();
    if (!contents->lost.empty()) return absl::DataLossError(contents->lost);
    if (!contents->state.ok()) return contents->state.status();
    return StoredWorld{contents->head().load(), *std::move(contents->state), std::move(contents->inputs), {}};
  }

  absl::Status begin(std::uint64_t load, const StoredState& state) override {
    wait_for_background();
    const std::uint64_t file = next_state();
    const std::string name = absl::StrCat(file);
    if (absl::Status status = write_state(files_.state(name), state, disk_); !status.ok()) return status;
    wants_whole_ = true;
    return refer_to(load, file, {name}, position_);
  }

  absl::Status end() override {
    wait_for_background();
    return refer_to(0, 0, {}, position_);
  }

  // The head of a new log decides; the files then follow, also where this process ends in the middle.
  absl::StatusOr<std::string> set_aside(const std::string& reason) override {
    wait_for_background();
    if (head_.state() == 0) return std::string();
    const std::filesystem::path aside = files_.aside();
    if (absl::Status status = disk_.make_folder(aside); !status.ok()) return status;
    for (const std::filesystem::path& file : disk_.files_in(aside)) disk_.remove(file);
    if (absl::Status status = write_reason(files_.aside_reason(), reason); !status.ok()) return status;
    v1::InputLogHead head;
    head.set_set_aside(true);
    head.set_position(position_);
    if (absl::Status status = begin_log(std::move(head)); !status.ok()) return status;
    state_files_.clear();
    if (absl::Status status = move_aside(); !status.ok()) return status;
    return aside.string();
  }

  absl::Status append(const std::vector<v1::StoredInput>& inputs) override {
    // After an error, nobody knows what the log has at its end.
    if (!log_) {
      if (absl::Status status = begin_log(head_); !status.ok()) return status;
    }
    v1::InputBatch batch;
    batch.mutable_inputs()->Add(inputs.begin(), inputs.end());
    if (absl::Status status = log_->append(batch); !status.ok()) {
      log_.reset();
      return status;
    }
    position_ += inputs.size();
    return absl::OkStatus();
  }
  std::uint64_t position() const override { return position_; }

  bool wants_whole() const override { return wants_whole_; }

  bool change(StateChange change, std::uint64_t position) override {
    if (background_) return false;
    StatePart part = parts_.add(absl::StrCat(next_state()), change);
    next_state_files_ = part.kept;
    next_state_files_.push_back(part.name);
    next_position_ = position;
    wants_whole_ = false;
    background_ = disk_.in_background([this, part = std::move(part), change = std::move(change)] {
      return write_part(
          part, change, [this](const auto& name) { return files_.state(name); }, disk_);
    });
    return true;
  }

  absl::Status tend() override {
    if (!background_ || !background_->done()) return absl::OkStatus();
    const std::unique_ptr<Disk::Work> work = std::move(background_);
    absl::Status status = work->wait();
    if (status.ok())
      status = refer_to(head_.load(), next_state(), std::move(next_state_files_), next_position_);
    wants_whole_ |= !status.ok();
    return status;
  }

  // A state that is being written is of no use any more.
  ~FolderStore() override { wait_for_background(); }

 private:
  // The number of the state that is written next: those of all states so far are below.
  std::uint64_t next_state() const { return last_state_ + 1; }

  // Reading has found nothing lost, or that does not matter.
  void take(StoreContents contents) {
    head_ = contents.head();
    for (const FoundLog& log : contents.logs) {
      logs_.push_back({log.number, log.read.head.first()});
    }
    last_log_ = contents.last_log;
    last_state_ = head_.state();
    position_ = contents.position;
    if (!contents.has_world()) return;
    stored_ =
        StoredWorld{head_.load(), *std::move(contents.state), std::move(contents.inputs), contents.damage()};
    state_files_ = std::move(contents.state_files);
  }

  // Makes a log the last one.
  absl::Status begin_log(v1::InputLogHead head) {
    const std::uint64_t number = ++last_log_;
    head.set_format(kInputLogFormat);
    head.set_first(position_);
    log_.reset();
    // Part of it may be there after an error: then the next one has another number.
    logs_.push_back({number, position_});
    absl::StatusOr<InputLog> log = InputLog::create(files_.log(number), head, disk_);
    if (!log.ok()) {
      for (const std::filesystem::path& file : files_.log(number)) disk_.remove(file);
      return log.status();
    }
    log_ = *std::move(log);
    head_ = std::move(head);
    return absl::OkStatus();
  }

  absl::Status refer_to(std::uint64_t load, std::uint64_t state, std::vector<std::string> files,
                        std::uint64_t position) {
    v1::InputLogHead head;
    head.set_load(load);
    head.set_state(state);
    head.set_position(position);
    last_state_ = std::max(last_state_, state);
    if (absl::Status status = begin_log(std::move(head)); !status.ok()) return status;
    state_files_ = std::move(files);
    remove_others();
    return absl::OkStatus();
  }

  absl::Status write_reason(const std::filesystem::path& file, const std::string& reason) {
    absl::StatusOr<WholeFile> out = WholeFile::create(file, disk_);
    if (!out.ok()) return out.status();
    if (absl::Status status = out->append(absl::StrCat(reason, "\n")); !status.ok()) return status;
    return out->finish();
  }

  // All but the last log.
  absl::Status move_aside() {
    logs_.erase(logs_.begin(), logs_.end() - 1);
    const InputLogFiles last = files_.log(logs_.back().number);
    for (const std::filesystem::path& file : disk_.files_in(files_.folder())) {
      if (!StoreFiles::is_ours(file) || file == last[0] || file == last[1]) continue;
      absl::Status status = disk_.rename(file, files_.aside() / file.filename());
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  void wait_for_background() {
    if (!background_) return;
    background_->wait().IgnoreError();
    background_.reset();
  }

  // Files that the last log does not need.
  void remove_others() {
    auto first_needed = std::prev(logs_.end());
    while (first_needed != logs_.begin() && first_needed->first > head_.position()) --first_needed;
    logs_.erase(logs_.begin(), first_needed);
    std::set<std::filesystem::path> needed;
    for (const std::string& name : state_files_) needed.insert(files_.state(name));
    for (const Log& log : logs_) {
      for (const std::filesystem::path& file : files_.log(log.number)) needed.insert(file);
    }
    for (const std::filesystem::path& file : disk_.files_in(files_.folder())) {
      if (StoreFiles::is_ours(file) && !needed.contains(file)) disk_.remove(file);
    }
  }

  struct Log {
    std::uint64_t number = 0;
    std::uint64_t first = 0;  // inputs before it
  };

  const StoreFiles files_;
  const std::unique_ptr<Disk::Lock> lock_;
  Disk& disk_;
  std::optional<StoredWorld> stored_;
  v1::InputLogHead head_;        // of the last log
  std::optional<InputLog> log_;  // it; none until something is to be appended
  std::vector<Log> logs_;        // those that are needed, oldest first
  std::uint64_t last_log_ = 0;
  std::uint64_t last_state_ = 0;
  std::vector<std::string> state_files_;
  StateParts parts_;                           // with the one that is being written
  bool wants_whole_ = true;                    // since nobody knows what those of another process have
  std::uint64_t position_ = 0;                 // of the last input
  std::unique_ptr<Disk::Work> background_;     // null: none is being written
  std::vector<std::string> next_state_files_;  // of the state that is being written, and
  std::uint64_t next_position_ = 0;
};

absl::StatusOr<std::unique_ptr<Disk::Lock>> lock_of(const StoreFiles& files, Disk& disk) {
  absl::StatusOr<std::unique_ptr<Disk::Lock>> lock = disk.lock(files.lock());
  if (!absl::IsAlreadyExists(lock.status())) return lock;
  return absl::AlreadyExistsError(
      absl::StrCat(files.folder().string(), ": another coordinator uses this store"));
}

absl::StatusOr<std::unique_ptr<FolderStore>> locked(const std::filesystem::path& folder, Disk& disk) {
  StoreFiles files(folder);
  absl::StatusOr<std::unique_ptr<Disk::Lock>> lock = lock_of(files, disk);
  if (!lock.ok()) return lock.status();
  return std::make_unique<FolderStore>(std::move(files), *std::move(lock), disk);
}

}  // namespace

absl::StatusOr<std::unique_ptr<WorldStore>> open_folder_store(const std::filesystem::path& folder,
                                                              Disk& disk) {
  if (absl::Status status = disk.make_folder(folder); !status.ok()) return status;
  absl::StatusOr<std::unique_ptr<FolderStore>> store = locked(folder, disk);
  if (!store.ok()) return store.status();
  if (absl::Status status = (*store)->read(); !status.ok()) return status;
  return store;
}

absl::StatusOr<StoreContents> check_folder_store(const std::filesystem::path& folder, Disk& disk) {
  const StoreFiles files(folder);
  if (disk.files_in(folder).empty())
    return absl::NotFoundError(absl::StrCat(folder.string(), ": there is no store"));
  const absl::StatusOr<std::unique_ptr<Disk::Lock>> lock = lock_of(files, disk);
  if (!lock.ok()) return lock.status();
  return read_store(files, disk);
}

absl::Status drop_what_is_lost(const std::filesystem::path& folder, Disk& disk) {
  absl::StatusOr<std::unique_ptr<FolderStore>> store = locked(folder, disk);
  if (!store.ok()) return store.status();
  return (*store)->read_what_is_left();
}

}  // namespace tessera
