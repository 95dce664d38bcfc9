// Requests of clients, on their way from gRPC's threads to the thread that owns the coordinator.
#pragma once

#include <absl/status/status.h>

#include <cstddef>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"
#include "coordinator/limits.h"

namespace tessera {

// Safe to use from any thread.
class RequestQueue {
 public:
  // `wake` is called, on the pushing thread, after a push into the empty queue. At most `bytes_max` wait.
  explicit RequestQueue(std::function<void()> wake, std::size_t bytes_max = kQueuedRequestBytesMax)
      : wake_(std::move(wake)), bytes_max_(bytes_max) {}

  // Whether push() would take a request of so many bytes: RESOURCE_EXHAUSTED beyond kQueuedRequestsMax or the
  // bytes of all, with the limit, and UNAVAILABLE once it is closed. One request alone may have any size.
  absl::Status room_for(std::size_t bytes) const;

  // Takes the request; or changes nothing, for the same reasons.
  absl::Status push(ClientRequest& request, std::size_t bytes);

  // All requests since the last call, in order.
  std::vector<ClientRequest> take();

  // Refuses further requests.
  void close();

 private:
  absl::Status room_locked(std::size_t bytes) const;

  const std::function<void()> wake_;
  const std::size_t bytes_max_;
  mutable std::mutex mutex_;  // guards the following
  std::vector<ClientRequest> requests_;
  std::size_t bytes_ = 0;  // of the requests
  bool closed_ = false;
};

}  // namespace tessera
