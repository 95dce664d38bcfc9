// `tessera tune`: the cheapest settings with which a world moves as it should.
#include <absl/strings/str_format.h>

#include <memory>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/progress.h"
#include "cli/terminal.h"
#include "cli/tune/tune.h"
#include "cli/world_options.h"
#include "client_sdk/arguments/parse.h"

namespace tessera::cli {
namespace {

struct CommandOptions {
  std::filesystem::path world;
  WorldOverrides overrides;
  TuneOptions tune;
  std::filesystem::path write;
  std::filesystem::path json;
};

absl::Status tune_world(const CommandOptions& options) {
  catch_interrupts();
  const absl::StatusOr<LoadedWorld> loaded = load_world(options.world, options.overrides);
  if (!loaded.ok()) return loaded.status();
  absl::StatusOr<Report> report =
      with_bar("tune", [&](const Progress& progress) { return tune(loaded->world, options.tune, progress); });
  if (!report.ok()) return report.status();
  absl::PrintF("%s\n", table(to_cells(report->table("rows"), 4)));
  if (!options.json.empty()) {
    if (absl::Status status = write_json(options.json, to_json(*report)); !status.ok()) return status;
  }
  if (report->table("chosen").empty()) return absl::FailedPreconditionError(report->misses.front());
  const Row& chosen = report->table("chosen").front();
  absl::PrintF("%s %s\n", coloured("cheapest:", Colour::kGreen), chosen.dump());
  if (options.write.empty()) return absl::OkStatus();
  absl::PrintF("written for: tessera run %s --settings %s\n", options.world.string(), options.write.string());
  return write_json(options.write, chosen);
}

}  // namespace

void add_tune_command(CLI::App& app, Action& action) {
  CLI::App& command =
      add_command(app, "tune", "Find the cheapest settings that keep a world within an error.",
                  "tessera tune worlds/machines.sdf --max-error 1mm --horizon 2s --write machines.json");
  const auto options = std::make_shared<CommandOptions>();
  command.add_option("world", options->world, kWorldFile)->required();
  add_parsed(command, "--max-error", options->tune.max_error, parse_length,
             "how far any body may be from where a far finer run has it; 1mm if not given");
  add_parsed(command, "--horizon", options->tune.horizon, parse_seconds, "for how long; 2s if not given");
  command.add_option("--max-cost", options->tune.max_cost,
                     "us of processor time by body and simulated second, at most; any if not given");
  add_override_options(command, options->overrides);
  add_parsed(command, "--write", options->write, parse_output_file,
             "write what was chosen to this file, for --settings");
  add_parsed(command, "--json", options->json, parse_output_file, "write all that was tried to this file");
  command.callback([options, &action] { action = [options] { return tune_world(*options); }; });
}

}  // namespace tessera::cli
