#include "proto/disk.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <future>
#include <string>
#include <system_error>
#include <utility>

namespace tessera {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

absl::Status cannot_write(const std::filesystem::path& file) {
  return absl::UnavailableError(absl::StrCat("cannot write ", file.string(), ": ", std::strerror(errno)));
}

class SystemFile final : public Disk::File {
 public:
  SystemFile(std::filesystem::path file, int descriptor) : file_(std::move(file)), descriptor_(descriptor) {}
  SystemFile(const SystemFile&) = delete;
  SystemFile& operator=(const SystemFile&) = delete;
  ~SystemFile() override { ::close(descriptor_); }

  absl::Status append(std::string_view bytes) override {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return cannot_write(file_);
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return absl::OkStatus();
  }
  absl::Status sync() override {
    if (::fdatasync(descriptor_) != 0) return cannot_write(file_);
    struct stat found {};
    if (::fstat(descriptor_, &found) != 0) return cannot_write(file_);
    if (found.st_nlink > 0) return absl::OkStatus();
    return absl::UnavailableError(absl::StrCat("cannot write ", file_.string(), ": it has been removed"));
  }

 private:
  const std::filesystem::path file_;
  const int descriptor_;
};

class SystemLock final : public Disk::Lock {
 public:
  explicit SystemLock(int descriptor) : descriptor_(descriptor) {}
  SystemLock(const SystemLock&) = delete;
  SystemLock& operator=(const SystemLock&) = delete;
  ~SystemLock() override { ::close(descriptor_); }

 private:
  const int descriptor_;
};

// On a thread of its own.
class ThreadWork final : public Disk::Work {
 public:
  explicit ThreadWork(std::function<absl::Status()> work)
      : result_(std::async(std::launch::async, std::move(work))) {}

  bool done() override { return result_.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }
  absl::Status wait() override { return result_.get(); }

 private:
  std::future<absl::Status> result_;
};

class SystemDisk final : public Disk {
 public:
  absl::Status make_folder(const std::filesystem::path& folder) override {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error) return absl::OkStatus();
    return absl::UnavailableError(absl::StrCat(folder.string(), ": ", error.message()));
  }

  std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) override {
    std::vector<std::filesystem::path> files;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
      files.push_back(entry.path());
    }
    return files;
  }

  absl::StatusOr<std::unique_ptr<File>> create(const std::filesystem::path& file) override {
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor < 0) return cannot_write(file);
    return std::make_unique<SystemFile>(file, descriptor);
  }

  absl::Status rename(const std::filesystem::path& from, const std::filesystem::path& to) override {
    if (::rename(from.c_str(), to.c_str()) != 0) return cannot_write(to);
    std::filesystem::path folder = to.parent_path();
    if (folder.empty()) folder = ".";
    const int entry = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (entry < 0) return cannot_write(to);
    const absl::Cleanup close_entry = [entry] { ::close(entry); };
    return ::fsync(entry) == 0 ? absl::OkStatus() : cannot_write(to);
  }

  void remove(const std::filesystem::path& file) override { ::unlink(file.c_str()); }

  absl::Status read(const std::filesystem::path& file,
                    const std::function<absl::Status(std::string_view)>& take) override {
    const auto cannot_read = [&] {
      return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", file.string()));
    };
    const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return cannot_read();
    const absl::Cleanup close_file = [descriptor] { ::close(descriptor); };
    std::string piece(kPieceBytes, '\0');
    for (;;) {
      const ssize_t size = ::read(descriptor, piece.data(), piece.size());
      if (size < 0 && errno == EINTR) continue;
      if (size < 0) return cannot_read();
      if (size == 0) return absl::OkStatus();
      absl::Status status = take(std::string_view(piece).substr(0, static_cast<std::size_t>(size)));
      if (!status.ok()) return status;
    }
  }

  absl::StatusOr<std::unique_ptr<Lock>> lock(const std::filesystem::path& file) override {
    const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (descriptor < 0) return cannot_write(file);
    auto lock = std::make_unique<SystemLock>(descriptor);
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return lock;
    if (errno != EWOULDBLOCK) return cannot_write(file);
    return absl::AlreadyExistsError(absl::StrCat(file.string(), ": it is locked"));
  }

  std::unique_ptr<Work> in_background(std::function<absl::Status()> work) override {
    return std::make_unique<ThreadWork>(std::move(work));
  }
};

}  // namespace

Disk& system_disk() {
  static SystemDisk disk;
  return disk;
}

}  // namespace tessera
