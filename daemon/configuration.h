// The configuration file of the daemons, and the environment variables that override it.
//
// One TOML file serves all daemons of a host: first the common keys, then a section per daemon, named after
// the daemon without "tessera-". A key is the long name of an option. The command line overrides the
// environment, the environment overrides the file, and a daemon's section overrides the common keys:
//
//   --log-level debug                       the command line
//   TESSERA_LOG_LEVEL=debug                 the environment, for an option of all daemons
//   TESSERA_SECTOR_SERVER_ENGINE=f64        the environment, for an option of one daemon
//   [sector-server]                         the file
//   engine = "f64"
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace tessera {

// Adds the option --config to `app`, a daemon with all its other options, and an environment variable for
// every option. Unknown keys and sections are errors that name them.
void read_configuration(CLI::App& app);

// A configuration file with the effective settings of these daemons, each after parse(), and an explanation
// of every key. Keys with default values are comments.
std::string configuration_text(const std::vector<const CLI::App*>& daemons);

}  // namespace tessera
