// The coordinator's options: command line, environment and configuration file.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "coordinator/coordinator_options.h"
#include "daemon/locks.h"
#include "daemon/log.h"
#include "transport/dds_link.h"

namespace CLI {
class App;
}

namespace tessera {

inline constexpr const char* kWaitForStore = "wait";

// Of an etcd with TLS, PEM; empty: as etcd_access() says.
struct EtcdFiles {
  std::string authority;
  std::string certificate;
  std::string key;
};

struct CoordinatorArguments {
  DdsOptions dds{.self = kCoordinatorNode};
  // A tick may take long, and the network sees where a server is gone.
  CoordinatorOptions coordinator{.server_timeout = std::chrono::minutes(2),
                                 .checkpoint_every = std::chrono::seconds(1),
                                 .balance_every = std::chrono::seconds(5),
                                 .balance_ahead = std::chrono::seconds(2)};
  std::string balance_policy = "curve";
  std::string listen = "127.0.0.1:7300";
  std::string metrics_address;                   // empty: no metrics
  std::string record_inputs;                     // empty: no recording
  std::string store;                             // a folder; empty: nothing outlives the process
  std::string when_store_fails = kWaitForStore;  // or go-on
  std::vector<std::string> etcd;                 // URLs; empty: one coordinator
  EtcdFiles etcd_files;
  std::chrono::nanoseconds leader_lease = std::chrono::seconds(3);  // whole seconds
  std::string ready_file;
  std::size_t queued_request_bytes_max = kQueuedRequestBytesMax;
  LogOptions log;
  KeysOptions keys;
  bool exit_with_parent = false;
};

inline constexpr const char* kCoordinatorName = "tessera-coordinator";

// Adds every option to `app`, which is named kCoordinatorName.
void add_options(CLI::App& app, CoordinatorArguments& arguments);

// Reads the command line, the environment and the configuration file. Returns the exit code if the process
// must end now, after printing help or because of an error.
std::optional<int> read_arguments(int argc, char** argv, CoordinatorArguments& arguments);

}  // namespace tessera
