#include "cli/child_process.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/time/clock.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <system_error>
#include <utility>

extern char** environ;

namespace tessera::cli {
namespace {

constexpr std::size_t kEpitaphLines = 12;

absl::Status failed(const std::string& what, int error) {
  return absl::InternalError(absl::StrCat(what, ": ", std::strerror(error)));
}

std::string last_lines(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::deque<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    lines.push_back(absl::StrCat("  ", line));
    if (lines.size() > kEpitaphLines) lines.pop_front();
  }
  return absl::StrJoin(lines, "\n");
}

// posix_spawn's own structures, which want to be destroyed.
struct SpawnSetup {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;

  SpawnSetup() {
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnSetup() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnSetup(const SpawnSetup&) = delete;
  SpawnSetup& operator=(const SpawnSetup&) = delete;
};

}  // namespace

std::filesystem::path executable_folder() {
  std::error_code error;
  const std::filesystem::path executable = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? std::filesystem::path(".") : executable.parent_path();
}

absl::StatusOr<std::filesystem::path> make_temporary_folder() {
  const char* base = std::getenv("TMPDIR");
  std::string name = absl::StrCat(base != nullptr && *base != '\0' ? base : "/tmp", "/tessera-XXXXXX");
  if (mkdtemp(name.data()) == nullptr) return failed(absl::StrCat("cannot make a folder ", name), errno);
  return std::filesystem::path(name);
}

// glibc 2.36 declares pidfd_open() in a header that C++ cannot use.
int open_process(pid_t process) { return static_cast<int>(syscall(SYS_pidfd_open, process, 0)); }

absl::StatusOr<ChildProcess> ChildProcess::start(const std::filesystem::path& program,
                                                 const std::vector<std::string>& arguments,
                                                 const std::filesystem::path& log) {
  std::vector<char*> argv;
  std::string program_name = program.string();
  std::vector<std::string> copies = arguments;
  argv.push_back(program_name.data());
  for (std::string& argument : copies) argv.push_back(argument.data());
  argv.push_back(nullptr);

  SpawnSetup setup;
  posix_spawn_file_actions_addopen(&setup.files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&setup.files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND,
                                   0644);
  posix_spawn_file_actions_adddup2(&setup.files, STDOUT_FILENO, STDERR_FILENO);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&setup.attributes, &none);
  posix_spawnattr_setpgroup(&setup.attributes, 0);
  posix_spawnattr_setflags(&setup.attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);

  ChildProcess child;
  child.name_ = program.filename().string();
  child.log_ = log;
  const int error =
      posix_spawn(&child.pid_, program_name.c_str(), &setup.files, &setup.attributes, argv.data(), environ);
  if (error != 0) {
    child.pid_ = -1;
    if (error == ENOENT) {
      return absl::NotFoundError(absl::StrCat("there is no program ", program_name,
                                              "; in a clone, deploy/build.sh release ", child.name_,
                                              " builds it"));
    }
    return failed(absl::StrCat("cannot start ", program_name), error);
  }
  child.descriptor_ = open_process(child.pid_);
  if (child.descriptor_ < 0) return failed(absl::StrCat("cannot attend to ", program_name), errno);
  return child;
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : name_(std::move(other.name_)),
      log_(std::move(other.log_)),
      pid_(std::exchange(other.pid_, -1)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      end_(std::exchange(other.end_, std::nullopt)) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(name_, other.name_);
  std::swap(log_, other.log_);
  std::swap(pid_, other.pid_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(end_, other.end_);
  return *this;
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0 && !end_) {
    kill(pid_, SIGKILL);
    while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  if (descriptor_ >= 0) close(descriptor_);
}

std::optional<int> ChildProcess::ended() {
  if (end_ || pid_ <= 0) return end_;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return std::nullopt;
  end_ = WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
  return end_;
}

std::string ChildProcess::epitaph() {
  const std::optional<int> end = ended();
  std::string text = name_;
  if (!end) {
    absl::StrAppend(&text, " still runs");
  } else if (*end < 0) {
    absl::StrAppend(&text, " was ended by signal ", -*end, " (", strsignal(-*end), ")");
  } else {
    absl::StrAppend(&text, " ended with exit code ", *end);
  }
  const std::string lines = last_lines(log_);
  return lines.empty() ? text : absl::StrCat(text, "; its log ", log_.string(), " ends:\n", lines);
}

void ChildProcess::signal(int number) {
  if (pid_ > 0 && !ended()) kill(pid_, number);
}

std::optional<std::size_t> wait_readable(const std::vector<int>& descriptors, absl::Duration timeout) {
  const absl::Time deadline = absl::Now() + timeout;
  std::vector<pollfd> polled;
  for (const int descriptor : descriptors) polled.push_back({descriptor, POLLIN, 0});
  for (;;) {
    const absl::Duration left = std::max(deadline - absl::Now(), absl::ZeroDuration());
    // A little more than a day at once: poll() counts in an int.
    const int milliseconds = static_cast<int>(
        absl::ToInt64Milliseconds(std::min(left + absl::Microseconds(999), absl::Hours(25))));
    const int ready = poll(polled.data(), polled.size(), milliseconds);
    for (std::size_t place = 0; ready > 0 && place < polled.size(); ++place) {
      if (polled[place].revents != 0) return place;
    }
    if (absl::Now() >= deadline) return std::nullopt;
  }
}

}  // namespace tessera::cli
