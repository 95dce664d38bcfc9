// Files of recorded inputs (recording.proto).
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "recording.pb.h"

namespace google::protobuf::io {
class IstreamInputStream;
}

namespace tessera {

class RecordingWriter {
 public:
  // ALREADY_EXISTS if the file exists: recordings are not overwritten. UNAVAILABLE if it cannot be written.
  static absl::StatusOr<RecordingWriter> create(const std::filesystem::path& file);

  // The entry has been passed to the operating system on return, so it survives a kill of this process.
  // UNAVAILABLE.
  absl::Status write(const v1::RecordedInput& input);

 private:
  explicit RecordingWriter(std::filesystem::path file);

  std::filesystem::path file_;
  std::ofstream out_;
};

class RecordingReader {
 public:
  // The system's error if it cannot be read: NOT_FOUND, FAILED_PRECONDITION for a folder. DATA_LOSS if it
  // does not begin with a world, and so is not a recording.
  static absl::StatusOr<RecordingReader> open(const std::filesystem::path& file);

  RecordingReader(RecordingReader&&) noexcept;
  ~RecordingReader();

  // The next entry; nullopt at the end. DATA_LOSS, with the byte, if the file is truncated within it or has
  // other contents.
  absl::StatusOr<std::optional<v1::RecordedInput>> next();

 private:
  RecordingReader(std::filesystem::path file, std::unique_ptr<std::ifstream> in);

  // Why the entry that begins at this byte cannot be read.
  absl::Status unreadable(std::int64_t begin);

  std::filesystem::path file_;
  std::unique_ptr<std::ifstream> in_;
  std::unique_ptr<google::protobuf::io::IstreamInputStream> stream_;
  std::size_t entries_ = 0;
};

}  // namespace tessera
