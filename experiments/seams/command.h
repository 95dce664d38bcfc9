// `tessera experiment seams`: what a border between sectors does, on one server and on two.
#pragma once

#include "cli/command.h"

namespace tessera::seams {

void add_seams_command(CLI::App& app, cli::Action& action);

}  // namespace tessera::seams
