// From the command line to the exit code: what all programs with subcommands have in common.
#pragma once

#include "cli/command.h"

namespace tessera::cli {

enum ExitCode : int { kSuccess = 0, kFailure = 1, kUsage = 2, kInterrupted = 128 };

// Parses the command line, which leaves the work of the chosen subcommand in `action`, and does that work.
// The exit code of the process: kUsage for a command line that cannot be followed; kInterrupted and the
// number of the signal where one interrupted the work; kFailure where it failed, which is told on standard
// error.
int run_application(CLI::App& app, int argc, char** argv, const Action& action);

}  // namespace tessera::cli
