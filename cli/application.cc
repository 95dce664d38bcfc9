#include "cli/application.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "cli/interrupt.h"
#include "cli/terminal.h"
#include "daemon/options.h"

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

void complain(const CLI::App& app, const absl::Status& status) {
  std::fflush(stdout);  // what came before stands before, where both go to one file
  if (isatty(STDERR_FILENO))
    absl::FPrintF(stderr, "\r\033[K");  // a progress bar that was ended with its process
  const bool colours = shows_colours(STDERR_FILENO);
  absl::FPrintF(stderr, "%s%s: %s%s\n", colours ? "\033[31m" : "", app.get_name(), status.message(),
                colours ? "\033[0m" : "");
}

}  // namespace

int run_application(CLI::App& app, int argc, char** argv, const Action& action) {
  add_version_flag(app);
  try {
    parse(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kSuccess : kUsage;
  }
  const absl::Status status = action();
  if (!status.ok()) complain(app, status);
  if (const int signal = interrupting_signal(); signal != 0) return kInterrupted + signal;
  return status.ok() ? kSuccess : kFailure;
}

}  // namespace tessera::cli
