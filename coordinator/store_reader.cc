#include "coordinator/store_reader.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <set>
#include <utility>

#include "coordinator/state_parts.h"
#include "coordinator/stored_state.h"

namespace tessera {
namespace {

constexpr const char* kStateSuffix = ".state";
constexpr const char* kInputsSuffix = ".inputs";
constexpr const char* kMirrorSuffix = ".mirror";
constexpr const char* kUnfinishedSuffix = ".part";    // of WholeFile
constexpr const char* kFormerDatabase = "inputs.db";  // of format 1

absl::Status of_another_format(const std::filesystem::path& file) {
  return absl::FailedPreconditionError(
      absl::StrCat(file.string(), ": a store of format 1, and this coordinator reads format ",
                   kInputLogFormat, ": have the version that wrote it take a snapshot, and restore that"));
}

absl::Status no_world() { return absl::NotFoundError("no world is stored"); }

// The last log tells the state; those before it are wanted as far as they have inputs that the state lacks.
absl::Status read_logs(const StoreFiles& files, std::vector<std::uint64_t> numbers, Disk& disk,
                       StoreContents& contents) {
  std::vector<FoundLog>& logs = contents.logs;
  contents.last_log = numbers.back();
  do {
    absl::StatusOr<ReadInputLog> log = read_input_log(files.log(numbers.back()), disk);
    if (!log.ok()) return log.status();
    logs.push_back({numbers.back(), *std::move(log)});
    numbers.pop_back();
  } while (logs.back().read.head.first() > logs.front().read.head.position() && !numbers.empty());
  std::ranges::reverse(logs);
  return absl::OkStatus();
}

// Up to the first one that is lost.
void take_inputs(const StoreFiles& files, StoreContents& contents) {
  contents.position = contents.head().position();
  for (std::size_t n = 0; n < contents.logs.size(); ++n) {
    ReadInputLog& log = contents.logs[n].read;
    const std::uint64_t first = log.head.first();
    if (log.head.load() != contents.head().load() || first > contents.position) {
      contents.lost = absl::StrCat(files.folder().string(), ": the inputs ", contents.position + 1, " to ",
                                   first, " are missing");
      return;
    }
    // What was written after the next log began was not acknowledged.
    std::uint64_t end = first + log.inputs.size();
    if (n + 1 < contents.logs.size()) end = std::min(end, contents.logs[n + 1].read.head.first());
    for (std::uint64_t at = contents.position; at < end; ++at)
      contents.inputs.push_back(std::move(log.inputs[at - first]));
    contents.position = std::max(contents.position, end);
    if (!log.lost.empty()) {
      contents.lost = log.lost;
      return;
    }
  }
}

}  // namespace

std::filesystem::path StoreFiles::lock() const { return folder_ / "lock"; }
std::filesystem::path StoreFiles::state(const std::string& name) const {
  return folder_ / absl::StrCat(name, kStateSuffix);
}
InputLogFiles StoreFiles::log(std::uint64_t number) const {
  return {folder_ / absl::StrCat(number, kInputsSuffix), folder_ / absl::StrCat(number, kMirrorSuffix)};
}
std::filesystem::path StoreFiles::aside() const { return folder_ / "failed"; }
std::filesystem::path StoreFiles::aside_reason() const { return aside() / "reason"; }

bool StoreFiles::is_ours(const std::filesystem::path& file) {
  const std::string extension = file.extension();
  return extension == kStateSuffix || extension == kInputsSuffix || extension == kMirrorSuffix ||
         extension == kUnfinishedSuffix;
}

std::vector<std::string> StoreContents::damage() const {
  std::vector<std::string> lines;
  for (const FoundLog& log : logs) lines.insert(lines.end(), log.read.damage.begin(), log.read.damage.end());
  return lines;
}

absl::StatusOr<StoreContents> read_store(const StoreFiles& files, Disk& disk) {
  std::set<std::uint64_t> logs;
  bool has_states = false;
  for (const std::filesystem::path& file : disk.files_in(files.folder())) {
    if (file.filename() == kFormerDatabase) return of_another_format(file);
    std::uint64_t number = 0;
    const std::string extension = file.extension();
    if (!absl::SimpleAtoi(file.stem().string(), &number)) continue;
    if (extension == kInputsSuffix || extension == kMirrorSuffix) logs.insert(number);
    has_states |= extension == kStateSuffix;
  }
  StoreContents contents{.state = no_world()};
  if (logs.empty()) {
    if (!has_states) return contents;
    return absl::DataLossError(
        absl::StrCat(files.folder().string(), ": there are states of a world, but its inputs are missing"));
  }
  absl::Status status = read_logs(files, {logs.begin(), logs.end()}, disk, contents);
  if (!status.ok()) return status;
  take_inputs(files, contents);
  if (contents.head().state() == 0) return contents;
  const auto path_of = [&files](const std::string& part) { return files.state(part); };
  const std::string name = absl::StrCat(contents.head().state());
  contents.state = read_state(name, path_of, disk);
  contents.state_files = parts_before(files.state(name), disk);
  contents.state_files.push_back(name);
  return contents;
}

absl::Status mend_logs(const StoreFiles& files, const StoreContents& contents, Disk& disk) {
  for (const FoundLog& log : contents.logs) {
    if (log.read.damage.empty()) continue;
    absl::Status status = mend_input_log(files.log(log.number), log.read, disk);
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace tessera
