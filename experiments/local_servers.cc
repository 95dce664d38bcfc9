#include "experiments/local_servers.h"

#include "cli/interrupt.h"

namespace tessera::experiments {

absl::StatusOr<std::unique_ptr<LocalServers>> LocalServers::start(int servers, Precision precision,
                                                                  absl::Duration checkpoint_every,
                                                                  absl::Duration balance_every) {
  cli::LocalClusterOptions options;
  options.servers = servers;
  options.precision = precision;
  options.checkpoint_every = checkpoint_every;
  options.balance_every = balance_every;
  options.store = checkpoint_every > absl::ZeroDuration();
  options.interrupt_descriptor = cli::interrupt_descriptor();
  absl::StatusOr<std::unique_ptr<cli::LocalCluster>> cluster = cli::LocalCluster::start(options);
  if (!cluster.ok()) return cluster.status();
  absl::StatusOr<std::unique_ptr<Client>> client = Client::connect((*cluster)->address());
  if (!client.ok()) return client.status();
  auto started = std::make_unique<LocalServers>();
  started->cluster_ = *std::move(cluster);
  started->client_ = *std::move(client);
  return started;
}

}  // namespace tessera::experiments
