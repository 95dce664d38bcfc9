#include "cli/run_apart.h"

#include <absl/strings/str_cat.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <type_traits>

namespace tessera::cli {
namespace {

constexpr rlim_t kProcessorSecondsMax = 3600;

// What the copy tells: this, and the text of the error or the hash.
struct Told {
  absl::StatusCode code = absl::StatusCode::kOk;
  Tick tick = 0;
  std::uint64_t events = 0;
  Coverage coverage;
};
static_assert(std::is_trivially_copyable_v<Told>);

void write_all(int to, const void* bytes, std::size_t size) {
  const char* next = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t written = ::write(to, next, size);
    if (written < 0 && errno != EINTR) return;
    if (written < 0) continue;
    next += written;
    size -= static_cast<std::size_t>(written);
  }
}

[[noreturn]] void be_the_copy(int to, const std::function<absl::StatusOr<ScenarioReport>()>& run) {
  const rlimit limit{kProcessorSecondsMax, kProcessorSecondsMax};
  ::setrlimit(RLIMIT_CPU, &limit);
  const absl::StatusOr<ScenarioReport> report = run();
  Told told{.code = report.status().code()};
  std::string text(report.status().message());
  if (report.ok()) {
    told = {absl::StatusCode::kOk, report->tick, report->events, report->coverage};
    text = report->hash;
  }
  write_all(to, &told, sizeof told);
  write_all(to, text.data(), text.size());
  std::fflush(nullptr);
  ::_exit(0);
}

std::string read_all(int from) {
  std::string bytes;
  char piece[4096];
  for (;;) {
    const ssize_t read = ::read(from, piece, sizeof piece);
    if (read < 0 && errno == EINTR) continue;
    if (read <= 0) return bytes;
    bytes.append(piece, static_cast<std::size_t>(read));
  }
}

}  // namespace

absl::StatusOr<ScenarioReport> run_apart(const std::function<absl::StatusOr<ScenarioReport>()>& run) {
  int ends[2];
  if (::pipe(ends) != 0) return absl::UnavailableError("there can be no pipe");
  std::fflush(nullptr);
  const pid_t copy = ::fork();
  if (copy < 0) return absl::UnavailableError("there can be no process");
  if (copy == 0) {
    ::close(ends[0]);
    be_the_copy(ends[1], run);
  }
  ::close(ends[1]);
  const std::string bytes = read_all(ends[0]);
  ::close(ends[0]);
  int ended = 0;
  while (::waitpid(copy, &ended, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(ended))
    return absl::AbortedError(absl::StrCat("the process ended: ", ::strsignal(WTERMSIG(ended))));
  Told told;
  if (bytes.size() < sizeof told) return absl::AbortedError("the process ended without a word");
  std::memcpy(&told, bytes.data(), sizeof told);
  std::string text = bytes.substr(sizeof told);
  if (told.code != absl::StatusCode::kOk) return absl::Status(told.code, text);
  return ScenarioReport{std::move(text), told.tick, told.events, told.coverage};
}

}  // namespace tessera::cli
