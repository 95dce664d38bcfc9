// An etcd, two coordinators, three sector servers and a client, on this host or on one each.
#pragma once

#include <absl/time/time.h>

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/child_process.h"
#include "tests/host_network.h"
#include "tests/watched_run.h"

namespace tessera::testing {

class StandbyCluster : public WatchedRun {
 protected:
  static constexpr std::size_t kEtcdHost = 0;
  static constexpr std::size_t kCoordinatorHosts = 1;  // the first of two
  static constexpr std::size_t kServerHosts = 3;       // the first of three
  static constexpr std::size_t kClientHost = 6;
  static constexpr std::size_t kHosts = 7;

  // All of it, with the busy world running. On loopback, or on the hosts of `network`; with the folder
  // `keys`, if there is one, etcd too.
  void start_all(const HostNetwork* network = nullptr, const std::filesystem::path& keys = {});
  ~StandbyCluster() override;

  void start_etcd();
  void start_coordinator(std::size_t place);
  void start_server(std::size_t place);

  std::string server_address(std::size_t place) const;  // of its streams; with a network
  // What the daemons and etcd have said, by start.
  const std::vector<std::filesystem::path>& logs() const { return logs_; }

  // Which coordinator leads: the last that said so.
  std::size_t leader() const;
  // How much the coordinator at `place` has said.
  std::size_t said(std::size_t place) const;
  // Waits until it says `text` after that, and reads what ticks there are meanwhile.
  void await(std::size_t place, const std::string& text, std::size_t before);

  int lease_seconds_ = 2;  // of the coordinator that leads
  bool has_etcd_ = true;   // otherwise the first coordinator is alone, with its store
  // Of coordinators, by place; empty: in a temporary folder.
  std::array<std::filesystem::path, 2> stores_;
  std::string etcd_url_;
  std::array<std::optional<cli::ChildProcess>, 2> coordinators_;
  std::vector<std::optional<cli::ChildProcess>> servers_;
  std::optional<cli::ChildProcess> etcd_;
  std::unique_ptr<Client> client_;

 private:
  std::optional<cli::ChildProcess> start(std::size_t host, const std::filesystem::path& program,
                                         const std::vector<std::string>& arguments);
  std::vector<std::string> of_cluster(std::vector<std::string> arguments) const;
  // An address on a host; on loopback with a port that is free.
  std::string address(std::size_t host, int port) const;

  const HostNetwork* network_ = nullptr;
  std::filesystem::path keys_folder_;
  std::filesystem::path folder_;
  std::string etcd_peer_url_;
  std::array<std::string, 2> addresses_;
  std::vector<std::filesystem::path> logs_;
  std::array<std::filesystem::path, 2> coordinator_logs_;
};

}  // namespace tessera::testing
