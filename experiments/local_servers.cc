#include "experiments/local_servers.h"

#include <ctime>

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

double LocalServers::coordinator_us() const {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(cluster_->coordinator(), &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) * 1e6 + static_cast<double>(time.tv_nsec) / 1e3;
}

}  // namespace tessera::experiments
