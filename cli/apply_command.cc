// Commands, ticks and queries of a file, in one message: apply.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iostream>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "cli/connection.h"
#include "proto/disk.h"
#include "tessera/batch_json.h"

namespace tessera::cli {
namespace {

absl::StatusOr<std::string> read_text(const std::string& file) {
  if (file == "-") return std::string(std::istreambuf_iterator<char>(std::cin), {});
  std::string text;
  const absl::Status read = system_disk().read(file, [&text](std::string_view bytes) {
    text += bytes;
    return absl::OkStatus();
  });
  if (!read.ok()) return read;
  return text;
}

}  // namespace

void add_apply_command(CLI::App& app, Action& action) {
  CLI::App& command = add_command(
      app, "apply",
      "Send a request from a JSON file: commands that take effect together at one tick or not at all, "
      "ticks, and queries. Prints the answers.",
      "echo '{\"commands\": [{\"applyImpulse\": {\"body\": {\"name\": \"crate\"}, \"impulse\": "
      "{\"z\": 5}}}], \"queries\": [{\"states\": {\"namePrefix\": \"crate\"}}]}' | tessera apply -");
  const auto file = std::make_shared<std::string>();
  command.add_option("file", *file, "a Request of proto/tessera.proto as JSON; -: standard input")
      ->required();
  const auto batch = std::make_shared<Batch>();
  on_cluster(
      command, action,
      [batch](Client& client, nlohmann::json& data) -> absl::Status {
        const absl::StatusOr<Answers> answers = client.run(*batch);
        if (!answers.ok()) return answers.status();
        const std::string json = to_json(*answers);
        data = nlohmann::json::parse(json);
        absl::PrintF("%s\n", json);
        return absl::OkStatus();
      },
      [file, batch]() -> absl::Status {
        const absl::StatusOr<std::string> text = read_text(*file);
        if (!text.ok()) return text.status();
        absl::StatusOr<Batch> read = batch_from_json(*text);
        const std::string name = *file == "-" ? "standard input" : *file;
        if (!read.ok()) return {read.status().code(), absl::StrCat(name, ": ", read.status().message())};
        *batch = *std::move(read);
        return absl::OkStatus();
      });
}

}  // namespace tessera::cli
