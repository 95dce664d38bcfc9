#include "tests/standby_cluster.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/time/clock.h>
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "keys/keys_folder.h"

namespace tessera::testing {
namespace {

constexpr absl::Duration kLookAgain = absl::Milliseconds(20);

// A port of loopback that nobody listens on now.
// Below those that the system gives to whoever wants any, so that nobody takes it before it is used.
int free_port() {
  constexpr int kFirst = 10'000;
  constexpr int kPorts = 20'000;
  static int next = getpid() * 97 % kPorts;
  for (;;) {
    const int port = kFirst + next++ % kPorts;
    const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    const bool is_free = bind(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    close(descriptor);
    if (is_free) return port;
  }
}

std::string text_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

void StandbyCluster::start_all(const HostNetwork* network, const std::filesystem::path& keys) {
  network_ = network;
  keys_folder_ = keys;
  folder_ = *cli::make_temporary_folder();
  etcd_url_ = absl::StrCat(keys.empty() ? "http://" : "https://", address(kEtcdHost, 2379));
  etcd_peer_url_ = absl::StrCat("http://", address(kEtcdHost, 2380));
  if (has_etcd_) start_etcd();
  for (const std::size_t place : {0, 1}) {
    if (stores_[place].empty()) stores_[place] = folder_ / absl::StrCat("store-", place);
    addresses_[place] = address(kCoordinatorHosts + place, 7300);
    if (has_etcd_ || place == 0) start_coordinator(place);
  }
  servers_.resize(3);
  for (std::size_t place = 0; place < servers_.size(); ++place) start_server(place);
  if (network_ != nullptr) network_->enter(kClientHost);
  const std::string all = has_etcd_ ? absl::StrCat(addresses_[0], ",", addresses_[1]) : addresses_[0];
  absl::StatusOr<std::unique_ptr<Client>> client = Client::connect(all, patience_, keys_folder_);
  ASSERT_THAT(client.status(), IsOk());
  client_ = *std::move(client);
  begin(*client_);
}

StandbyCluster::~StandbyCluster() {
  if (HasFailure()) {
    for (const auto& log : logs_) std::printf("%s:\n%s\n", log.c_str(), text_in(log).c_str());
  }
  bodies_.reset();
  contacts_.reset();
  client_.reset();
  for (auto& coordinator : coordinators_) coordinator.reset();
  servers_.clear();
  etcd_.reset();
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string StandbyCluster::address(std::size_t host, int port) const {
  return network_ != nullptr ? absl::StrCat(network_->address(host), ":", port)
                             : absl::StrCat("127.0.0.1:", free_port());
}

std::optional<cli::ChildProcess> StandbyCluster::start(std::size_t host, const std::filesystem::path& program,
                                                       const std::vector<std::string>& arguments) {
  logs_.push_back(folder_ / absl::StrCat(logs_.size(), "-", program.filename().string(), ".log"));
  if (network_ != nullptr) network_->enter(host);
  absl::StatusOr<cli::ChildProcess> process = cli::ChildProcess::start(program, arguments, logs_.back());
  if (network_ != nullptr) network_->enter(kClientHost);
  EXPECT_THAT(process.status(), IsOk());
  if (!process.ok()) return std::nullopt;
  return *std::move(process);
}

std::vector<std::string> StandbyCluster::of_cluster(std::vector<std::string> arguments) const {
  arguments.insert(arguments.end(), {"--cluster", absl::StrCat("standby-", getpid()), "--domain",
                                     absl::StrCat(1 + getpid() % 99), "--exit-with-parent"});
  if (!keys_folder_.empty()) arguments.insert(arguments.end(), {"--keys", keys_folder_.string()});
  if (network_ != nullptr) {
    if (keys_folder_.empty()) arguments.emplace_back("--insecure");
    std::vector<std::string> peers;
    for (std::size_t host = kCoordinatorHosts; host < kClientHost; ++host)
      peers.push_back(network_->address(host));
    arguments.insert(arguments.end(),
                     {"--interface", HostNetwork::kInterface, "--peers", absl::StrJoin(peers, ",")});
  }
  return arguments;
}

void StandbyCluster::start_etcd() {
  std::vector<std::string> arguments = {"--data-dir",
                                        (folder_ / "etcd").string(),
                                        "--listen-client-urls",
                                        etcd_url_,
                                        "--advertise-client-urls",
                                        etcd_url_,
                                        "--listen-peer-urls",
                                        etcd_peer_url_,
                                        "--initial-advertise-peer-urls",
                                        etcd_peer_url_,
                                        "--initial-cluster",
                                        absl::StrCat("default=", etcd_peer_url_)};
  if (!keys_folder_.empty()) {
    const std::filesystem::path own = keys_folder_ / kDaemonFolder;
    arguments.insert(arguments.end(),
                     {"--cert-file", (own / kCertificateFile).string(), "--key-file",
                      (own / kKeyFile).string(), "--client-cert-auth", "--trusted-ca-file",
                      (own / kAuthorityFile).string(), "--client-cert-allowed-hostname", kDaemonName});
  }
  etcd_ = start(kEtcdHost, "/usr/bin/etcd", arguments);
}

void StandbyCluster::start_coordinator(std::size_t place) {
  std::vector<std::string> arguments = of_cluster(
      {"--store", stores_[place].string(), "--listen", addresses_[place], "--servers", "3",
       "--checkpoint-every", "0.2", "--join-timeout", absl::StrCat(absl::ToInt64Seconds(patience_))});
  if (has_etcd_)
    arguments.insert(arguments.end(), {"--etcd", etcd_url_, "--leader-lease", absl::StrCat(lease_seconds_)});
  coordinators_[place] =
      start(kCoordinatorHosts + place, cli::executable_folder() / "tessera-coordinator", arguments);
  coordinator_logs_[place] = logs_.back();
}

void StandbyCluster::start_server(std::size_t place) {
  const std::string listen = network_ != nullptr ? server_address(place) : std::string("127.0.0.1:0");
  servers_[place] = start(kServerHosts + place, cli::executable_folder() / "tessera-sector-server",
                          of_cluster({"--threads", "1", "--listen", listen, "--join-timeout",
                                      absl::StrCat(absl::ToInt64Seconds(patience_))}));
}

std::string StandbyCluster::server_address(std::size_t place) const {
  return address(kServerHosts + place, 7301);
}

std::size_t StandbyCluster::leader() const {
  if (!has_etcd_) return 0;
  constexpr std::string_view kLeads = "leads (epoch ";
  const auto last_epoch = [&](std::size_t place) {
    const std::string log = text_in(coordinator_logs_[place]);
    const std::size_t at = log.rfind(kLeads);
    return at == std::string::npos ? 0L : std::atol(log.c_str() + at + kLeads.size());
  };
  return last_epoch(0) > last_epoch(1) ? 0 : 1;
}

std::size_t StandbyCluster::said(std::size_t place) const { return text_in(coordinator_logs_[place]).size(); }

void StandbyCluster::await(std::size_t place, const std::string& text, std::size_t before) {
  const absl::Time deadline = absl::Now() + kPatience;
  while (!absl::StrContains(text_in(coordinator_logs_[place]).substr(before), text)) {
    ASSERT_LT(absl::Now(), deadline) << text;
    read_what_is_there(absl::Now() + kLookAgain);
    if (HasFatalFailure()) return;
  }
}

}  // namespace tessera::testing
