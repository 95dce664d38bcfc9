#include "proto/whole_file.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace tessera {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

absl::Status cannot_write(const std::filesystem::path& file) {
  return absl::UnavailableError(absl::StrCat("cannot write ", file.string(), ": ", std::strerror(errno)));
}

}  // namespace

absl::StatusOr<WholeFile> WholeFile::create(std::filesystem::path file) {
  std::filesystem::path beside = file;
  beside += ".part";
  const int descriptor = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) return cannot_write(file);
  return WholeFile(std::move(file), std::move(beside), descriptor);
}

WholeFile::WholeFile(std::filesystem::path file, std::filesystem::path beside, int descriptor)
    : file_(std::move(file)), beside_(std::move(beside)), descriptor_(descriptor) {}

WholeFile::WholeFile(WholeFile&& other) noexcept
    : file_(std::move(other.file_)),
      beside_(std::move(other.beside_)),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

WholeFile::~WholeFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(beside_.c_str());
}

absl::Status WholeFile::append(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return cannot_write(file_);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return absl::OkStatus();
}

absl::Status WholeFile::finish() {
  if (::fsync(descriptor_) != 0 || ::rename(beside_.c_str(), file_.c_str()) != 0) return cannot_write(file_);
  ::close(std::exchange(descriptor_, -1));
  std::filesystem::path folder = file_.parent_path();
  if (folder.empty()) folder = ".";
  const int entry = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (entry < 0) return cannot_write(file_);
  const absl::Cleanup close_entry = [entry] { ::close(entry); };
  return ::fsync(entry) == 0 ? absl::OkStatus() : cannot_write(file_);
}

absl::Status read_pieces(const std::filesystem::path& file,
                         const std::function<absl::Status(std::string_view)>& take) {
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

}  // namespace tessera
