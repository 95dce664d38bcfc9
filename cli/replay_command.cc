// tessera replay: a recording of inputs, played again and compared.
#include <absl/strings/str_format.h>

#include <memory>

#include "cli/command.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/replay.h"
#include "cli/terminal.h"
#include "cli/text.h"

namespace tessera::cli {
namespace {

absl::Status run(const ReplayOptions& options, const std::filesystem::path& json) {
  catch_interrupts();
  const absl::StatusOr<ReplayReport> report = replay(options);
  if (!report.ok()) return report.status();
  absl::PrintF("%s: %s commands, %s ticks; %s at all %s that have one\n", report->world,
               grouped(report->commands), grouped(report->tick), coloured("the same hash", Colour::kGreen),
               grouped(report->hashes));
  if (json.empty()) return absl::OkStatus();
  return write_json(json, {{"world", report->world},
                           {"ticks", report->tick},
                           {"commands", report->commands},
                           {"hashes", report->hashes}});
}

}  // namespace

void add_replay_command(CLI::App& app, Action& action) {
  CLI::App& command = add_command(
      app, "replay", "Replay a recording of `up --record-inputs`, and compare the hash at every tick.",
      "tessera replay inputs.rec --servers 1");
  const auto options = std::make_shared<ReplayOptions>();
  command.add_option("file", options->file, "the recording")->required();
  CLI::Option* servers =
      command.add_option("--servers", options->servers, "on so many sector servers, each a process")
          ->check(CLI::Range(1, 64));
  command.add_flag("--in-process")
      ->description("in this process, without any network (the default)")
      ->excludes(servers);
  command.add_option("--threads", options->threads, "of each server")
      ->check(CLI::Range(1, 256))
      ->needs(servers);
  const auto json = std::make_shared<std::filesystem::path>();
  command.add_option("--json", *json, "file for the same as data");
  command.callback([=, &action] { action = [=] { return run(*options, *json); }; });
}

}  // namespace tessera::cli
