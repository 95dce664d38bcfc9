#include "cli/application.h"

#include <absl/strings/str_format.h>
#include <unistd.h>

#include <cstdio>

#include "cli/interrupt.h"
#include "cli/terminal.h"
#include "daemon/options.h"
#include "daemon/parse_command_line.h"

namespace tessera::cli {
namespace {

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
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kSuccess : kUsage;
  }
  const absl::Status status = action();
  if (!status.ok()) complain(app, status);
  if (const int signal = interrupting_signal(); signal != 0) return kInterrupted + signal;
  return status.ok() ? kSuccess : kFailure;
}

}  // namespace tessera::cli
