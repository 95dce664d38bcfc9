// What programs that observe a cluster until they are stopped have in common: command line, start and end.
#pragma once

#include <absl/status/status.h>

#include <functional>
#include <string>

#include "daemon/log.h"
#include "tessera/client.h"

namespace CLI {
class App;
}

namespace tessera::live {

struct ClientOptions {
  std::string connect = "127.0.0.1:7300";  // host:port of the coordinator
  std::string keys;                        // folder; empty: none
  LogOptions log;
};

void add_client_options(CLI::App& app, ClientOptions& options);

// Parses, connects and calls `serve`, which keeps its resources until `wait` returns at SIGINT or SIGTERM.
// Returns the exit code of the process: 0; 1 after a failure, which is logged; 2 for an invalid command line.
int run_client(CLI::App& app, int argc, char** argv, const ClientOptions& options,
               const std::function<absl::Status(Client& client, const std::function<void()>& wait)>& serve);

}  // namespace tessera::live
