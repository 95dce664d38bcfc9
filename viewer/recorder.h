// Recordings of the world of a cluster, made by processes of tessera-record: one at a time, in files of a
// folder.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

namespace tessera::viewer {

struct RecorderOptions {
  std::string command = "tessera-record";   // without '/': beside this program, or in PATH
  std::filesystem::path folder;             // of the files, NAME.mcap; empty: nothing is recorded
  std::uint64_t bytes_max = 2'000'000'000;  // of all of them together
  std::string address;                      // of the cluster
  std::string keys;                         // folder; empty: none
};

struct RecorderState {
  std::uint64_t number = 0;  // of the recording, from 1 on; 0: there was none
  bool is_recording = false;
  std::string name;  // of the file, without ".mcap"
  std::uint64_t bytes = 0;
  std::string said;      // once it has ended: what has become of it
  bool is_whole = true;  // once it has ended: it was stopped, and the file is complete
};

// Thread-safe.
class Recorder {
 public:
  explicit Recorder(RecorderOptions options) : options_(std::move(options)) {}
  // Completes a recording.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // Returns once it records. FAILED_PRECONDITION while another recording is made, without a folder or without
  // the command, or with what the command says, such as that no world is loaded; RESOURCE_EXHAUSTED where the
  // folder is full; as new_file() for the name.
  absl::Status start(const std::string& name);
  // Completes the file. FAILED_PRECONDITION where nothing is recorded.
  absl::StatusOr<RecorderState> stop();

  RecorderState state() const;
  // NOT_FOUND for a name that the folder does not have.
  absl::StatusOr<std::filesystem::path> file(const std::string& name) const;

 private:
  enum class Phase { kIdle, kStarting, kRecording };

  void run(std::filesystem::path command, std::filesystem::path file, std::uint64_t bytes_before);
  void end(int status, const std::string& output, bool was_full);

  const RecorderOptions options_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  Phase phase_ = Phase::kIdle;
  bool is_to_stop_ = false;
  RecorderState state_;
  RecorderState before_;  // the one that starts
  std::string failure_;   // of the last one that did not start
  std::thread thread_;    // which starts the process, since the process ends with it, and watches it
};

}  // namespace tessera::viewer
