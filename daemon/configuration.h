// The configuration file of the daemons, and the environment variables that go before it.
//
// One file, in TOML, serves all daemons of a host: first the keys that all have, then a section a daemon,
// named as the daemon is without "tessera-". A key is the long name of an option. Command line goes before
// environment, environment before file, a daemon's section before the shared keys:
//
//   --log-level debug                       the command line
//   TESSERA_LOG_LEVEL=debug                 the environment, for an option that all daemons have
//   TESSERA_SECTOR_SERVER_ENGINE=f64        the environment, for an option of one
//   [sector-server]                         the file
//   engine = "f64"
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace tessera {

// Gives `app`, a daemon that has all its options, the option --config and an environment variable for every
// option. Keys and sections that no daemon knows are errors that name them.
void read_configuration(CLI::App& app);

// A configuration file that says what these daemons, each after parse(), have been told, with every key
// explained. Keys that keep their defaults are comments.
std::string configuration_text(const std::vector<const CLI::App*>& daemons);

}  // namespace tessera
