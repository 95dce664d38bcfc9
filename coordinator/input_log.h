// Inputs on disk: a file of checked entries, and its mirror, so that damage to either loses nothing.
//
// Each entry has its length and a checksum, which is chained to that of the entry before; inputs that are
// stored together are one entry. What a crash leaves of the last entry of a file was never acknowledged.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "proto/disk.h"
#include "store.pb.h"

namespace tessera {

inline constexpr std::uint32_t kInputLogFormat = 2;

// The file and its mirror.
using InputLogFiles = std::array<std::filesystem::path, 2>;

class InputLog {
 public:
  // A new one, with its head, in the place of what is there. On return, both files outlast the machine.
  // Errors are the disk's.
  static absl::StatusOr<InputLog> create(const InputLogFiles& files, const v1::InputLogHead& head,
                                         Disk& disk);

  // On return, the batch is in both files for good. After an error, any part of it is, and nothing more may
  // be appended.
  absl::Status append(const v1::InputBatch& batch);

 private:
  InputLog() = default;

  std::array<std::unique_ptr<Disk::File>, 2> files_;
  std::uint64_t chain_ = 0;  // the checksum of the last entry
};

// What is in the two files.
struct ReadInputLog {
  v1::InputLogHead head;
  std::vector<v1::StoredInput> inputs;
  std::vector<std::string> damage;  // to one of them, for which the other one stands: one line each
  std::string lost;                 // from where on neither has what was written; empty: nowhere
  std::string bytes;                // of either file, as it should be
};

// Changes nothing. DATA_LOSS where neither file has the head, FAILED_PRECONDITION for another format;
// otherwise the disk's errors.
absl::StatusOr<ReadInputLog> read_input_log(const InputLogFiles& files, Disk& disk);

// Writes both files anew, as they were read.
absl::Status mend_input_log(const InputLogFiles& files, const ReadInputLog& log, Disk& disk);

}  // namespace tessera
