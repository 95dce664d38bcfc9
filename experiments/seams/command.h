// `tessera experiment seams`: the effect of borders between sectors, on one server and on two.
#pragma once

#include "cli/command.h"

namespace tessera::seams {

void add_seams_command(CLI::App& app, cli::Action& action);

}  // namespace tessera::seams
