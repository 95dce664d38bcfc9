// Files that are there as a whole or not at all.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <filesystem>
#include <functional>
#include <string_view>

namespace tessera {

// Written beside its place, which it takes at once: whoever reads it finds the old file or the whole new one.
// All errors are UNAVAILABLE, with the file and the system's reason.
class WholeFile {
 public:
  static absl::StatusOr<WholeFile> create(std::filesystem::path file);
  WholeFile(WholeFile&& other) noexcept;
  WholeFile& operator=(WholeFile&&) = delete;
  ~WholeFile();  // without finish(), nothing has changed

  absl::Status append(std::string_view bytes);

  // On return, it survives the end of the process and of the machine.
  absl::Status finish();

 private:
  WholeFile(std::filesystem::path file, std::filesystem::path beside, int descriptor);

  std::filesystem::path file_;
  std::filesystem::path beside_;
  int descriptor_ = -1;
};

// Calls `take` with all bytes of a file, in pieces, until it returns an error. The system's error if the file
// cannot be read.
absl::Status read_pieces(const std::filesystem::path& file,
                         const std::function<absl::Status(std::string_view)>& take);

}  // namespace tessera
