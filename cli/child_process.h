// A process that this one started, with what it says going to a file.
#pragma once

#include <absl/status/statusor.h>
#include <absl/time/time.h>
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace tessera::cli {

// The folder of the running executable.
std::filesystem::path executable_folder();

// A new folder of this user's in TMPDIR or /tmp.
absl::StatusOr<std::filesystem::path> make_temporary_folder();

// A descriptor that is readable once the process has ended; -1 where there is no such process.
int open_process(pid_t process);

// Moves only. Ends the process (SIGKILL) if it still runs at destruction.
class ChildProcess {
 public:
  // Starts `program` in a process group of its own, so that Ctrl-C does not reach it, with standard output
  // and error in `log`. NOT_FOUND where there is no such program.
  static absl::StatusOr<ChildProcess> start(const std::filesystem::path& program,
                                            const std::vector<std::string>& arguments,
                                            const std::filesystem::path& log);
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  const std::string& name() const { return name_; }
  pid_t pid() const { return pid_; }

  // Readable once the process has ended.
  int descriptor() const { return descriptor_; }

  // The end of the process, if it has come: an exit code, or the negative number of a signal.
  std::optional<int> ended();

  // "ended with exit code 1" and the last lines of its log.
  std::string epitaph();

  void signal(int number);

 private:
  ChildProcess() = default;

  std::string name_;
  std::filesystem::path log_;
  pid_t pid_ = -1;
  int descriptor_ = -1;
  std::optional<int> end_;
};

// Waits until one of the descriptors is readable; negative ones are passed over. Its place, or nullopt after
// `timeout`.
std::optional<std::size_t> wait_readable(const std::vector<int>& descriptors, absl::Duration timeout);

}  // namespace tessera::cli
