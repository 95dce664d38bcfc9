// Files that are there as a whole or not at all.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>
#include <string_view>

#include "proto/disk.h"

namespace tessera {

// Written beside its place, which it takes at once: whoever reads it finds the old file or the whole new one.
// All errors are UNAVAILABLE, with the file and the system's reason.
class WholeFile {
 public:
  static absl::StatusOr<WholeFile> create(std::filesystem::path file, Disk& disk = system_disk());
  WholeFile(WholeFile&& other) noexcept = default;
  WholeFile& operator=(WholeFile&&) = delete;
  ~WholeFile();  // without finish(), nothing has changed

  absl::Status append(std::string_view bytes) { return out_->append(bytes); }

  // On return, it survives the end of the process and of the machine.
  absl::Status finish();
  // Likewise; more may be appended to it.
  absl::StatusOr<std::unique_ptr<Disk::File>> finish_and_keep();

 private:
  WholeFile(std::filesystem::path file, std::filesystem::path beside, Disk& disk,
            std::unique_ptr<Disk::File> out);

  std::filesystem::path file_;
  std::filesystem::path beside_;
  Disk* disk_;
  std::unique_ptr<Disk::File> out_;  // null once it is finished
};

}  // namespace tessera
