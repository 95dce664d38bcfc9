#include "cli/application.h"

#include <absl/strings/str_format.h>
#include <unistd.h>

#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/interrupt.h"
#include "cli/terminal.h"
#include "daemon/options.h"
#include "daemon/parse_command_line.h"

namespace tessera::cli {
namespace {

void complain(const CLI::App& app, const absl::Status& status) {
  std::fflush(stdout);  // what came before stands before, where both go to one file
  clear_progress();
  const bool colours = shows_colours(STDERR_FILENO);
  absl::FPrintF(stderr, "%s%s: %s%s\n", colours ? "\033[31m" : "", app.get_name(), status.message(),
                colours ? "\033[0m" : "");
}

}  // namespace

int run_application(CLI::App& app, int argc, char** argv, const Action& action) {
  add_version_flag(app);
  std::vector<char*> arguments(argv, argv + argc);
  char help[] = "--help";
  if (argc > 1 && std::string_view(argv[1]) == "help") {  // `tessera help run` is `tessera run --help`
    arguments.erase(arguments.begin() + 1);
    const auto has_name = [&](const CLI::App* command) { return command->get_name() == argv[2]; };
    const bool is_known = argc == 2 || !std::as_const(app).get_subcommands(has_name).empty();
    if (!is_known) arguments.resize(2);  // which parsing tells, and does nothing else
    if (is_known) arguments.push_back(help);
  }
  try {
    parse_command_line(app, static_cast<int>(arguments.size()), arguments.data());
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kSuccess : kUsage;
  }
  const absl::Status status = action();
  if (!status.ok()) complain(app, status);
  if (const int signal = interrupting_signal(); signal != 0) return kInterrupted + signal;
  return status.ok() ? kSuccess : kFailure;
}

}  // namespace tessera::cli
