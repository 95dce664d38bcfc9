// A cluster on this machine: a coordinator and its sector servers as child processes, from start to end.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/time/time.h>
#include <sys/types.h>

#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/child_process.h"
#include "lpss/model/world_description.h"

namespace tessera::cli {

inline constexpr const char* kViewer = "tessera-viewer";  // the program that serves the web UI

// The default of coordinators.
inline constexpr absl::Duration kBalanceEvery = absl::Seconds(5);

struct LocalClusterOptions {
  int servers = 2;            // a world is loaded on this many
  int servers_to_start = -1;  // others join later, or never; negative: all of them
  Precision precision = Precision::kFloat32;
  int threads = 1;                     // of each server
  std::string listen = "127.0.0.1:0";  // of the coordinator; port 0: any free one
  std::filesystem::path daemons;       // their folder; empty: that of this executable
  absl::Duration start_timeout = absl::Seconds(20);
  absl::Duration join_timeout = absl::Seconds(20);  // how long a load waits for servers
  int interrupt_descriptor = -1;                    // readable when the user wants to end
  std::vector<std::string> gateways;                // host:port of each; port 0: any free one
  std::string page;                                 // host:port of tessera-viewer; empty: without
  bool page_on_any_port = false;                    // where that port is in use
  std::filesystem::path looks;                      // the world file whose visuals it shows; may be empty
  absl::Duration checkpoint_every;                  // 0: none, and the world ends with any of its servers
  absl::Duration balance_every = kBalanceEvery;     // 0: never
  std::string balance_policy = "curve";
  bool store = false;                   // the world, in a folder of the cluster's, which ends with it
  std::filesystem::path store_folder;   // or in this one, which stays
  bool replaces_daemons = false;        // in wait_for_interrupt()
  std::filesystem::path keys;           // folder of `tessera keys create`; empty: none
  bool insecure = false;                // without keys, beyond loopback nevertheless
  std::filesystem::path record_inputs;  // a file that is not there yet; empty: nothing is recorded
};

// The processes have a cluster name and folder of their own, and end when the thread that started them does.
// One thread at a time.
class LocalCluster {
 public:
  // Returns when the coordinator and the gateways answer clients, and the web UI browsers; servers may still
  // be joining: a load waits for them. UNAVAILABLE with the last lines of its log where a daemon ends early,
  // NOT_FOUND where there is none to start, DEADLINE_EXCEEDED, CANCELLED.
  static absl::StatusOr<std::unique_ptr<LocalCluster>> start(const LocalClusterOptions& options);

  // Stops what still runs.
  ~LocalCluster();

  // host:port of the coordinator.
  const std::string& address() const { return address_; }
  // Of the gateways, in their order.
  const std::vector<std::string>& gateways() const { return gateway_addresses_; }
  pid_t gateway(std::size_t place) const { return beside_.at(place).process.pid(); }
  // Of the web UI; empty if there is none.
  const std::string& page_url() const { return page_url_; }
  pid_t coordinator() const { return daemons_.front().pid(); }
  // Of the server that was started as number `place`, from 0 on.
  pid_t server(std::size_t place) const { return daemons_.at(place + 1).pid(); }
  std::vector<pid_t> processes() const;
  // What the coordinator has said so far.
  std::filesystem::path coordinator_log() const { return folder_ / "coordinator-0.log"; }
  // The options by which one more daemon would join this cluster.
  std::vector<std::string> identity() const { return {"--cluster", cluster_, "--domain", domain_}; }

  // One more sector server of the same kind.
  absl::Status start_server();

  // Others in the place of daemons that have ended, or are ending: the server that was started as number
  // `place`, or the coordinator, at the same address.
  absl::Status replace_server(std::size_t place) { return replace(place + 1); }
  absl::Status replace_coordinator() { return replace(0); }

  // Does `call`, which talks to the cluster, on another thread, and `meanwhile` here a few times a second. If
  // a daemon ends before the call does, or the user interrupts, the cluster is stopped and the status says
  // why.
  absl::Status attend(
      const std::function<absl::Status()>& call, const std::function<void()>& meanwhile = [] {});

  // Waits until all daemons have ended by themselves, after Client::shutdown(), and removes their logs.
  // DEADLINE_EXCEEDED, naming those that still run; UNAVAILABLE where one ended with an error.
  absl::Status wait_until_ended(absl::Duration timeout);

  // Waits, without any limit, until the user interrupts (OK) or a daemon ends (UNAVAILABLE; OK if in order).
  // If a gateway or the web UI ends, or a daemon that is replaced, `on_loss` is called with what is lost, and
  // the cluster continues.
  absl::Status wait_for_interrupt(const std::function<void(const std::string&)>& on_loss);

  // Asks all daemons to end (SIGTERM), and ends those that have not within `patience`.
  void stop(absl::Duration patience = absl::Seconds(5));

  // Why a daemon has ended, if one has, with the last lines of its log.
  absl::Status failure();

 private:
  explicit LocalCluster(const LocalClusterOptions& options);
  absl::Status launch();
  absl::Status start_gateway(const std::string& listen, int inotify);
  absl::Status start_page(int inotify);
  absl::StatusOr<ChildProcess> new_server();
  absl::StatusOr<ChildProcess> new_coordinator(const std::string& listen);
  void add_keys(std::vector<std::string>& arguments) const;
  bool may_replace();
  absl::Status replace(std::size_t place);
  absl::StatusOr<std::string> await_ready(const std::string& file, ChildProcess& process, int inotify);
  absl::StatusOr<ChildProcess> start_daemon(const std::string& name, std::vector<std::string> arguments);

  LocalClusterOptions options_;
  std::filesystem::path folder_;
  std::string cluster_;
  std::string domain_;
  std::string address_;
  std::string page_url_;
  std::vector<ChildProcess> daemons_;  // the coordinator first
  // No part of the cluster: it may end, and the cluster goes on.
  struct Beside {
    std::string name;
    ChildProcess process;
  };
  std::vector<Beside> beside_;  // the gateways first
  std::vector<std::string> gateway_addresses_;
  int logs_ = 0;                     // begun
  std::deque<absl::Time> replaced_;  // the latest ones, when
  bool keep_logs_ = false;
};

}  // namespace tessera::cli
