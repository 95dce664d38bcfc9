// What clients asked, on its way from the threads of gRPC to the one that owns the coordinator.
#pragma once

#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "coordinator/coordinator.h"

namespace tessera {

// For any thread.
class RequestQueue {
 public:
  // `wake` is called, on the thread that pushes, after something was put into the empty queue.
  explicit RequestQueue(std::function<void()> wake) : wake_(std::move(wake)) {}

  // False, and nothing has happened, for a queue that is full (kQueuedRequestsMax) or closed.
  bool push(ClientRequest& request);

  // All that came since the last time, in order.
  std::vector<ClientRequest> take();

  // Takes no more.
  void close();

 private:
  std::function<void()> wake_;
  std::mutex mutex_;
  std::vector<ClientRequest> requests_;
  bool closed_ = false;
};

}  // namespace tessera
