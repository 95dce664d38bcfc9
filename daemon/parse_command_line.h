// Command lines, with errors that say what may have been meant.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

namespace tessera {

// As CLI::Range, but "nan", which is neither less nor more than any bound, is refused, too.
CLI::Validator number_within(double low, double high);

// As CLI::App::parse(). An argument that nobody knows is told before one that is missing, which it may be,
// misspelt; with the nearest option or command, if one is near. After an argument that nobody knows, or that
// is missing, app.exit() prints what the command takes.
void parse_command_line(CLI::App& app, int argc, char** argv);

}  // namespace tessera
