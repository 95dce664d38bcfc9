// A local cluster that an experiment measures.
#pragma once

#include <absl/status/statusor.h>
#include <absl/time/time.h>

#include <memory>

#include "cli/local_cluster.h"
#include "tessera/client.h"

namespace tessera::experiments {

// Servers of one thread each, and a client of them.
class LocalServers {
 public:
  // With `checkpoint_every`, the state of a world is kept so often, in a store that ends with the cluster.
  // With a `balance_every` of 0, sectors stay where they are. Errors as LocalCluster::start() and
  // Client::connect().
  static absl::StatusOr<std::unique_ptr<LocalServers>> start(
      int servers, Precision precision, absl::Duration checkpoint_every = {},
      absl::Duration balance_every = cli::LocalClusterOptions().balance_every);

  // Processor time that the coordinator has taken so far, us; 0 if it has ended.
  double coordinator_us() const;

  cli::LocalCluster& cluster() { return *cluster_; }
  Client& client() { return *client_; }

 private:
  std::unique_ptr<cli::LocalCluster> cluster_;
  std::unique_ptr<Client> client_;
};

}  // namespace tessera::experiments
