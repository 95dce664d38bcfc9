// Programs that look at a cluster until they are ended: what their command lines and their ends have in
// common.
#pragma once

#include <absl/status/status.h>

#include <CLI/App.hpp>
#include <functional>
#include <string>

#include "daemon/log.h"
#include "tessera/client.h"

namespace tessera::live {

struct ClientOptions {
  std::string connect = "127.0.0.1:7300";  // host:port of the coordinator
  LogOptions log;
};

void add_client_options(CLI::App& app, ClientOptions& options);

// Parses, connects and calls `serve`, which keeps what it opens until `wait` returns: at SIGINT or SIGTERM.
// The exit code of the process: 0; 1 where the work failed, which is told in the log; 2 for a command line
// that cannot be followed.
int run_client(CLI::App& app, int argc, char** argv, const ClientOptions& options,
               const std::function<absl::Status(Client& client, const std::function<void()>& wait)>& serve);

}  // namespace tessera::live
