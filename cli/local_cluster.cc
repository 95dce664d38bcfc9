#include "cli/local_cluster.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>
#include <absl/time/clock.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

namespace tessera::cli {
namespace {

constexpr absl::Duration kLookEvery = absl::Milliseconds(200);
constexpr absl::Duration kReplacedSpan = absl::Minutes(1);
constexpr std::size_t kReplacedMax = 20;  // daemons in that time
constexpr absl::Duration kForever = absl::InfiniteDuration();
constexpr const char* kReadyFile = "coordinator.ready";
constexpr const char* kStore = "store";
constexpr const char* kPageReadyFile = "page.ready";

// Domains up to 100 use ports that Linux hands out to nobody else. Clusters of different names may share one.
constexpr pid_t kDomains = 99;

absl::Status interrupted_status() { return absl::CancelledError("interrupted"); }

}  // namespace

LocalCluster::LocalCluster(const LocalClusterOptions& options)
    : options_(options),
      cluster_(absl::StrCat("local-", getpid(), "-", absl::ToUnixNanos(absl::Now()))),
      domain_(absl::StrCat(1 + getpid() % kDomains)) {
  if (options_.daemons.empty()) options_.daemons = executable_folder();
}

absl::StatusOr<std::unique_ptr<LocalCluster>> LocalCluster::start(const LocalClusterOptions& options) {
  std::unique_ptr<LocalCluster> cluster(new LocalCluster(options));
  if (absl::Status status = cluster->launch(); !status.ok()) return status;
  return cluster;
}

LocalCluster::~LocalCluster() {
  stop();
  std::error_code ignored;
  if (!keep_logs_ && !folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

absl::Status LocalCluster::launch() {
  absl::StatusOr<std::filesystem::path> folder = make_temporary_folder();
  if (!folder.ok()) return folder.status();
  folder_ = *std::move(folder);
  const int inotify = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  const absl::Cleanup close_inotify = [inotify] { close(inotify); };
  if (inotify < 0 || inotify_add_watch(inotify, folder_.c_str(), IN_CLOSE_WRITE | IN_MOVED_TO) < 0) {
    return absl::InternalError(absl::StrCat("cannot watch ", folder_.string(), ": ", std::strerror(errno)));
  }
  absl::StatusOr<ChildProcess> coordinator = new_coordinator(options_.listen);
  if (!coordinator.ok()) return coordinator.status();
  daemons_.push_back(*std::move(coordinator));
  const int servers = options_.servers_to_start < 0 ? options_.servers : options_.servers_to_start;
  for (int i = 0; i < servers; ++i) {
    if (absl::Status status = start_server(); !status.ok()) return status;
  }
  absl::StatusOr<std::string> address = await_ready(kReadyFile, daemons_.front(), inotify);
  if (!address.ok()) return address.status();
  address_ = *std::move(address);
  for (const std::string& listen : options_.gateways) {
    if (absl::Status status = start_gateway(listen, inotify); !status.ok()) return status;
  }
  return options_.page.empty() ? absl::OkStatus() : start_page(inotify);
}

absl::Status LocalCluster::start_gateway(const std::string& listen, int inotify) {
  const std::string ready_file = absl::StrCat("gateway-", gateway_addresses_.size(), ".ready");
  absl::StatusOr<ChildProcess> gateway = start_daemon(
      "gateway",
      {"--connect", address_, "--listen", listen, "--ready-file", (folder_ / ready_file).string()});
  if (!gateway.ok()) return gateway.status();
  beside_.push_back({"a gateway", *std::move(gateway)});
  absl::StatusOr<std::string> address = await_ready(ready_file, beside_.back().process, inotify);
  if (!address.ok()) return address.status();
  gateway_addresses_.push_back(*std::move(address));
  return absl::OkStatus();
}

absl::Status LocalCluster::start_page(int inotify) {
  std::vector<std::string> arguments = {"--connect",         address_,
                                        "--listen",          options_.page,
                                        "--ready-file",      (folder_ / kPageReadyFile).string(),
                                        "--exit-with-parent"};
  add_keys(arguments);
  if (options_.page_on_any_port) arguments.push_back("--any-port");
  if (!options_.looks.empty()) arguments.insert(arguments.end(), {"--looks", options_.looks.string()});
  absl::StatusOr<ChildProcess> page =
      ChildProcess::start(options_.daemons / kViewer, arguments, folder_ / "viewer.log");
  if (!page.ok()) return page.status();
  beside_.push_back({"the web UI", *std::move(page)});
  absl::StatusOr<std::string> url = await_ready(kPageReadyFile, beside_.back().process, inotify);
  if (!url.ok()) return url.status();
  page_url_ = *std::move(url);
  return absl::OkStatus();
}

// Said in any case, so that the environment does not count.
void LocalCluster::add_keys(std::vector<std::string>& arguments) const {
  arguments.insert(arguments.end(), {"--keys", options_.keys.string()});
  if (options_.insecure) arguments.emplace_back("--insecure");
}

absl::StatusOr<ChildProcess> LocalCluster::start_daemon(const std::string& name,
                                                        std::vector<std::string> arguments) {
  for (const std::string& argument : identity()) arguments.push_back(argument);
  arguments.emplace_back("--exit-with-parent");
  add_keys(arguments);
  const std::string log = absl::StrCat(name, "-", logs_++, ".log");
  return ChildProcess::start(options_.daemons / absl::StrCat("tessera-", name), arguments, folder_ / log);
}

absl::StatusOr<ChildProcess> LocalCluster::new_coordinator(const std::string& listen) {
  std::vector<std::string> arguments = {
      "--listen",           listen,
      "--servers",          absl::StrCat(options_.servers),
      "--ready-file",       (folder_ / kReadyFile).string(),
      "--join-timeout",     absl::StrCat(absl::ToDoubleSeconds(options_.join_timeout)),
      "--checkpoint-every", absl::StrCat(absl::ToDoubleSeconds(options_.checkpoint_every)),
      "--balance-every",    absl::StrCat(absl::ToDoubleSeconds(options_.balance_every)),
      "--balance-policy",   options_.balance_policy};
  if (!options_.record_inputs.empty()) {
    arguments.insert(arguments.end(), {"--record-inputs", options_.record_inputs.string()});
  }
  if (options_.store || !options_.store_folder.empty()) {
    const std::filesystem::path store =
        options_.store_folder.empty() ? folder_ / kStore : options_.store_folder;
    arguments.insert(arguments.end(), {"--store", store.string()});
  }
  return start_daemon("coordinator", std::move(arguments));
}

absl::StatusOr<ChildProcess> LocalCluster::new_server() {
  return start_daemon("sector-server", {"--engine", name_of(options_.precision), "--threads",
                                        absl::StrCat(options_.threads), "--listen", "127.0.0.1:0"});
}

absl::Status LocalCluster::start_server() {
  absl::StatusOr<ChildProcess> server = new_server();
  if (!server.ok()) return server.status();
  daemons_.push_back(*std::move(server));
  return absl::OkStatus();
}

// Waits for the first line of `file`, which `process` writes once it serves.
absl::StatusOr<std::string> LocalCluster::await_ready(const std::string& file, ChildProcess& process,
                                                      int inotify) {
  const absl::Time deadline = absl::Now() + options_.start_timeout;
  std::vector<int> descriptors = {options_.interrupt_descriptor, inotify, process.descriptor()};
  for (const ChildProcess& daemon : daemons_) descriptors.push_back(daemon.descriptor());
  for (;;) {
    std::ifstream ready(folder_ / file);
    std::string line;
    if (std::getline(ready, line) && !line.empty()) return line;
    const std::optional<std::size_t> event = wait_readable(descriptors, deadline - absl::Now());
    if (!event) {
      keep_logs_ = true;
      return absl::DeadlineExceededError(absl::StrCat("the cluster is not ready within ",
                                                      absl::FormatDuration(options_.start_timeout), "; ",
                                                      process.epitaph()));
    }
    if (*event == 0) return interrupted_status();
    if (process.ended()) {
      keep_logs_ = true;
      return absl::UnavailableError(process.epitaph());
    }
    if (*event > 2) return failure();
    char events[4096];
    while (read(inotify, events, sizeof events) > 0) {
    }
  }
}

std::vector<pid_t> LocalCluster::processes() const {
  std::vector<pid_t> pids;
  for (const ChildProcess& daemon : daemons_) pids.push_back(daemon.pid());
  return pids;
}

absl::Status LocalCluster::failure() {
  for (ChildProcess& daemon : daemons_) {
    const std::optional<int> end = daemon.ended();
    if (!end || *end == 0) continue;
    keep_logs_ = true;
    return absl::UnavailableError(daemon.epitaph());
  }
  for (ChildProcess& daemon : daemons_) {
    if (daemon.ended()) return absl::UnavailableError(daemon.epitaph());
  }
  return absl::OkStatus();
}

absl::Status LocalCluster::attend(const std::function<absl::Status()>& call,
                                  const std::function<void()>& meanwhile) {
  const int done = eventfd(0, EFD_CLOEXEC);
  if (done < 0) return absl::InternalError(absl::StrCat("no event descriptor: ", std::strerror(errno)));
  absl::Status result;
  std::thread caller([&] {
    result = call();
    eventfd_write(done, 1);
  });
  std::vector<int> descriptors = {done, options_.interrupt_descriptor};
  for (const ChildProcess& daemon : daemons_) descriptors.push_back(daemon.descriptor());
  absl::Status trouble;
  for (;;) {
    const std::optional<std::size_t> event = wait_readable(descriptors, kLookEvery);
    if (event == 0u) break;
    if (!event) {
      meanwhile();
      continue;
    }
    trouble = *event == 1 ? interrupted_status() : failure();
    stop();
    break;
  }
  caller.join();
  close(done);
  return trouble.ok() ? result : trouble;
}

absl::Status LocalCluster::wait_until_ended(absl::Duration timeout) {
  const absl::Time deadline = absl::Now() + timeout;
  for (ChildProcess& daemon : daemons_) {
    if (!daemon.ended() && !wait_readable({daemon.descriptor()}, deadline - absl::Now())) {
      keep_logs_ = true;
      return absl::DeadlineExceededError(
          absl::StrCat(absl::FormatDuration(timeout), " after the shutdown ", daemon.epitaph()));
    }
    const std::optional<int> end = daemon.ended();
    if (end && *end != 0) return failure();
  }
  return absl::OkStatus();
}

absl::Status LocalCluster::wait_for_interrupt(const std::function<void(const std::string&)>& on_loss) {
  std::vector<int> descriptors = {options_.interrupt_descriptor};
  for (const ChildProcess& daemon : daemons_) descriptors.push_back(daemon.descriptor());
  for (const Beside& other : beside_) descriptors.push_back(other.process.descriptor());
  for (;;) {
    const std::optional<std::size_t> event = wait_readable(descriptors, kForever);
    if (!event) continue;
    if (*event == 0) return absl::OkStatus();
    if (*event > daemons_.size()) {
      const auto lost = beside_.begin() + static_cast<std::ptrdiff_t>(*event - 1 - daemons_.size());
      lost->process.ended();
      on_loss(absl::StrCat(lost->name, " is lost: ", lost->process.epitaph()));
      beside_.erase(lost);
      descriptors.erase(descriptors.begin() + static_cast<std::ptrdiff_t>(*event));
      continue;
    }
    const std::size_t place = *event - 1;
    ChildProcess& daemon = daemons_[place];
    if (daemon.ended() == 0) return absl::OkStatus();
    if (!options_.replaces_daemons || !may_replace()) return failure();
    const std::string what =
        absl::StrCat(place == 0 ? "the coordinator" : "a sector server", " is replaced: ", daemon.epitaph());
    if (absl::Status status = replace(place); !status.ok()) return status;
    descriptors[*event] = daemons_[place].descriptor();
    on_loss(what);
  }
}

// Daemons that end as soon as they start would do so for ever.
bool LocalCluster::may_replace() {
  while (!replaced_.empty() && replaced_.front() < absl::Now() - kReplacedSpan) replaced_.pop_front();
  replaced_.push_back(absl::Now());
  return replaced_.size() <= kReplacedMax;
}

absl::Status LocalCluster::replace(std::size_t place) {
  wait_readable({daemons_[place].descriptor()}, options_.start_timeout);
  absl::StatusOr<ChildProcess> another = place == 0 ? new_coordinator(address_) : new_server();
  if (!another.ok()) return another.status();
  daemons_[place] = *std::move(another);
  return absl::OkStatus();
}

void LocalCluster::stop(absl::Duration patience) {
  beside_.clear();
  for (ChildProcess& daemon : daemons_) daemon.signal(SIGTERM);
  const absl::Time deadline = absl::Now() + patience;
  for (ChildProcess& daemon : daemons_) {
    if (!daemon.ended()) wait_readable({daemon.descriptor()}, deadline - absl::Now());
    if (daemon.ended()) continue;
    daemon.signal(SIGKILL);
    wait_readable({daemon.descriptor()}, kForever);
    daemon.ended();
  }
}

}  // namespace tessera::cli
