#include "cli/measure/own_process.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>
#include <absl/strings/string_view.h>
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
#include <utility>
#include <vector>

#include "cli/child_process.h"
#include "cli/interrupt.h"
#include "daemon/parent_process.h"

namespace tessera {
namespace {

// A process answers in lines of JSON: what it keeps, and at last what it returns.
constexpr char kError[] = "error";
constexpr char kMessage[] = "message";
constexpr char kReport[] = "report";
constexpr char kSoFar[] = "so_far";

nlohmann::ordered_json packed(const absl::StatusOr<Report>& result) {
  if (result.ok()) return {{kReport, to_json(*result)}};
  return {{kError, static_cast<int>(result.status().code())},
          {kMessage, std::string(result.status().message())}};
}

Measured failed(absl::Status status, Report report = {}) { return {std::move(report), std::move(status)}; }

Measured with_report(const nlohmann::ordered_json& json, absl::Status status) {
  absl::StatusOr<Report> report = report_from_json(json);
  if (!report.ok()) return failed(report.status());
  return {*std::move(report), std::move(status)};
}

// The last line counts, and the one before it where that is an error. A line without an end is none.
Measured unpacked(const std::string& text) {
  std::vector<absl::string_view> lines = absl::StrSplit(text, '\n');
  lines.pop_back();
  absl::Status status = absl::InternalError("the process of a measurement gave no answer");
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
    const auto json = nlohmann::ordered_json::parse(*line, nullptr, /*allow_exceptions=*/false);
    if (json.is_discarded()) break;
    if (json.contains(kReport)) return with_report(json[kReport], absl::OkStatus());
    if (json.contains(kSoFar)) return with_report(json[kSoFar], std::move(status));
    status = absl::Status(static_cast<absl::StatusCode>(json.value(kError, 2)),
                          json.value(kMessage, std::string()));
  }
  return failed(std::move(status));
}

void write_all(int descriptor, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t written = write(descriptor, text.data() + done, text.size() - done);
    if (written < 0 && errno != EINTR) return;
    if (written > 0) done += static_cast<std::size_t>(written);
  }
}

// What can be read at once, or comes next. False at the end.
bool read_more(int descriptor, std::string& text) {
  std::array<char, 1 << 16> buffer;
  ssize_t count = -1;
  do {
    count = read(descriptor, buffer.data(), buffer.size());
  } while (count < 0 && errno == EINTR);
  if (count <= 0) return false;
  text.append(buffer.data(), static_cast<std::size_t>(count));
  return true;
}

// All that comes before the end, or, CANCELLED, before an interrupt.
absl::Status read_all(int descriptor, std::string& text) {
  while (cli::wait_readable({cli::interrupt_descriptor(), descriptor}, absl::InfiniteDuration()) != 0u) {
    if (!read_more(descriptor, text)) return absl::OkStatus();
  }
  while (cli::wait_readable({descriptor}, absl::ZeroDuration()) && read_more(descriptor, text)) {
  }
  return absl::CancelledError("interrupted");
}

using KeepingMeasurement = std::function<absl::StatusOr<Report>(const Keep& keep)>;

// Does the work of the new process: signals are for the first one, which ends the others.
[[noreturn]] void work(const KeepingMeasurement& measure, pid_t parent, int writing) {
  signal(SIGINT, SIG_IGN);
  signal(SIGTERM, SIG_DFL);
  if (!end_with_parent(parent, SIGKILL)) _exit(EXIT_FAILURE);
  const auto write_line = [&](const nlohmann::ordered_json& json) { write_all(writing, json.dump() + "\n"); };
  std::size_t rows = 0;
  const Keep keep = [&](const Report& so_far) {
    if (so_far.rows() <= rows) return;
    rows = so_far.rows();
    write_line({{kSoFar, to_json(so_far)}});
  };
  write_line(packed(measure(keep)));
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

Measured in_own_process_keeping(const KeepingMeasurement& measure, std::chrono::seconds processor_time_max) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0)
    return failed(absl::ResourceExhaustedError("cannot create a pipe to the process of a measurement"));
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
  if (process < 0) return failed(absl::ResourceExhaustedError("cannot start the process of a measurement"));
  std::string answer;
  const absl::Status ended = read_all(reading, answer);
  if (!ended.ok()) kill(process, SIGKILL);
  const int end = end_of(process);
  Measured measured = unpacked(answer);
  if (!ended.ok()) {
    measured.status = ended;
  } else if (WIFSIGNALED(end)) {
    measured.status =
        absl::InternalError(absl::StrCat("the process of a measurement was ended by signal ", WTERMSIG(end)));
  }
  return measured;
}

absl::StatusOr<Report> in_own_process(const std::function<absl::StatusOr<Report>()>& measure,
                                      std::chrono::seconds processor_time_max) {
  Measured measured = in_own_process_keeping([&](const Keep&) { return measure(); }, processor_time_max);
  if (!measured.status.ok()) return measured.status;
  return std::move(measured.report);
}

}  // namespace tessera
