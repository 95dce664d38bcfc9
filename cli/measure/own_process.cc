#include "cli/measure/own_process.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <absl/time/time.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "cli/child_process.h"
#include "cli/interrupt.h"
#include "daemon/parent_process.h"

namespace tessera {
namespace {

constexpr char kError[] = "error";
constexpr char kMessage[] = "message";
constexpr char kReport[] = "report";

nlohmann::ordered_json packed(const absl::StatusOr<Report>& result) {
  if (result.ok()) return {{kReport, to_json(*result)}};
  return {{kError, static_cast<int>(result.status().code())},
          {kMessage, std::string(result.status().message())}};
}

absl::StatusOr<Report> unpacked(const std::string& text) {
  const auto json = nlohmann::ordered_json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) return absl::InternalError("the process of a measurement gave no answer");
  if (json.contains(kReport)) return report_from_json(json[kReport]);
  return absl::Status(static_cast<absl::StatusCode>(json.value(kError, 2)),
                      json.value(kMessage, std::string()));
}

void write_all(int descriptor, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = write(descriptor, text.data() + done, text.size() - done);
    if (written < 0 && errno != EINTR) return;
    if (written > 0) done += static_cast<std::size_t>(written);
  }
}

// All that comes before the end. CANCELLED by an interrupt.
absl::StatusOr<std::string> read_all(int descriptor) {
  std::string text;
  std::array<char, 1 << 16> buffer;
  while (true) {
    if (cli::wait_readable({cli::interrupt_descriptor(), descriptor}, absl::InfiniteDuration()) == 0u)
      return absl::CancelledError("interrupted");
    const ssize_t count = read(descriptor, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

// Does the work of the new process: signals are for the first one, which ends the others.
[[noreturn]] void work(const std::function<absl::StatusOr<Report>()>& measure, pid_t parent, int writing) {
  signal(SIGINT, SIG_IGN);
  signal(SIGTERM, SIG_DFL);
  if (!end_with_parent(parent, SIGKILL)) _exit(EXIT_FAILURE);
  write_all(writing, packed(measure()).dump());
  std::fflush(nullptr);
  _exit(EXIT_SUCCESS);
}

int end_of(pid_t process) {
  int end = 0;
  while (waitpid(process, &end, 0) < 0 && errno == EINTR) {
  }
  return end;
}

}  // namespace

absl::StatusOr<Report> in_own_process(const std::function<absl::StatusOr<Report>()>& measure,
                                      std::chrono::seconds processor_time_max) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0)
    return absl::ResourceExhaustedError("cannot create a pipe to the process of a measurement");
  const auto [reading, writing] = ends;
  std::fflush(nullptr);  // or it would be written twice
  const pid_t parent = getpid();
  const pid_t process = fork();
  if (process == 0) {
    close(reading);
    if (processor_time_max != std::chrono::seconds::max()) {
      const auto seconds = static_cast<rlim_t>(processor_time_max.count());
      const rlimit limit{seconds, seconds};
      setrlimit(RLIMIT_CPU, &limit);
    }
    work(measure, parent, writing);
  }
  close(writing);
  const absl::Cleanup close_reading = [reading = reading] { close(reading); };
  if (process < 0) return absl::ResourceExhaustedError("cannot start the process of a measurement");
  const absl::StatusOr<std::string> answer = read_all(reading);
  if (!answer.ok()) kill(process, SIGKILL);
  const int end = end_of(process);
  if (!answer.ok()) return answer.status();
  if (WIFSIGNALED(end)) {
    return absl::InternalError(
        absl::StrCat("the process of a measurement was ended by signal ", WTERMSIG(end)));
  }
  return unpacked(*answer);
}

}  // namespace tessera
