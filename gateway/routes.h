// Where calls go: the coordinator that leads, and the sector servers that it has.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "gateway/daemon_lines.h"
#include "gateway/limits.h"
#include "keys/keys_folder.h"
#include "tessera.grpc.pb.h"

namespace tessera {

// Asks the coordinators for their status, on a thread of its own, whenever something is not known: which one
// leads, or where a server is. Safe to use from any thread.
class Routes {
 public:
  using Time = std::chrono::system_clock::time_point;
  using Lines = std::shared_ptr<DaemonLines>;
  // Called once, at once or on the thread of the routes, where it must not wait.
  using Found = std::function<void(absl::StatusOr<Lines>)>;
  // Called with the address of the coordinator that leads, or with why none does.
  using Log = std::function<void(const absl::StatusOr<std::string>&)>;

  // Whoever has lines. gRPC cannot end its last channel on a thread on which it calls back: the routes, which
  // have the others, wait for their users.
  class User {
   public:
    explicit User(Routes& routes);
    ~User();
    User(const User&) = delete;
    User& operator=(const User&) = delete;

   private:
    Routes& routes_;
  };

  // `own` are the gateway's, with which it asks; calls are passed on without them. `log` gets what becomes of
  // the coordinators, on the thread of the routes.
  Routes(const std::vector<std::string>& coordinators, const ClientKeys& own, Log log,
         std::chrono::milliseconds wait_max = kRouteWaitMax);
  // What is still looked for is not found. Waits until there is no user.
  ~Routes();

  // The sector server `node`, or the coordinator that leads. After `deadline`, or the longest wait,
  // UNAVAILABLE, as from a coordinator that stands by: nothing was done. For a node that the cluster does not
  // have, it is plainly UNAVAILABLE.
  void find(std::optional<std::uint64_t> node, Time deadline, Found found);

  // A call to `lines` shows that it may not lead any more.
  void doubt(const Lines& lines);

  // UNAVAILABLE while no coordinator is known to lead.
  absl::Status ready() const;

 private:
  struct Coordinator {
    Lines lines;
    std::unique_ptr<v1::Tessera::Stub> own;
  };
  struct Wanted {
    std::optional<std::uint64_t> node;
    Time deadline;
    Found found;
  };

  void run();
  // The status, from whoever leads, whose place is then leader_.
  std::optional<v1::StatusReply> ask();
  void take(const std::optional<v1::StatusReply>& status);
  void answer(std::vector<Wanted> wanted, bool is_known);
  absl::StatusOr<Lines> known(std::optional<std::uint64_t> node) const;
  absl::Status nobody_leads() const;

  const ClientKeys onward_;
  const Log log_;
  const std::chrono::milliseconds wait_max_;
  std::string addresses_;                  // for messages
  std::vector<Coordinator> coordinators_;  // at least one

  mutable std::mutex mutex_;  // guards the following
  std::condition_variable changed_;
  std::size_t leader_ = 0;  // that was one last
  bool is_known_ = false;   // whether it still is
  std::uint64_t doubts_ = 0;
  std::string why_not_;  // what the last one said that did not lead
  std::map<std::uint64_t, Lines> servers_;
  std::vector<Wanted> wanted_;
  std::size_t users_ = 0;
  bool is_closing_ = false;

  std::thread thread_;
};

}  // namespace tessera
