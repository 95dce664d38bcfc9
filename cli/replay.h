// A recording of inputs, played again and compared.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <filesystem>
#include <string>

#include "lpss/tick/messages.h"

namespace tessera::cli {

struct ReplayOptions {
  std::filesystem::path file;
  int servers = 0;  // 0: in this process, on a simulated network
  int threads = 1;  // of each server
};

struct ReplayReport {
  std::string world;           // the last one
  Tick tick = 0;               // how far it went
  std::uint64_t commands = 0;  // of all worlds of the file
  std::uint64_t hashes = 0;    // compared, all equal
};

// Loads the worlds of the recording one after the other, gives each command at its tick, and compares the
// hash wherever the recording has one. Errors as RecordingReader; ABORTED where the replay goes another way,
// with the tick and what was recorded; CANCELLED by an interrupt; and those of the cluster.
absl::StatusOr<ReplayReport> replay(const ReplayOptions& options);

}  // namespace tessera::cli
