#include "coordinator/state_folder.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <memory>
#include <random>
#include <system_error>
#include <utility>
#include <vector>

#include "coordinator/stored_state.h"
#include "proto/disk.h"

namespace tessera {
namespace {

constexpr const char* kLockFile = "lock";
constexpr const char* kNameFile = "coordinator";
constexpr const char* kSuffix = ".state";
constexpr std::size_t kStateNameBytesMax = 64;

absl::StatusOr<std::string> bytes_of(const std::filesystem::path& file) {
  std::string bytes;
  absl::Status status = system_disk().read(file, [&](std::string_view piece) {
    bytes += piece;
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return bytes;
}

absl::Status write_bytes(const std::filesystem::path& file, std::string_view bytes) {
  absl::StatusOr<WholeFile> whole = WholeFile::create(file);
  if (!whole.ok()) return whole.status();
  if (absl::Status status = whole->append(bytes); !status.ok()) return status;
  return whole->finish();
}

}  // namespace

bool is_state_name(std::string_view name) {
  return !name.empty() && name.size() <= kStateNameBytesMax &&
         name.find_first_not_of("0123456789abcdef-") == std::string_view::npos;
}

absl::StatusOr<std::unique_ptr<StateFolder>> StateFolder::open(std::filesystem::path folder) {
  if (absl::Status status = system_disk().make_folder(folder); !status.ok()) return status;
  absl::StatusOr<std::unique_ptr<Disk::Lock>> lock = system_disk().lock(folder / kLockFile);
  if (absl::IsAlreadyExists(lock.status()))
    return absl::AlreadyExistsError(absl::StrCat(folder.string(), ": another coordinator uses this store"));
  if (!lock.ok()) return lock.status();
  std::unique_ptr<StateFolder> opened(new StateFolder(std::move(folder), *std::move(lock)));
  if (absl::Status status = opened->scan(); !status.ok()) return status;
  return opened;
}

absl::Status StateFolder::scan() {
  const std::filesystem::path name_file = folder_ / kNameFile;
  if (std::filesystem::exists(name_file)) {
    absl::StatusOr<std::string> name = bytes_of(name_file);
    if (!name.ok()) return name.status();
    coordinator_ = *std::move(name);
  } else {
    std::random_device source;
    coordinator_ = absl::StrCat(absl::Hex(source(), absl::kZeroPad8));
    if (absl::Status status = write_bytes(name_file, coordinator_); !status.ok()) return status;
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    const std::filesystem::path& path = entry.path();
    if (path.extension() == kSuffix && is_state_name(path.stem().string())) add(path.stem().string());
  }
  return absl::OkStatus();
}

std::filesystem::path StateFolder::path_of(const std::string& name) const {
  return folder_ / absl::StrCat(name, kSuffix);
}

std::vector<std::string> StateFolder::files_of(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = files_.find(name);
  if (found == files_.end()) return {};
  std::vector<std::string> files = found->second;
  files.push_back(name);
  return files;
}

bool StateFolder::holds(const std::string& name) const {
  const std::vector<std::string> files = files_of(name);
  const std::lock_guard lock(mutex_);
  return !files.empty() && std::all_of(files.begin(), files.end(),
                                       [&](const std::string& file) { return files_.contains(file); });
}

std::set<std::string> StateFolder::files() const {
  const std::lock_guard lock(mutex_);
  std::set<std::string> names;
  for (const auto& [name, before] : files_) names.insert(name);
  return names;
}

void StateFolder::add(const std::string& name) {
  std::vector<std::string> before = parts_before(path_of(name), system_disk());
  std::erase_if(before, [](const std::string& part) { return !is_state_name(part); });
  const std::lock_guard lock(mutex_);
  files_[name] = std::move(before);
}

absl::Status StateFolder::write_change(const StatePart& part, const StateChange& change) {
  absl::Status status = write_part(
      part, change, [this](const std::string& name) { return path_of(name); }, system_disk());
  if (status.ok()) add(part.name);
  return status;
}

absl::Status StateFolder::write(const std::string& name, const StoredState& state) {
  absl::Status status = write_state(path_of(name), state, system_disk());
  if (status.ok()) add(name);
  return status;
}

absl::StatusOr<StoredState> StateFolder::read(const std::string& name) {
  absl::StatusOr<StoredState> state = read_state(
      name, [this](const std::string& part) { return path_of(part); }, system_disk());
  if (state.ok()) return state;
  // Any of its files may be the one that is damaged.
  for (const std::string& file : files_of(name)) {
    const std::lock_guard lock(mutex_);
    files_.erase(file);
    std::error_code ignored;
    std::filesystem::rename(path_of(file), folder_ / absl::StrCat(file, ".damaged"), ignored);
  }
  return absl::DataLossError(state.status().message());
}

void StateFolder::drop_before(const std::string& name) {
  const std::vector<std::string> needed = files_of(name);
  const std::lock_guard lock(mutex_);
  std::erase_if(files_, [&](const auto& file) {
    const std::string& old = file.first;
    if (old >= name || std::find(needed.begin(), needed.end(), old) != needed.end()) return false;
    std::error_code ignored;
    std::filesystem::remove(path_of(old), ignored);
    return true;
  });
}

}  // namespace tessera
