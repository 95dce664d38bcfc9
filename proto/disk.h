// The door to files of what must outlive its process, so that simulations can put a disk behind it that
// tears, forgets, fails and fills up.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace tessera {

// One thread at a time uses it, besides what it runs in the background itself. All errors are the system's,
// with the file.
class Disk {
 public:
  // A file that is being written; destroying it closes it.
  class File {
   public:
    virtual ~File() = default;
    virtual absl::Status append(std::string_view bytes) = 0;
    // On return, its contents outlast the machine. An error, too, once somebody has removed the file.
    virtual absl::Status sync() = 0;
  };

  // Work that runs beside its caller, who must call wait() before it ends.
  class Work {
   public:
    virtual ~Work() = default;
    virtual bool done() = 0;
    virtual absl::Status wait() = 0;  // once
  };

  // Held until it is destroyed, or the process ends.
  class Lock {
   public:
    virtual ~Lock() = default;
  };

  virtual ~Disk() = default;

  // ALREADY_EXISTS where another process, or another owner in this one, has it. The file is made.
  virtual absl::StatusOr<std::unique_ptr<Lock>> lock(const std::filesystem::path& file) = 0;

  virtual absl::Status make_folder(const std::filesystem::path& folder) = 0;
  virtual std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) = 0;

  // A new file, in the place of one that is there.
  virtual absl::StatusOr<std::unique_ptr<File>> create(const std::filesystem::path& file) = 0;
  // Replaces `to`. On return, the new name outlasts the machine.
  virtual absl::Status rename(const std::filesystem::path& from, const std::filesystem::path& to) = 0;
  virtual void remove(const std::filesystem::path& file) = 0;

  // Calls `take` with all bytes of a file, in pieces, until it returns an error.
  virtual absl::Status read(const std::filesystem::path& file,
                            const std::function<absl::Status(std::string_view)>& take) = 0;

  virtual std::unique_ptr<Work> in_background(std::function<absl::Status()> work) = 0;
};

// The disk of this machine.
Disk& system_disk();

}  // namespace tessera
