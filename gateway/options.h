// The gateway's options: command line, environment and configuration file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "daemon/locks.h"
#include "daemon/log.h"
#include "gateway/limits.h"
#include "gateway/traffic.h"
#include "transport/dds_link.h"

namespace CLI {
class App;
}

namespace tessera {

struct GatewayArguments {
  DdsOptions dds;  // for the name of the cluster: a gateway does not join the network of the daemons
  std::vector<std::string> connect = {"127.0.0.1:7300"};
  std::string listen = "127.0.0.1:7310";
  GatewayLimits limits{.calls = kGatewayCallsMax, .calls_per_client = kGatewayCallsPerClientMax};
  std::string metrics_address;  // empty: no metrics
  std::string ready_file;
  LogOptions log;
  KeysOptions keys;
  bool exit_with_parent = false;
};

inline constexpr const char* kGatewayName = "tessera-gateway";

// Adds every option to `app`, which is named kGatewayName.
void add_options(CLI::App& app, GatewayArguments& arguments);

// Reads the command line, the environment and the configuration file. Returns the exit code if the process
// must end now, after printing help or because of an error.
std::optional<int> read_arguments(int argc, char** argv, GatewayArguments& arguments);

}  // namespace tessera
