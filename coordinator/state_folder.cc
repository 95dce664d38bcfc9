#include "coordinator/state_folder.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <random>
#include <system_error>
#include <utility>
#include <vector>

#include "proto/disk.h"
#include "proto/snapshot_file.h"

namespace tessera {
namespace {

constexpr const char* kLockFile = "lock";
constexpr const char* kNameFile = "coordinator";
constexpr const char* kSuffix = ".state";
constexpr std::size_t kNameBytesMax = 64;

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
  return !name.empty() && name.size() <= kNameBytesMax &&
         name.find_first_not_of("0123456789abcdef-") == std::string_view::npos;
}

absl::StatusOr<std::unique_ptr<StateFolder>> StateFolder::open(std::filesystem::path folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return absl::UnavailableError(absl::StrCat(folder.string(), ": ", error.message()));
  const std::filesystem::path file = folder / kLockFile;
  const int lock = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock < 0) return absl::UnavailableError(absl::StrCat(file.string(), ": ", std::strerror(errno)));
  std::unique_ptr<StateFolder> opened(new StateFolder(std::move(folder), lock));
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0)
    return absl::AlreadyExistsError(
        absl::StrCat(opened->folder_.string(), ": another coordinator uses this store"));
  if (absl::Status status = opened->scan(); !status.ok()) return status;
  return opened;
}

StateFolder::~StateFolder() { ::close(lock_); }

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
    if (path.extension() == kSuffix && is_state_name(path.stem().string()))
      names_.insert(path.stem().string());
  }
  return absl::OkStatus();
}

std::filesystem::path StateFolder::path_of(const std::string& name) const {
  return folder_ / absl::StrCat(name, kSuffix);
}

bool StateFolder::holds(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  return names_.contains(name);
}

std::set<std::string> StateFolder::names() const {
  const std::lock_guard lock(mutex_);
  return names_;
}

void StateFolder::add(const std::string& name) {
  const std::lock_guard lock(mutex_);
  names_.insert(name);
}

absl::Status StateFolder::write(const std::string& name, const StoredState& state) {
  const auto* chunks = std::get_if<std::vector<v1::SnapshotChunk>>(&state);
  absl::Status status = chunks != nullptr
                            ? write_snapshot(path_of(name), *chunks)
                            : write_bytes(path_of(name), std::get<v1::World>(state).SerializeAsString());
  if (status.ok()) add(name);
  return status;
}

absl::StatusOr<StoredState> StateFolder::read(const std::string& name, bool is_snapshot) {
  const auto forget = [&](const absl::Status& status) {
    const std::lock_guard lock(mutex_);
    names_.erase(name);
    std::error_code ignored;
    std::filesystem::rename(path_of(name), folder_ / absl::StrCat(name, ".damaged"), ignored);
    return absl::DataLossError(status.message());
  };
  if (is_snapshot) {
    absl::StatusOr<std::vector<v1::SnapshotChunk>> chunks = read_snapshot(path_of(name));
    if (!chunks.ok()) return forget(chunks.status());
    return *std::move(chunks);
  }
  const absl::StatusOr<std::string> bytes = bytes_of(path_of(name));
  v1::World world;
  if (!bytes.ok()) return forget(bytes.status());
  if (!world.ParseFromString(*bytes))
    return forget(
        absl::DataLossError(absl::StrCat(path_of(name).string(), ": it is not a world as it was stored")));
  return world;
}

void StateFolder::drop_before(const std::string& name) {
  const std::lock_guard lock(mutex_);
  for (const std::string& old : std::set<std::string>(names_.begin(), names_.lower_bound(name))) {
    std::error_code ignored;
    std::filesystem::remove(path_of(old), ignored);
    names_.erase(old);
  }
}

}  // namespace tessera
