// A local cluster that an experiment measures.
#pragma once

#include <absl/status/statusor.h>

#include <memory>

#include "cli/local_cluster.h"
#include "tessera/client.h"

namespace tessera::experiments {

// Servers of one thread each, and a client of them.
class LocalServers {
 public:
  // Errors as LocalCluster::start() and Client::connect().
  static absl::StatusOr<std::unique_ptr<LocalServers>> start(int servers, Precision precision);

  cli::LocalCluster& cluster() { return *cluster_; }
  Client& client() { return *client_; }

 private:
  std::unique_ptr<cli::LocalCluster> cluster_;
  std::unique_ptr<Client> client_;
};

}  // namespace tessera::experiments
