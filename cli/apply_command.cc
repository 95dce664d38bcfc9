// Commands, ticks and queries of a file, in one message: apply.
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cerrno>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "cli/connection.h"
#include "tessera/batch_json.h"

namespace tessera::cli {
namespace {

absl::StatusOr<std::string> read_text(const std::string& file) {
  if (file == "-") return std::string(std::istreambuf_iterator<char>(std::cin), {});
  std::ifstream in(file, std::ios::binary);
  if (!in) return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", file));
  return std::string(std::istreambuf_iterator<char>(in), {});
}

}  // namespace

void add_apply_command(CLI::App& app, Action& action) {
  CLI::App& command = add_command(
      app, "apply",
      "Do what a JSON file says, in one message: commands at one tick, whole or not at all, ticks, "
      "queries. Prints the answers.",
      "echo '{\"commands\": [{\"applyImpulse\": {\"body\": {\"name\": \"crate\"}, \"impulse\": "
      "{\"z\": 5}}}], \"queries\": [{\"states\": {\"namePrefix\": \"crate\"}}]}' | tessera apply -");
  const auto file = std::make_shared<std::string>();
  command.add_option("file", *file, "a Request of proto/tessera.proto as JSON; -: standard input")
      ->required();
  on_cluster(command, action, [file](Client& client, nlohmann::json& data) -> absl::Status {
    const absl::StatusOr<std::string> text = read_text(*file);
    if (!text.ok()) return text.status();
    const absl::StatusOr<Batch> batch = batch_from_json(*text);
    if (!batch.ok()) return {batch.status().code(), absl::StrCat(*file, ": ", batch.status().message())};
    const absl::StatusOr<Answers> answers = client.run(*batch);
    if (!answers.ok()) return answers.status();
    const std::string json = to_json(*answers);
    data = nlohmann::json::parse(json);
    absl::PrintF("%s\n", json);
    return absl::OkStatus();
  });
}

}  // namespace tessera::cli
