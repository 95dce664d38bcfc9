// Requests of clients, on their way from gRPC's threads to the thread that owns the coordinator.
#pragma once

#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"

namespace tessera {

// Safe to use from any thread.
class RequestQueue {
 public:
  // `wake` is called, on the pushing thread, after a push into the empty queue.
  explicit RequestQueue(std::function<void()> wake) : wake_(std::move(wake)) {}

  // False, without any effect, if the queue is full (kQueuedRequestsMax) or closed.
  bool push(ClientRequest& request);

  // All requests since the last call, in order.
  std::vector<ClientRequest> take();

  // Refuses further requests.
  void close();

 private:
  std::function<void()> wake_;
  std::mutex mutex_;
  std::vector<ClientRequest> requests_;
  bool closed_ = false;
};

}  // namespace tessera
