#include "viewer/recorder.h"

#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_split.h>
#include <absl/strings/strip.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <system_error>
#include <utility>
#include <vector>

#include "viewer/world_shelf.h"

namespace tessera::viewer {
namespace {

constexpr char kExtension[] = ".mcap";
constexpr int kLookEveryMs = 100;  // at the size of the file, and whether it is to stop
constexpr std::chrono::seconds kStartTimeout{20};
constexpr std::chrono::seconds kStopTimeout{20};
constexpr std::size_t kSaidMax = 4096;

std::uint64_t bytes_of(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  return error ? 0 : bytes;
}

std::uint64_t bytes_in(const std::filesystem::path& folder) {
  std::uint64_t bytes = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator next(folder, error), end; !error && next != end;
       next.increment(error)) {
    if (next->path().extension() == kExtension) bytes += bytes_of(next->path());
  }
  return bytes;
}

absl::StatusOr<std::filesystem::path> find_command(const std::string& command) {
  std::vector<std::filesystem::path> places;
  if (absl::StrContains(command, '/')) {
    places = {command};
  } else {
    std::error_code error;
    places = {std::filesystem::read_symlink("/proc/self/exe", error).parent_path() / command};
    const char* const path = std::getenv("PATH");
    for (const absl::string_view folder : absl::StrSplit(path == nullptr ? "" : path, ':', absl::SkipEmpty()))
      places.push_back(std::filesystem::path(std::string(folder)) / command);
  }
  for (const std::filesystem::path& place : places) {
    if (access(place.c_str(), X_OK) == 0) return place;
  }
  return absl::FailedPreconditionError(
      absl::StrCat("there is no ", command,
                   ": install it (pip install './client_sdk/python[record]'), or start "
                   "this web UI with --recorder FILE"));
}

// The process, and what it says.
struct Started {
  pid_t process = -1;
  int output = -1;
};

// In the child: what the program needs must be there already, since other threads do not go on in it.
[[noreturn]] void become(char* const* arguments, char* const* variables, int output) {
  setpgid(0, 0);  // Ctrl-C in the terminal is for the web UI
  prctl(PR_SET_PDEATHSIG, SIGINT);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  for (const int number : {SIGINT, SIGTERM, SIGPIPE}) signal(number, SIG_DFL);
  const int input = ::open("/dev/null", O_RDONLY);
  dup2(input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  execve(arguments[0], arguments, variables);
  _exit(127);
}

Started start_process(std::vector<std::string> arguments, const std::string& keys) {
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (!absl::StartsWith(*variable, "TESSERA_KEYS=")) variables.emplace_back(*variable);
  }
  variables.push_back(absl::StrCat("TESSERA_KEYS=", keys));
  const auto pointers = [](std::vector<std::string>& texts) {
    std::vector<char*> all;
    for (std::string& text : texts) all.push_back(text.data());
    all.push_back(nullptr);
    return all;
  };
  const std::vector<char*> argv = pointers(arguments);
  const std::vector<char*> envp = pointers(variables);
  std::array<int, 2> pipe{};
  if (pipe2(pipe.data(), O_CLOEXEC) != 0) return {};
  const pid_t process = fork();
  if (process == 0) become(argv.data(), envp.data(), pipe[1]);
  ::close(pipe[1]);
  if (process > 0) return {process, pipe[0]};
  ::close(pipe[0]);
  return {};
}

// Adds what there is to read, after at most kLookEveryMs; false at the end.
bool read_some(int descriptor, std::string& output) {
  pollfd ready{descriptor, POLLIN, 0};
  if (::poll(&ready, 1, kLookEveryMs) <= 0) return true;
  std::array<char, 512> bytes{};
  const ssize_t got = ::read(descriptor, bytes.data(), bytes.size());
  if (got > 0 && output.size() < kSaidMax) output.append(bytes.data(), static_cast<std::size_t>(got));
  return got > 0 || (got < 0 && errno == EINTR);
}

// The last line, without the name of the program.
std::string last_line(const std::string& output, const std::string& command) {
  const std::vector<std::string> lines = absl::StrSplit(output, absl::ByAnyChar("\r\n"), absl::SkipEmpty());
  if (lines.empty()) return "it has said nothing";
  const std::string name = std::filesystem::path(command).filename();
  return std::string(absl::StripPrefix(lines.back(), absl::StrCat(name, ": ")));
}

}  // namespace

Recorder::~Recorder() {
  {
    const std::lock_guard lock(mutex_);
    is_to_stop_ = true;
  }
  if (thread_.joinable()) thread_.join();
}

absl::Status Recorder::start(const std::string& name) {
  std::unique_lock lock(mutex_);
  if (phase_ != Phase::kIdle)
    return absl::FailedPreconditionError(absl::StrCat("a recording is made already: ", state_.name));
  const absl::StatusOr<std::filesystem::path> file = new_file(options_.folder, name, kExtension, "recording");
  if (!file.ok()) return file.status();
  const std::uint64_t before = bytes_in(options_.folder);
  if (before >= options_.bytes_max) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "the recordings in %s have %.0f MB, which is all that they may have (--recordings-max): remove some",
        options_.folder.string(), static_cast<double>(before) / 1e6));
  }
  const absl::StatusOr<std::filesystem::path> command = find_command(options_.command);
  if (!command.ok()) return command.status();
  if (thread_.joinable()) thread_.join();  // which has nothing left to do
  phase_ = Phase::kStarting;
  is_to_stop_ = false;
  const std::uint64_t number = state_.number + 1;
  before_ = std::exchange(state_, {number, true, name, 0, "", true});
  thread_ = std::thread([this, command = *command, file = *file, before] { run(command, file, before); });
  changed_.wait_for(lock, kStartTimeout, [this] { return phase_ != Phase::kStarting; });
  // It may have ended already.
  if (phase_ == Phase::kRecording || (phase_ == Phase::kIdle && state_.number == number))
    return absl::OkStatus();
  if (phase_ == Phase::kIdle) return absl::FailedPreconditionError(failure_);
  is_to_stop_ = true;
  return absl::DeadlineExceededError(absl::StrCat(options_.command, " does not begin to record"));
}

absl::StatusOr<RecorderState> Recorder::stop() {
  std::unique_lock lock(mutex_);
  if (phase_ == Phase::kIdle) return absl::FailedPreconditionError("nothing is recorded");
  is_to_stop_ = true;
  if (!changed_.wait_for(lock, kStopTimeout + kStartTimeout, [this] { return phase_ == Phase::kIdle; }))
    return absl::DeadlineExceededError(absl::StrCat(options_.command, " does not end"));
  lock.unlock();
  return state();
}

RecorderState Recorder::state() const {
  const std::lock_guard lock(mutex_);
  RecorderState state = state_;
  if (state.number > 0) state.bytes = bytes_of(options_.folder / (state.name + kExtension));
  return state;
}

absl::StatusOr<std::filesystem::path> Recorder::file(const std::string& name) const {
  std::error_code error;
  for (std::filesystem::directory_iterator next(options_.folder, error), end; !error && next != end;
       next.increment(error)) {
    if (next->path().extension() == kExtension && next->path().stem() == name) return next->path();
  }
  return absl::NotFoundError(absl::StrCat("this web UI has no recording of the name '", name, "'"));
}

void Recorder::run(std::filesystem::path command, std::filesystem::path file, std::uint64_t bytes_before) {
  const Started started = start_process(
      {command.string(), "--connect", options_.address, "--output", file.string()}, options_.keys);
  if (started.process < 0) return end(-1, "cannot start a process", false);
  std::string output;
  std::chrono::steady_clock::time_point told{};  // to end
  bool was_full = false;
  while (read_some(started.output, output)) {
    was_full |= bytes_before + bytes_of(file) >= options_.bytes_max;
    const std::lock_guard lock(mutex_);
    if (phase_ == Phase::kStarting && absl::StrContains(output, "recording ")) {
      phase_ = Phase::kRecording;
      changed_.notify_all();
    }
    if (!is_to_stop_ && !was_full) continue;
    const auto now = std::chrono::steady_clock::now();
    if (told == std::chrono::steady_clock::time_point{}) {
      told = now;
      ::kill(started.process, SIGINT);
    } else if (now - told > kStopTimeout) {
      ::kill(started.process, SIGKILL);
    }
  }
  ::close(started.output);
  int status = 0;
  while (waitpid(started.process, &status, 0) < 0 && errno == EINTR) continue;
  end(status, output, was_full);
}

void Recorder::end(int status, const std::string& output, bool was_full) {
  const std::lock_guard lock(mutex_);
  const std::string said = last_line(output, options_.command);
  if (phase_ == Phase::kStarting) {
    failure_ = said;
    state_ = before_;  // as if it had not been asked for
  } else {
    state_.is_recording = false;
    state_.is_whole = status == 0;
    state_.said = said;
    if (was_full && status == 0) {
      absl::StrAppend(&state_.said,
                      absl::StrFormat("; ended, since recordings may have %.0f MB (--recordings-max)",
                                      static_cast<double>(options_.bytes_max) / 1e6));
    }
  }
  phase_ = Phase::kIdle;
  changed_.notify_all();
}

}  // namespace tessera::viewer
