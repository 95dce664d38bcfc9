// Requests of clients, on their way from gRPC's threads to the thread that owns the coordinator.
#pragma once

#include <absl/status/status.h>

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"
#include "coordinator/limits.h"

namespace tessera {

// Clients take turns: one that sends much waits for itself. Safe to use from any thread.
class RequestQueue {
 public:
  // `wake` is called, on the pushing thread, after a push into the empty queue. At most `bytes_max` wait.
  explicit RequestQueue(std::function<void()> wake, std::size_t bytes_max = kQueuedRequestBytesMax)
      : wake_(std::move(wake)), bytes_max_(bytes_max) {}

  // Whether push() would take a request of so many bytes: RESOURCE_EXHAUSTED beyond kQueuedRequestsMax,
  // kQueuedRequestsPerClientMax or the bytes of all, with the limit, and UNAVAILABLE once it is closed. One
  // request alone may have any size. `client`: its connection; empty: of the process itself.
  absl::Status room_for(std::size_t bytes, const std::string& client = {}) const;

  // Takes the request; or changes nothing, for the same reasons.
  absl::Status push(ClientRequest& request, std::size_t bytes, const std::string& client = {});

  // The next request, whose client then comes after all others that wait; nothing if none does. Those of one
  // client keep their order.
  std::optional<ClientRequest> take_next();
  // All of them.
  std::vector<ClientRequest> take();
  bool is_empty() const;

  // Refuses further requests.
  void close();

 private:
  struct Waiting {
    ClientRequest request;
    std::size_t bytes;
  };

  absl::Status room_locked(std::size_t bytes, const std::string& client) const;

  const std::function<void()> wake_;
  const std::size_t bytes_max_;
  mutable std::mutex mutex_;                            // guards the following
  std::map<std::string, std::deque<Waiting>> waiting_;  // of clients that have a request here
  std::deque<std::string> turns_;                       // these clients
  std::size_t count_ = 0;                               // of the requests
  std::size_t bytes_ = 0;
  bool closed_ = false;
};

}  // namespace tessera
