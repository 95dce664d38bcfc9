// config: apart from the other subcommands, since it alone needs what the daemons' options stand on.
#pragma once

#include "cli/command.h"

namespace tessera::cli {

void add_config_command(CLI::App& app, Action& action);

}  // namespace tessera::cli
