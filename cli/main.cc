// tessera: run worlds, start clusters, and drive and watch them.
#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "cli/command.h"
#include "cli/config_command.h"
#include "cli/terminal.h"

namespace tessera::cli {
namespace {

// The last command that was named.
const CLI::App& named_last(const CLI::App& app) {
  const std::vector<CLI::App*> named = app.get_subcommands();
  return named.empty() ? app : named_last(*named.back());
}

// "remove, run, spawn"; nothing where the command has no others.
std::string commands_of(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::App* one : command.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(one->get_name());
  }
  std::sort(names.begin(), names.end());
  return absl::StrJoin(names, ", ");
}

// Of arguments that nobody knows, the options: what else is left over may be the value of one of them.
CLI::ExtrasError unknown_arguments(std::vector<std::string> unknown) {
  std::vector<std::string> options;
  std::ranges::copy_if(unknown, std::back_inserter(options),
                       [](const std::string& argument) { return argument.starts_with('-'); });
  return CLI::ExtrasError(options.empty() ? std::move(unknown) : std::move(options));
}

// An argument that nobody knows is told before one that is missing: it may be the missing one, misspelt.
// Where that is a command, those that there are are told, too.
void parse(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ExtrasError&) {
    throw unknown_arguments(app.remaining(/*recurse=*/true));
  } catch (const CLI::RequiredError& missing) {
    const std::vector<std::string> unknown = app.remaining(/*recurse=*/true);
    std::string message = unknown.empty() ? missing.what() : unknown_arguments(unknown).what();
    if (const std::string commands = commands_of(named_last(app)); !commands.empty()) {
      absl::StrAppend(&message, "\nThere are: ", commands);
    }
    throw CLI::ParseError(message, missing.get_exit_code());
  }
}

int run(int argc, char** argv) {
  CLI::App app("Rigid-body simulation in worlds of any size, on any number of servers.", "tessera");
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  tessera run worlds/earth.sdf --servers 2 --seconds 10\n"
      "  tessera up --servers 2\n"
      "  tessera load worlds/seam.sdf\n"
      "  tessera run --help");
  Action action;
  add_run_command(app, action);
  add_cluster_commands(app, action);
  add_body_commands(app, action);
  add_joint_commands(app, action);
  add_status_commands(app, action);
  add_query_commands(app, action);
  add_convert_command(app, action);
  add_simulate_command(app, action);
  add_replay_command(app, action);
  add_tune_command(app, action);
  add_experiment_command(app, action);
  add_config_command(app, action);
  try {
    parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kSuccess : kUsage;
  }
  const absl::Status status = action();
  if (status.ok()) return kSuccess;
  std::fflush(stdout);  // what came before stands before, where both go to one file
  const bool colours = shows_colours(STDERR_FILENO);
  absl::FPrintF(stderr, "%stessera: %s%s\n", colours ? "\033[31m" : "", status.message(),
                colours ? "\033[0m" : "");
  return kFailure;
}

}  // namespace
}  // namespace tessera::cli

int main(int argc, char** argv) {
  // What a tick frees, the next one wants again: keep it instead of handing it to the kernel and back.
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  return tessera::cli::run(argc, argv);
}
